//! Modes of a linear model: poles, vectors and their identity.
