"""Hand-made vectors for the sums over a covariance; each has a twin in plain loops."""
