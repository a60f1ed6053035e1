//! Gates: statistics against limits, with a verdict.
