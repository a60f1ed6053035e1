//! Dispersion: parameters, laws and the draws of a case.
