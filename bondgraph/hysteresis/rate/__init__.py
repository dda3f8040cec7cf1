"""Hysteresis whose width depends on the rate of the input."""
