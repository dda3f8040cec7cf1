"""Switched junctions: one mode at a time, and simulation through a schedule of modes."""
