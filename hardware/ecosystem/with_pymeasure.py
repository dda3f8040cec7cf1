"""PyMeasure: our drivers over its adapters, as its instruments. Imports PyMeasure.

The bytes go the way of all voltages: adapter, transport, driver, guard. The instrument has no
method that writes around the guard but PyMeasure's own `write`, which nobody should use on it.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from typing import Any, final

from hardware.contracts import Clock, RawOutput, Transport
from hardware.ecosystem.bluesky_displacement import DisplacementReading, DisplacementSource
from hardware.ecosystem.documents import or_nan
from hardware.envelope import Envelope, GuardedOutput
from hardware.errors import DriverMissing, LinkLost, TimedOut

try:
    from pymeasure.instruments import Instrument
except ImportError as missing:
    raise DriverMissing("PyMeasure is not installed; pip install pymeasure") from missing


@final
class AdapterTransport:
    """Our `Transport` over a PyMeasure adapter (VISA, serial, Prologix, a test's protocol).

    Bytes pass unchanged, line ends included. The adapter has its own time-out; a longer one asked
    for has no effect, a shorter one neither.

    Parameters
    ----------
    adapter : pymeasure.adapters.Adapter
        Connected already, as PyMeasure's are.
    """

    def __init__(self, adapter: Any) -> None:
        self._adapter = adapter
        self._partial = b""

    @property
    def address(self) -> str:
        """Kind of the adapter and what it tells about itself."""
        resource = getattr(getattr(self._adapter, "connection", None), "resource_name", "")
        name = resource if isinstance(resource, str) and resource else "?"
        return f"{type(self._adapter).__name__} {name}"

    def open(self) -> None:
        """Do nothing."""

    def close(self) -> None:
        """Close the adapter; never raises."""
        with contextlib.suppress(Exception):
            self._adapter.close()

    def write(self, data: bytes) -> None:
        """Send all of it."""
        self._translated(lambda: self._adapter.write_bytes(data))

    def read_until(self, ends: bytes | tuple[bytes, ...], timeout: float) -> bytes:
        """Return bytes up to and with one of the terminators; they come one by one."""
        while not self._partial.endswith(ends):
            byte = self._translated(lambda: self._adapter.read_bytes(1))
            if not byte:
                raise TimedOut(f"{self.address}: no end of line in time", self._partial)
            self._partial += bytes(byte)
        line, self._partial = self._partial, b""
        return line

    def drain(self) -> bytes:
        """Forget everything that waits; what the adapter had is not shown."""
        kept, self._partial = self._partial, b""
        self._translated(self._adapter.flush_read_buffer)
        return kept

    def _translated(self, action: Callable[[], Any]) -> Any:
        """Do it; errors of links become ours."""
        try:
            return action()
        except TimeoutError as error:
            raise TimedOut(f"{self.address}: {error}", self._partial) from error
        except OSError as error:
            raise LinkLost(f"{self.address}: {error}; check the cable", self._partial) from error
        except Exception as error:
            # VISA's errors are no OSErrors and carry a name
            if not hasattr(error, "abbreviation"):
                raise
            kind = TimedOut if "TMO" in str(error.abbreviation) else LinkLost
            raise kind(f"{self.address}: {error}", self._partial) from error


@final
class PyMeasureVoltage(Instrument):  # type: ignore[misc]
    """A guarded voltage as a PyMeasure instrument; parked on `shutdown`.

    Parameters
    ----------
    adapter : pymeasure.adapters.Adapter or str
        As for every instrument of PyMeasure.
    driver : callable
        Makes a `RawOutput` from a transport, such as
        ``lambda link: GcsController(GcsTalk(link))``.
    envelope : Envelope
        Limits of the actuator.
    clock : Clock, optional
        Time of the program.
    name : str
        Of the instrument.
    **options
        Of PyMeasure's adapter.
    """

    def __init__(
        self,
        adapter: Any,
        driver: Callable[[Transport], RawOutput],
        envelope: Envelope,
        clock: Clock | None = None,
        name: str = "guarded voltage",
        **options: Any,
    ) -> None:
        super().__init__(adapter, name, includeSCPI=False, **options)
        self.output = GuardedOutput(driver(AdapterTransport(self.adapter)), envelope, clock)

    def power_up(self) -> None:
        """Bring the device to its safe value; needed once."""
        self.output.power_up()

    @property
    def voltage(self) -> float:
        """Voltage last commanded (V), NaN while unknown; setting it ramps there."""
        return or_nan(self.output.present)

    @voltage.setter
    def voltage(self, volts: float) -> None:
        self.output.ramp(volts)

    @property
    def measured_voltage(self) -> float:
        """Voltage as the device tells (V); NaN where it cannot."""
        return or_nan(self.output.read())

    def step_to(self, volts: float) -> None:
        """Jump to a voltage (V) if the envelope allows the step."""
        self.output.set(volts)

    def shutdown(self) -> None:
        """Park and let go."""
        self.output.close()
        super().shutdown()


@final
class PyMeasureDisplacement:
    """A displacement sensor with properties as PyMeasure's procedures read them.

    No adapter is between: the interferometer's library carries the data.

    Parameters
    ----------
    source : DisplacementSource
        The interferometer.
    """

    def __init__(self, source: DisplacementSource) -> None:
        self._source = source
        self._last: DisplacementReading | None = None

    @property
    def displacement(self) -> float:
        """Displacement (m), taken now."""
        self._last = self._source.read()
        return self._last.value

    @property
    def flags(self) -> int:
        """Flags of the last value, 0 before the first."""
        return 0 if self._last is None else int(self._last.flags)

    def zero(self) -> None:
        """Set to zero here."""
        self._source.zero()
