"""Sums of plays, stops and dead zones: piecewise linear, with exact inverses."""
