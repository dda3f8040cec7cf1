"""Locate the mismatch, say what physics was left out, model it, show the fit improve."""
