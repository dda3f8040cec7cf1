"""Piezoelectric materials: constants, their forms, temperature and age, resonance, circuits."""
