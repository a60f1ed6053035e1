//! Dynamics: from one drawn vehicle to one linear model.
