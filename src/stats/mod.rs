//! Statistics of samples: moments, quantiles, proportions and tolerance bounds; knows no rocket.
