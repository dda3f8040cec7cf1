"""QCoDeS: a guarded voltage, a displacement and blocks as its instruments. Imports QCoDeS."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from bondgraph.support.errors import UnusableInput
from hardware.contracts import Acquisition, Clock, Identity, WallClock
from hardware.ecosystem.block import BlockPlan, PartialTake, block_arrays, take_block
from hardware.ecosystem.bluesky_displacement import DisplacementSource
from hardware.ecosystem.documents import or_nan
from hardware.envelope import GuardedOutput
from hardware.errors import DriverMissing

try:
    from qcodes.instrument import Instrument
    from qcodes.parameters import ParameterWithSetpoints
    from qcodes.validators import Arrays, Ints, Numbers
except ImportError as missing:
    raise DriverMissing("QCoDeS is not installed; pip install qcodes") from missing


@final
class QCoDeSVoltage(Instrument):
    """A guarded voltage; parked on `close`.

    Parameters ``voltage`` (V; setting it ramps), ``measured_voltage`` (V), ``state``.

    Parameters
    ----------
    name : str
        Of the instrument.
    output : GuardedOutput
        The only way to the actuator.
    rate : float, optional
        Of the ramps (V/s); by default the envelope's gentle one.
    """

    def __init__(
        self, name: str, output: GuardedOutput, rate: float | None = None, **options: Any
    ) -> None:
        super().__init__(name, **options)
        self._output = output
        envelope = output.envelope
        self.metadata["envelope"] = envelope.as_dict()
        self.add_parameter(
            "voltage",
            unit="V",
            label="Voltage",
            get_cmd=lambda: or_nan(output.present),
            set_cmd=lambda volts: output.ramp(volts, rate),
            vals=Numbers(envelope.v_min, envelope.v_max),
        )
        self.add_parameter(
            "measured_voltage",
            unit="V",
            label="Measured voltage",
            get_cmd=lambda: or_nan(output.read()),
        )
        self.add_parameter("state", label="State", get_cmd=lambda: output.state.value)

    def power_up(self) -> None:
        """Bring the device to its safe value; needed once."""
        self._output.power_up()

    def park(self) -> None:
        """Ramp to the safe value."""
        self._output.stop()

    def get_idn(self) -> dict[str, str | None]:
        """Return who it is."""
        return _idn(self._output.identity)

    def close(self) -> None:
        """Park and let go."""
        try:
            self._output.close()
        finally:
            super().close()


@final
class QCoDeSDisplacement(Instrument):
    """A displacement sensor: parameters ``displacement`` (m, taken now) and ``flags`` of it.

    Parameters
    ----------
    name : str
        Of the instrument.
    source : DisplacementSource
        The interferometer.
    """

    def __init__(self, name: str, source: DisplacementSource, **options: Any) -> None:
        super().__init__(name, **options)
        self._source = source
        self._flags = 0
        self.add_parameter(
            "displacement", unit="m", label="Displacement", get_cmd=self._take, set_cmd=False
        )
        # taken with the displacement, so a snapshot must not ask for it first
        self.add_parameter("flags", label="Flags", get_cmd=lambda: self._flags, set_cmd=False)

    def zero(self) -> None:
        """Set to zero here."""
        self._source.zero()

    def get_idn(self) -> dict[str, str | None]:
        """Return who it is."""
        return _idn(self._source.identity)

    def _take(self) -> float:
        reading = self._source.read()
        self._flags = int(reading.flags)
        return reading.value


@final
class BlockInstrument(Instrument):
    """Blocks of samples, as arrays over ``time`` (s, from the start of the block).

    Parameters ``samples``, ``rate`` (Hz), ``time``, one for every channel and ``flags``. Reading a
    channel returns the last block; `take` makes a new one.

    Parameters
    ----------
    name : str
        Of the instrument.
    make, units, plan, clock, patience
        As of `BlueskyBlock`.
    """

    def __init__(
        self,
        name: str,
        make: Callable[[int, float], Acquisition],
        units: Mapping[str, str],
        *,
        plan: BlockPlan | None = None,
        clock: Clock | None = None,
        patience: float = 5.0,
        **options: Any,
    ) -> None:
        super().__init__(name, **options)
        first = plan or BlockPlan()
        self._make, self._units, self._patience = make, dict(units), patience
        self._clock: Clock = WallClock() if clock is None else clock
        self._arrays: dict[str, NDArray[Any]] = {}
        self.add_parameter(
            "samples", initial_value=first.samples, set_cmd=None, get_cmd=None, vals=Ints(1)
        )
        self.add_parameter(
            "rate", unit="Hz", initial_value=first.rate, set_cmd=None, get_cmd=None,
            vals=Numbers(1e-3),
        )  # fmt: skip
        shape = Arrays(shape=(self.parameters["samples"].get_latest,))
        self.add_parameter("time", unit="s", get_cmd=self._time, set_cmd=False, vals=shape)
        for channel, unit in {**units, "flags": ""}.items():
            self.add_parameter(
                channel,
                unit=unit,
                parameter_class=ParameterWithSetpoints,
                setpoints=(self.parameters["time"],),
                get_cmd=lambda channel=channel: self._last(channel),
                set_cmd=False,
                vals=shape,
                snapshot_value=False,
            )

    def take(self) -> None:
        """Take a block.

        Raises
        ------
        HardwareError
            Of the device; what had arrived can be read, the rest is NaN and flagged.
        """
        plan = BlockPlan(int(self.parameters["samples"]()), float(self.parameters["rate"]()))
        acquisition, taken = self._make(plan.samples, plan.rate), PartialTake()
        acquisition.kickoff()
        try:
            take_block(
                acquisition, None, plan, self._clock, taken, threading.Event(), self._patience
            )
        finally:
            self._arrays = dict(block_arrays(taken.block, plan.samples, self._units))

    def _time(self) -> NDArray[np.float64]:
        return np.arange(self.parameters["samples"]()) / float(self.parameters["rate"]())

    def _last(self, channel: str) -> NDArray[Any]:
        samples = int(self.parameters["samples"]())
        if not self._arrays or self._arrays["flags"].size != samples:
            raise UnusableInput(f"{self.name}: no block of {samples} samples yet; call take()")
        return self._arrays[channel]


def _idn(identity: Identity) -> dict[str, str | None]:
    return {
        "vendor": identity.maker or None,
        "model": identity.model or None,
        "serial": identity.serial or None,
        "firmware": identity.firmware or None,
    }
