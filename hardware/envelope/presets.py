"""Limits of known actuators; check them against your own data sheet."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

from hardware.envelope.limits import Envelope

P840_1 = Envelope(
    v_min=-20.0,
    v_max=100.0,
    slew=1e5,
    i_max=0.2,
    capacitance=1.875e-6,
    f_max=9e3,
    gentle=250.0,
    update_period=2e-4,
    name="P-840.1",
)
"""The stack of the stack actuator thesis behind an amplifier of 200 mA.

From table 3.1 of the thesis: 100 V; 1.875 uF is the large-signal capacitance in its operating
current coefficient, 12.5 uA/(Hz um) 15 um / 100 V (the small-signal value is 1.5 uF); 9 kHz is half
of the resonance at 18 kHz, unloaded. -20 V is the usual limit of such stacks. The amplifier's
200 mA is a figure quoted for the EPA-104 that was not confirmed: enter your own. No dwell is known.
"""

P840_1_UNIPOLAR = replace(P840_1, v_min=0.0, name="P-840.1, 0..100 V")
"""The same within 0..100 V, where all measurements of the thesis lie."""

PRESETS: Mapping[str, Envelope] = MappingProxyType(
    {"P-840.1": P840_1, "P-840.1-unipolar": P840_1_UNIPOLAR}
)
"""By name."""
