"""What an analogue amplifier does to a voltage, as numbers."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from bondgraph.support.errors import UnusableInput
from hardware.errors import LimitViolation


@dataclass(frozen=True, slots=True)
class Monitors:
    """Inputs that show what the amplifier really gives.

    Parameters
    ----------
    voltage : float, optional
        Voltage at the monitor output per voltage at the actuator (1/20 for a 1:20 monitor).
    current : float, optional
        Voltage at the monitor output per current (V/A).
    voltage_offset, current_offset : float
        Voltage at the monitor outputs at 0 V and 0 A (V).
    """

    voltage: float | None = None
    current: float | None = None
    voltage_offset: float = 0.0
    current_offset: float = 0.0

    def __post_init__(self) -> None:
        """Refuse a scale that tells nothing."""
        for name, scale in (("voltage", self.voltage), ("current", self.current)):
            if scale is not None and not (math.isfinite(scale) and scale != 0.0):
                raise UnusableInput(f"monitor scale of the {name} is {scale}; it has to be nonzero")

    def channels(self) -> tuple[str, ...]:
        """Names of what is monitored, in the order of the inputs: ``V_mon``, then ``i``."""
        return tuple(n for n, s in (("V_mon", self.voltage), ("i", self.current)) if s is not None)

    def scaled(self, name: str, volts: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return ``V_mon`` (V) or ``i`` (A) from volts at the input."""
        if name == "V_mon" and self.voltage is not None:
            return np.asarray((volts - self.voltage_offset) / self.voltage)
        if name == "i" and self.current is not None:
            return np.asarray((volts - self.current_offset) / self.current)
        raise UnusableInput(f"no monitor {name!r}; there are: {', '.join(self.channels())}")


@dataclass(frozen=True, slots=True)
class Amplifier:
    """A voltage amplifier: ``V = gain v + offset``.

    Parameters
    ----------
    gain : float
        Voltage at the actuator per voltage of the converter.
    offset : float
        Voltage at the actuator for 0 V of the converter (V).
    lowest, highest : float
        Voltages allowed at the actuator (V): the narrower of what the amplifier can give and what
        the actuator stands.
    current : float
        Largest current (A).
    bandwidth : float
        Small signal bandwidth (Hz).
    slew : float
        Largest rate of the output (V/s).
    u_gain, u_offset : float
        Standard uncertainties; infinite while only a data sheet tells.
    monitors : Monitors
        Its monitor outputs.
    name, source : str
        Model, and where the numbers are from.

    Examples
    --------
    >>> stack = Amplifier(gain=20.0, lowest=0.0, highest=100.0)
    >>> stack.input_volts(50.0)
    2.5
    """

    gain: float
    offset: float = 0.0
    lowest: float = 0.0
    highest: float = 100.0
    current: float = math.inf
    bandwidth: float = math.inf
    slew: float = math.inf
    u_gain: float = math.inf
    u_offset: float = math.inf
    monitors: Monitors = field(default_factory=Monitors)
    name: str = "amplifier"
    source: str = "user"

    def __post_init__(self) -> None:
        """Refuse an amplifier that is none."""
        if not math.isfinite(self.gain) or self.gain == 0.0 or not math.isfinite(self.offset):
            raise UnusableInput(
                f"{self.name}: gain {self.gain} and offset {self.offset} V have to be finite, the "
                "gain nonzero"
            )
        if not self.lowest <= 0.0 <= self.highest or self.lowest == self.highest:
            raise UnusableInput(
                f"{self.name}: the range {self.lowest} to {self.highest} V has to contain 0 V"
            )
        if min(self.current, self.bandwidth, self.slew) <= 0.0:
            raise UnusableInput(f"{self.name}: current, bandwidth and slew have to be > 0")

    def input_volts(self, volts: float) -> float:
        """Voltage of the converter (V) for a voltage at the actuator (V); `LimitViolation`."""
        self.check(np.array([volts]))
        return (volts - self.offset) / self.gain

    def input_record(self, volts: NDArray[np.float64]) -> NDArray[np.float64]:
        """Voltages of the converter (V) for a whole record; `LimitViolation` on any of them."""
        self.check(volts)
        return np.asarray((volts - self.offset) / self.gain)

    def output_record(self, volts: NDArray[np.float64]) -> NDArray[np.float64]:
        """Voltages at the actuator (V) for voltages of the converter (V)."""
        return np.asarray(self.gain * volts + self.offset)

    def check(self, volts: NDArray[np.float64]) -> None:
        """Refuse what is no number or outside the range."""
        bad = ~((volts >= self.lowest) & (volts <= self.highest))
        if bad.any():
            n = int(np.argmax(bad))
            raise LimitViolation(
                f"{self.name}: {float(volts.flat[n])!r} V (sample {n}) is not within "
                f"{self.lowest:g} to {self.highest:g} V at the actuator; nothing was written"
            )

    def monitored(self, inputs: Sequence[object]) -> tuple[str, ...]:
        """Return what the inputs read that its monitors are wired to; nothing without inputs."""
        names = self.monitors.channels() if inputs else ()
        if len(names) != len(inputs):
            raise UnusableInput(
                f"{self.name} has monitors {self.monitors.channels()}, connected are the inputs "
                f"{tuple(inputs)}; name one input for each"
            )
        return names

    def provenance(self) -> dict[str, float | str]:
        """Return the numbers that a recording has to keep."""
        return {
            "name": self.name,
            "source": self.source,
            "gain": self.gain,
            "u_gain": self.u_gain,
            "offset": self.offset,
            "u_offset": self.u_offset,
            "lowest": self.lowest,
            "highest": self.highest,
            "current": self.current,
            "bandwidth": self.bandwidth,
            "slew": self.slew,
        }


EPA_104 = Amplifier(
    gain=20.0,
    lowest=0.0,
    highest=100.0,
    current=0.2,
    bandwidth=250e3,
    slew=380e6,
    monitors=Monitors(voltage=1.0 / 20.0),
    name="EPA-104",
    source="from memory, not from a data sheet: set it from yours and calibrate",
)
"""Like a Piezo Systems EPA-104 on a 100 V stack.

The amplifier itself is said to give +-200 V, so at its gain of 20 the converter is kept within 0 to
5 V. No figure here was confirmed: gain, current, slew and monitor scale are to be set by the user.
"""
