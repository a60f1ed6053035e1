//! A stick model of beams, masses and springs, and its free-free modes.
