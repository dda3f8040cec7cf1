"""The interferometer: opened, zeroed, read; its air, its health, its ellipse correction."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import final

import numpy as np

from bondgraph.support.errors import UnusableInput
from hardware.contracts import Air, Clock, Flag, WallClock
from hardware.devices.interferometer.connection import Connection
from hardware.devices.interferometer.constants import Aux, Info, Measure, Trigger, ValueStatus
from hardware.devices.interferometer.environment import RANGES, AirCorrection, EnvironmentWatch
from hardware.devices.interferometer.library import VendorLibrary
from hardware.devices.interferometer.pump import Drained, drain
from hardware.devices.interferometer.readouts import (
    EllipseCorrection,
    Health,
    OpticalReading,
    ellipse_of,
    health_of,
    number_at,
)
from hardware.devices.interferometer.watch import MeasurementWatch
from hardware.errors import BeamLost, ProtocolFault, TimedOut

_READ_RATE = 1000.0
_TRIES = 10
_AT_REST = 10e-6
_MANUAL_AIR = 0x0002 | 0x0004 | 0x0008


@final
class Interferometer(Connection):
    """A SIOS interferometer behind the vendor's library.

    A fringe counter is relative: after opening, after a lost link and after a lost beam nothing is
    read before `zero`.

    Parameters
    ----------
    address : str
        ``usb``, ``usb:1``, ``usb:serial=1234``, ``com:PORT``, ``net:HOST:PORT``, ``demo``.
    library : VendorLibrary or path, optional
        The vendor's library; see `VendorLibrary`.
    clock : Clock, optional
        Time of the program; all waiting goes through it.
    dead_path : float
        Path in air between the head and the zero position (m), whole millimetres.
    preset : float
        Displacement at the zero (m).
    channel : int
        Beam, 0 to 3.

    Raises
    ------
    DriverMissing, LinkLost, UnusableInput
        No library, nobody there, address or dead path that cannot be used.
    """

    def __init__(
        self,
        address: str = "usb",
        *,
        library: VendorLibrary | str | Path | None = None,
        clock: Clock | None = None,
        dead_path: float = 0.0,
        preset: float = 0.0,
        channel: int = 0,
    ) -> None:
        self._dead_path_mm = _millimetres(dead_path)
        self._preset = preset
        self.channel = channel
        self.amplitude = 0.0
        self.stabilised = False
        super().__init__(
            library if isinstance(library, VendorLibrary) else VendorLibrary(library),
            address,
            WallClock() if clock is None else clock,
        )

    def _connect(self) -> None:
        super()._connect()
        self._air = EnvironmentWatch(self.library, self.handle, self.channel, self.clock)

    # ---- zero and value

    @property
    def zeroed(self) -> bool:
        """Whether displacements mean anything."""
        return self._zeroed

    def beam_lost(self) -> None:
        """Note that fringes may have been lost: nothing is read before the next zero."""
        self._zeroed = False

    def require_zero(self) -> None:
        """Raise `BeamLost` unless the counter has a zero."""
        if not self._zeroed:
            raise BeamLost(
                f"interferometer {self.identity.serial}: the fringe counter has no zero since it "
                "was opened or lost its beam; bring the mirror to its zero position and call zero()"
            )

    def zero(self) -> None:
        """Set the displacement to zero (to the preset) here, and clear the flags of the beam.

        Dead path and preset are handed over first, since the device takes them over only then.

        Raises
        ------
        BeamLost
            If there is no beam to count.
        ProtocolFault
            If the values do not come to the preset.
        """
        self._idle("zero")
        self._zeroed = False
        call = self._call
        call("IfmSetDeadPath", self.handle, self.channel, self._dead_path_mm)
        call("IfmSetPreset", self.handle, self.channel, 1e9 * self._preset)
        call("IfmSetToZero", self.handle, 1 << self.channel)
        value = self._settled()
        status = ValueStatus(int(value.status[0]))
        if status & (ValueStatus.QUADRANT | ValueStatus.LEVEL):
            raise BeamLost(
                f"interferometer {self.identity.serial}: no beam at the zero ({status!r}); align "
                "the mirror until the signal quality is good"
            )
        self.amplitude = float(value.aux[Aux.NORM][0])
        self.stabilised = bool(status & ValueStatus.LASER_STABLE)
        self._zeroed = True

    def _settled(self) -> Drained:
        """Return the first value after the zero has taken effect: commands may be on their way."""
        for _ in range(_TRIES):
            value = self._single()
            away = 1e-9 * float(value.length[0]) - self._preset
            if abs(away) < _AT_REST or int(value.status[0]) & (
                ValueStatus.QUADRANT | ValueStatus.LEVEL
            ):
                return value
            self.clock.sleep(0.05)
        raise ProtocolFault(
            f"interferometer {self.identity.serial}: {1e6 * away:.3g} um from the preset after "
            "set-to-zero; bring the mirror to rest and call zero() again"
        )

    def read(self) -> OpticalReading:
        """Return one displacement now; of a running stream the newest value, which stays in it.

        Raises
        ------
        BeamLost
            Without zero, or with the reading as `partial` if the beam is lost.
        """
        self.require_zero()
        value = self._newest() if self.busy is not None else self._single()
        watch = MeasurementWatch("interferometer", (), self.amplitude, self.stabilised)
        (chunk,) = watch.chunks(value, self.environment().flag)
        flags = Flag(int(chunk.flags[0]))
        reading = OpticalReading(float(chunk.channels["x"][0]), flags, self.clock.now())
        if flags & Flag.BEAM_LOST:
            self.beam_lost()
            raise BeamLost(
                f"interferometer {self.identity.serial}: beam lost ({flags!r}); zero() again",
                reading,
            )
        return reading

    def vibrate_reference(self, on: bool) -> None:
        """Let the reference mirror vibrate, for adjustment; afterwards there is no zero.

        Raises
        ------
        DriverMissing
            The library cannot.
        """
        self._idle("the reference mirror")
        self._zeroed = False
        self._call("IfmSetRefMirrorVibration", self.handle, self.channel, int(on))

    def _single(self) -> Drained:
        call = self._call
        call("IfmSetTrigger", self.handle, Trigger.OFF)
        call("IfmSetMeasurement", self.handle, self.measure_flags(), _READ_RATE)
        call("IfmStart", self.handle)
        try:
            return self._newest()
        finally:
            call("IfmStop", self.handle)
            call("IfmClearBuffers", self.handle)

    def _newest(self, patience: float = 1.0) -> Drained:
        end = self.clock.now() + patience
        while self._call("IfmValueCount", self.handle) < 1:
            if self.clock.now() >= end:
                raise TimedOut(
                    f"interferometer {self.identity.serial}: no value for {patience:g} s; is it "
                    "waiting for a trigger or a clock?"
                )
            self.clock.sleep(2e-3)
        wanted = (Aux.NORM, Aux.SAMPLE)
        value = drain(self.library, self.handle, 1, wanted, channel=self.channel, oldest=0)
        if value.length.size == 0:
            raise self.gone()
        return value

    # ---- air and health

    def environment(self) -> AirCorrection:
        """Return air, wavelength, and what speaks against the correction."""
        return self._guarded(self._air.read)

    def air(self) -> Air | None:
        """Return the state of the air."""
        return self.environment().air

    def tell_air(self, temperature: float, pressure: float, humidity: float) -> None:
        """Give the device the air (K, Pa, relative 0 to 1) that it has no sensors for.

        Raises
        ------
        UnusableInput
            If a value lies outside of what the correction is made for; nothing is sent then.
        """
        told = {"temperature": temperature, "pressure": pressure, "humidity": humidity}
        for name, value in told.items():
            low, high, unit = RANGES[name]
            if not low <= value <= high:
                raise UnusableInput(
                    f"interferometer: {name} {value:g} {unit} outside {low:g} to {high:g}; give K, "
                    "Pa and a relative humidity of 0 to 1"
                )
        d, c = self.handle, self.channel
        self._call("IfmSetTemperature", d, c, temperature - 273.15)
        self._call("IfmSetAirPressure", d, c, pressure)
        self._call("IfmSetHumidity", d, c, 100.0 * humidity)

    def use_sensors(self) -> None:
        """Take the air from the device's sensors again."""
        self._call("IfmResetManualEnvironment", self.handle, self.channel, _MANUAL_AIR)

    def correct_for_air(self, on: bool) -> None:
        """Switch the device's own correction for air on or off."""
        self._call("IfmEnableEdlenCorrection", self.handle, self.channel, int(on))

    def health(self) -> Health:
        """Return the state of beam, laser and buffers since the last zero."""
        return self._guarded(lambda: health_of(self.library, self.handle, self.channel))

    def ellipse(self) -> EllipseCorrection:
        """Return the device's own correction of its quadrature signals."""
        return self._guarded(lambda: ellipse_of(self.library, self.handle))

    # ---- for the measurements

    def measure_flags(
        self, extras: Sequence[str] = (), processing: Measure = Measure.FILTER_OFF
    ) -> Measure:
        """Return what a value must consist of: extra channels, and how it is filtered."""
        flags = Measure.LENGTH | Measure.CIRCLE | Measure.SAMPLE | processing
        flags |= Measure(Measure.CHANNEL_1 << self.channel)
        if {"sin", "cos"} & {*extras}:
            flags |= Measure.QUADRATURE
        return flags | (Measure.CLOCK if "clock" in extras else Measure(0))

    def true_rate(self, asked: float) -> float:
        """Rate that the device has really set (Hz)."""
        told = number_at(self.library, self.handle, Info.RATE_AT)
        return told if np.isfinite(told) and told > 0.0 else asked

    def _idle(self, what: str) -> None:
        if self.busy is not None:
            raise ProtocolFault(
                f"interferometer {self.identity.serial}: {what} while a measurement runs; "
                "finish() or abort() it first"
            )

    def occupy(self, by: object) -> None:
        """Reserve the device for one measurement."""
        self._idle("a second measurement")
        self.require_zero()
        self.busy = by

    def release(self, by: object) -> None:
        """Give the device back; nothing if another has it."""
        if self.busy is by:
            self.busy = None


def _millimetres(dead_path: float) -> int:
    mm = 1e3 * dead_path
    if not (np.isfinite(mm) and mm >= 0.0 and abs(mm - round(mm)) < 1e-6):
        raise UnusableInput(
            f"interferometer: dead path {dead_path!r} m; the device takes whole millimetres >= 0"
        )
    return round(mm)
