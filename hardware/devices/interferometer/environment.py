"""Air as the device's sensors tell it, and whether it may be believed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, final

from hardware.contracts import Air, Clock, Flag
from hardware.devices.interferometer.constants import AirFlag, Info
from hardware.devices.interferometer.library import VendorLibrary

OLDEST: Final = 4.0
"""Age (s) from which a value of the air is stale."""

RANGES: Final = {
    "temperature": (277.15, 323.15, "K"),
    "pressure": (70e3, 120e3, "Pa"),
    "humidity": (0.03, 0.99, ""),
}
"""What the correction is made for: 4 to 50 degC, 70 to 120 kPa, 3 to 99 %."""

_SENSORS = (
    ("temperature", "IfmTemperature", 1.0, 273.15),
    ("pressure", "IfmAirPressure", 1.0, 0.0),
    ("humidity", "IfmHumidity", 0.01, 0.0),
)


@dataclass(frozen=True, slots=True)
class AirCorrection:
    """State of the correction for air.

    Parameters
    ----------
    air : Air
        Values used; `measured` only if all three were measured and lie in range.
    wavelength, vacuum_wavelength : float
        m.
    correcting : bool
        Whether the device corrects for air.
    problems : tuple of str
        What speaks against the values, one plain phrase each; empty if nothing does.
    """

    air: Air
    wavelength: float
    vacuum_wavelength: float
    correcting: bool
    problems: tuple[str, ...]

    @property
    def flag(self) -> Flag:
        """Flag for samples taken under it."""
        return Flag.AIR_STALE if self.problems and self.correcting else Flag.GOOD


@final
class EnvironmentWatch:
    """Reads the air and remembers when each sensor last spoke.

    Parameters
    ----------
    library : VendorLibrary
        The library.
    device : int
        Handle.
    channel : int
        Beam.
    clock : Clock
        Time of the program; the age of a value counts from the reading at which its counter was
        first seen to have moved.
    """

    def __init__(self, library: VendorLibrary, device: int, channel: int, clock: Clock) -> None:
        self._library, self._device, self._channel = library, device, channel
        self._clock = clock
        self._spoke: dict[str, tuple[int, float]] = {}

    def read(self) -> AirCorrection:
        """Return the present state.

        Raises
        ------
        LinkLost
            If the device is gone.
        """
        call, d, c = self._library.call, self._device, self._channel
        values: dict[str, float] = {}
        problems: list[str] = []
        measured, oldest = True, 0.0
        for name, function, factor, offset in _SENSORS:
            values[name] = offset + factor * float(call(function, d, c))
            flags = int(call(f"{function}Flags", d, c))
            low, high, unit = RANGES[name]
            if not low <= values[name] <= high:
                problems.append(
                    f"{name} {values[name]:g} {unit} outside {low:g} to {high:g}".strip()
                )
            if flags & AirFlag.MANUAL:
                measured = False
                continue
            if not flags & AirFlag.MEASURED:
                measured = False
                problems.append(f"{name} is a default, no sensor")
                continue
            age = self._age(name, flags)
            oldest = max(oldest, age)
            if age > OLDEST or not flags & AirFlag.CURRENT:
                problems.append(f"{name} is stale ({age:.0f} s)")
        return AirCorrection(
            Air(
                values["temperature"],
                values["pressure"],
                values["humidity"],
                float(call("IfmAirRefraction", d, c)),
                measured and not any("outside" in p for p in problems),
                oldest,
            ),
            1e-9 * float(call("IfmWavelength", d, c)),
            1e-9 * float(call("IfmVacuumWavelength", d, c)),
            bool(call("IfmIsEdlenEnabled", d, c)),
            tuple(problems),
        )

    def _age(self, name: str, flags: int) -> float:
        """Time since the counter of a sensor last moved (s)."""
        sensor = flags & 0xFF
        count = int(
            self._library.call("IfmDeviceInfo", self._device, Info.AIR_COUNTER | sensor << 8)
        )
        now = self._clock.now()
        known = self._spoke.get(name)
        if known is None or known[0] != count:
            self._spoke[name] = known = (count, now)
        return now - known[1]
