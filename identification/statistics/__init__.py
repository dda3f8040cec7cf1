"""Statistics of residuals and signals, one of each; it knows neither fits nor diagnoses."""
