"""QCoDeS: a guarded voltage and a displacement as its instruments. Imports QCoDeS."""

from __future__ import annotations

from typing import Any, final

from hardware.contracts import Identity
from hardware.ecosystem.bluesky_displacement import DisplacementSource
from hardware.envelope import GuardedOutput
from hardware.errors import DriverMissing

try:
    from qcodes.instrument import Instrument
    from qcodes.validators import Numbers
except ImportError as missing:
    raise DriverMissing("QCoDeS is not installed; pip install qcodes") from missing

__all__ = ["DisplacementInstrument", "VoltageInstrument"]


@final
class VoltageInstrument(Instrument):
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
            get_cmd=self._present,
            set_cmd=lambda volts: output.ramp(volts, rate),
            vals=Numbers(envelope.v_min, envelope.v_max),
        )
        self.add_parameter(
            "measured_voltage", unit="V", label="Measured voltage", get_cmd=self._measured
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

    def _present(self) -> float:
        present = self._output.present
        return float("nan") if present is None else present

    def _measured(self) -> float:
        volts = self._output.read()
        return float("nan") if volts is None else volts


@final
class DisplacementInstrument(Instrument):
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


def _idn(identity: Identity) -> dict[str, str | None]:
    return {
        "vendor": identity.maker or None,
        "model": identity.model or None,
        "serial": identity.serial or None,
        "firmware": identity.firmware or None,
    }
