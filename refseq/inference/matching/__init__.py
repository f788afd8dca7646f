"""Matching one view with all places: incidence matrix, Bernoulli mixture, log-likelihood ratios."""
