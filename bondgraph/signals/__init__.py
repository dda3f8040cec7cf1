"""Recordings: channels in SI, units, splits, resampling, delays."""
