"""NI cards through the maker's ``nidaqmx`` package: single values, inputs, and its errors.

Written from the signatures of nidaqmx 1.7. It has never run on NI's driver, which is not available
here; the tests use a double that records the calls.
"""

from __future__ import annotations

import importlib
import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from hardware.contracts import Identity
from hardware.errors import (
    DriverMissing,
    HardwareError,
    LimitViolation,
    LinkLost,
    Overrun,
    ProtocolFault,
    TimedOut,
)

_KINDS: Mapping[int, type[HardwareError]] = {
    -200324: LinkLost,  # device absent or unavailable
    -201003: LinkLost,  # device cannot be accessed
    -89130: LinkLost,  # device absent, while routing
    -200220: LinkLost,  # no such device
    -200284: TimedOut,  # samples not yet available
    -200279: Overrun,  # samples no longer available
    -200621: Overrun,  # the output's queue ran empty
}


def driver() -> Any:
    """Import nidaqmx, or say in one line that it is missing."""
    try:
        return importlib.import_module("nidaqmx")
    except ImportError as error:
        raise DriverMissing(
            "NI cards need the package nidaqmx and NI's own driver NI-DAQmx: pip install nidaqmx, "
            "then `python -m nidaqmx installdriver`"
        ) from error


@contextmanager
def translated(what: str) -> Iterator[Any]:
    """Give the module, and turn its errors into those of the bench."""
    nidaqmx = driver()
    try:
        yield nidaqmx
    except nidaqmx.errors.DaqError as error:
        kind = _KINDS.get(error.error_code, ProtocolFault)
        raise kind(f"NI, {what}: {str(error).splitlines()[0]} ({error.error_code})") from error
    except (nidaqmx.errors.DaqNotFoundError, nidaqmx.errors.DaqNotSupportedError) as error:
        raise DriverMissing(
            f"NI, {what}: the driver NI-DAQmx is not installed; `python -m nidaqmx installdriver`"
        ) from error


def clocked(
    task: Any, kinds: Any, rate: float, count: int, source: str = "", trigger: str = ""
) -> None:
    """Give a task a sample clock (the card's own without `source`) and a start trigger, if any."""
    task.timing.cfg_samp_clk_timing(
        rate,
        source=source,
        active_edge=kinds.Edge.RISING,
        sample_mode=kinds.AcquisitionType.FINITE,
        samps_per_chan=count,
    )
    if trigger:
        task.triggers.start_trigger.cfg_dig_edge_start_trig(trigger, trigger_edge=kinds.Edge.RISING)


@final
class NiChannel:
    """One analogue output, written value by value.

    Parameters
    ----------
    name : str
        Such as ``"Dev1/ao0"``.
    lowest, highest : float
        Range asked of the card (V).
    """

    def __init__(self, name: str, lowest: float = -10.0, highest: float = 10.0) -> None:
        self.name = name
        self._lowest = lowest
        self._highest = highest
        self._task: Any = None

    @property
    def device(self) -> str:
        """Name of the device."""
        return self.name.split("/")[0]

    @property
    def identity(self) -> Identity:
        """Model and serial number, as the driver tells; only the maker while it does not."""
        try:
            with translated("identity"):
                device = importlib.import_module("nidaqmx.system").Device(self.device)
                return Identity("NI", str(device.product_type), f"{device.serial_num:08X}")
        except HardwareError:
            return Identity("NI")

    @property
    def lowest(self) -> float:
        """Lowest voltage (V)."""
        return self._lowest

    @property
    def highest(self) -> float:
        """Highest voltage (V)."""
        return self._highest

    @property
    def resolution(self) -> float:
        """Smallest step (V): unknown here, the driver does not tell it."""
        return 0.0

    def adopt(self) -> bool:
        """Take over the output: these cards keep their last value when a program ends."""
        self._opened()
        return True

    def power_up(self) -> None:
        """Write 0 V."""
        self.write(0.0)

    def write(self, volts: float) -> float:
        """Set (V); `LimitViolation` before anything is sent."""
        if not math.isfinite(volts) or not self._lowest <= volts <= self._highest:
            raise LimitViolation(
                f"{self.name}: {volts!r} V is not within {self._lowest:g} to {self._highest:g} V; "
                "nothing was written"
            )
        task = self._opened()
        with translated(f"{self.name} write"):
            task.write(volts, auto_start=True)
        return volts

    def release(self) -> None:
        """Give the output free for a timed task; it keeps its value. Never raises."""
        task, self._task = self._task, None
        if task is not None:
            with suppress(Exception):
                task.close()

    def close(self) -> None:
        """Let go; the output keeps its value."""
        self.release()

    def add_to(self, task: Any) -> None:
        """Make it the output of a task, within its range."""
        task.ao_channels.add_ao_voltage_chan(self.name, min_val=self._lowest, max_val=self._highest)

    def _opened(self) -> Any:
        if self._task is None:
            with translated(f"{self.name} open") as nidaqmx:
                task = nidaqmx.Task()
                try:
                    self.add_to(task)
                except BaseException:
                    task.close()
                    raise
                self._task = task
        return self._task


@final
class NiTimedInputs:
    """Some analogue inputs on a sample clock, drained piece by piece.

    Parameters
    ----------
    names : sequence of str
        Such as ``("Dev1/ai0", "Dev1/ai1")``.
    source : str
        Terminal of the sample clock; empty for the card's own. ``"/Dev1/ao/SampleClock"`` samples
        with every output value.
    trigger : str
        Terminal of the start trigger; empty to start at once.
    """

    def __init__(self, names: Sequence[str], source: str = "", trigger: str = "") -> None:
        self.names = tuple(names)
        self._source = source
        self._trigger = trigger
        self._task: Any = None
        self._reader: Any = None

    def start(self, rate: float, count: int) -> None:
        """Prepare `count` samples at `rate` (Hz) and start, or wait for clock and trigger."""
        self.stop()
        with translated("inputs") as nidaqmx:
            readers = importlib.import_module("nidaqmx.stream_readers")
            task = nidaqmx.Task()
            self._task = task
            for name in self.names:
                task.ai_channels.add_ai_voltage_chan(name, min_val=-10.0, max_val=10.0)
            clocked(task, nidaqmx.constants, rate, count, self._source, self._trigger)
            self._reader = readers.AnalogMultiChannelReader(task.in_stream)
            task.start()

    def drain(self) -> NDArray[np.float64]:
        """Return the samples that wait (V), ``(channels, n)``."""
        if self._task is None:
            return np.zeros((len(self.names), 0))
        with translated("inputs"):
            count = int(self._task.in_stream.avail_samp_per_chan)
            volts = np.zeros((len(self.names), count))
            if count:
                self._reader.read_many_sample(volts, count, timeout=1.0)
        return volts

    def stop(self) -> None:
        """Stop and let go; never raises."""
        task, self._task, self._reader = self._task, None, None
        if task is not None:
            with suppress(Exception):
                task.stop()
            with suppress(Exception):
                task.close()
