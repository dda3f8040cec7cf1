"""Do 95 % intervals hold the truth in 95 %? By simulation."""
