"""Slow after-effects, alone and beside hysteresis."""
