"""Drivers of real devices, one folder a kind."""
