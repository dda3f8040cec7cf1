"""Score test of every effect at every port, without a fit."""
