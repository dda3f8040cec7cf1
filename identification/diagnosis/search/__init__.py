"""Candidates fitted in rounds, effects added one after the other."""
