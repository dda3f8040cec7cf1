"""Real recordings with known missing physics: impoverished models, fixed in advance."""
