"""The voltages and the current that the thesis' stack stands."""

from bondgraph.signals.drive_limits import DriveLimits

UNIPOLAR = DriveLimits(0.0, 100.0)
"""0 to 100 V, the range of all measurements of the stack actuator thesis."""

P840_1 = DriveLimits(-20.0, 120.0, current=0.2, capacitance=1.5e-6)
"""What the data sheet of the P-840.1 allows, behind an amplifier of 200 mA."""
