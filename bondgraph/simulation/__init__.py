"""Simulation of whole records: the exact step of Lur'e models, the Radau step of all others."""
