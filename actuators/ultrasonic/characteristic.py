"""Control voltage to force, as far as the text of the stack actuator thesis tells it.

Section 8.2.1 gives three facts: a dead zone of about 2 V to either side, a quick rise after it,
and the maximum around 6 V. The two points between 2 V and 6 V that the table needs are chosen
to rise quickly; they are not digitised from figure 8.3. The thesis measured positive voltages and
mirrored them, and so does the table.
"""

from __future__ import annotations

import numpy as np

from actuators.ultrasonic.data_sheet import M661
from bondgraph.laws.table import TableLaw
from bondgraph.support.arrays import Array
from bondgraph.support.errors import UnusableInput
from bondgraph.support.ops import NUMPY

VOLTAGE = (0.0, 2.0, 3.0, 4.0, 5.0, 6.0, 10.0)
"""V; 0, 2, 6 and 10 from the text, the others to join them."""
SHARE = (0.0, 0.0, 0.40, 0.72, 0.92, 1.0, 1.0)
"""Share of the largest force at each of `VOLTAGE`."""
DEAD_ZONE = VOLTAGE[1]


def voltage_force(largest: float = M661.push_force, join: str = "linear") -> TableLaw:
    """Law of a drive: force (N) at a control voltage (V).

    The reference slope is 1 N/V, the identity that a drive's law departs from.
    """
    if not largest > 0:
        raise UnusableInput(f"voltage_force: the largest force is {largest:g} N; it has to be > 0")
    return TableLaw.odd(VOLTAGE, tuple(largest * s for s in SHARE), join=join, unit="N")


def force(control: Array | float, largest: float = M661.push_force) -> Array:
    """Steady force (N) at control voltages (V), any shape."""
    return np.asarray(voltage_force(largest).output(NUMPY, np.asarray(control, float), ()))


def control_voltage(wanted: Array | float, largest: float = M661.push_force) -> Array:
    """Control voltage (V) that gives a force (N): the inverse, with a jump over the dead zone.

    Forces beyond the largest get the voltage of the largest, zero gets zero.
    """
    size = np.minimum(np.abs(np.asarray(wanted, float)) / largest, 1.0)
    return np.sign(wanted) * np.where(size > 0, np.interp(size, SHARE[1:-1], VOLTAGE[1:-1]), 0.0)
