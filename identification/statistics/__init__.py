"""Statistics of residuals, one of each."""
