"""From a description of a bench to opened devices, guarded and ready for takes."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterator
from typing import Any, Self, final

from bondgraph.support.errors import UnusableInput, unknown_name
from hardware.contracts import Acquisition, Clock, Transport, WallClock
from hardware.devices.daq import AnalogueReadout, Card, CardInputs
from hardware.devices.gauge import ForceGauge
from hardware.devices.interferometer import NORMAL_RATE, Block, Interferometer, Streaming, Triggered
from hardware.devices.transport import SerialSettings, SerialTransport, TcpTransport
from hardware.envelope import GuardedOutput, GuardedWave, OutputState, parked
from hardware.errors import LinkLost, ProtocolFault
from hardware.recorder.plan import TakePlan
from hardware.recorder.station import Preparation, Station, no_preparation
from hardware.regulation.plan import LoopPlan
from hardware.regulation.station import LoopStation
from hardware.station.outputs import open_output
from hardware.station.settings import (
    ClockSettings,
    GaugeSettings,
    InterferometerSettings,
    ReadoutSettings,
    StationSettings,
)

MEMORY = 32_768
"""Samples of a block."""
FINER = 4
"""Samples of the sensor to one of the output where both have clocks of their own."""


@final
class OpenStation:
    """Opened devices; close it, best by ``with``.

    Parameters
    ----------
    settings : StationSettings
        What it is made of.

    Raises
    ------
    HardwareError
        A device is not there; those opened before are closed again.

    Examples
    --------
    >>> with virtual_bench() as station:
    ...     print(station.settings.name)
    virtual bench
    """

    def __init__(self, settings: StationSettings) -> None:
        self.settings = settings
        self._closing = contextlib.ExitStack()
        with contextlib.ExitStack() as opened:
            self.clock = _clock(settings.clock, opened)
            self._driven = open_output(
                settings.output, settings.amplifier, settings.ultrasonic, self.clock, opened
            )
            self.output = GuardedOutput(self._driven.raw, settings.envelope, self.clock)
            opened.callback(self.output.close)
            self.interferometer = _interferometer(settings.interferometer, self.clock, opened)
            self._readout = _readout(settings.readout, self._driven.card, self.clock)
            self._gauge = _gauge(settings.gauge, self.clock, opened)
            self._closing = opened.pop_all()

    def station(self, plan: TakePlan) -> Station:
        """Return the bench as one take needs it.

        Raises
        ------
        UnusableInput
            The wiring does not allow the way to synchronise, or the record does not fit.
        """
        wired = self.settings.output
        line = wired.clock if plan.synchronisation == "clock" else wired.trigger
        if plan.synchronisation != "none" and line is None and wired.kind.startswith("mf"):
            needed = "clock" if plan.synchronisation == "clock" else "trigger"
            raise UnusableInput(
                f"{self.settings.name}: synchronisation {plan.synchronisation!r} needs [output] "
                f"{needed} = the digital line to the interferometer; wire it, or choose 'none'"
            )
        optics = self.settings.interferometer
        wave = GuardedWave(self.output, self._driven.wave(plan.synchronisation))
        sensors, preparation, remarks = _sensors(
            self.interferometer, self.settings.interferometer, plan
        )
        if self._gauge is not None:
            sensors = (*sensors, self._gauge)
        return Station(
            self.clock, self.output, wave, sensors, preparation, parked(self.output),
            self._driven.gains, self.settings.amplifier.lag, self.settings.amplifier.lag_error,
            self.settings.noise, remarks, optics.ellipse if optics else None,
        )  # fmt: skip

    def loop(self, plan: LoopPlan) -> LoopStation:
        """Return the bench as one feedback loop needs it.

        Raises
        ------
        UnusableInput
            No sensor gives this reading, or its clock is one that the device cannot take.
        """
        sensor, preparation = self._fed_back(plan)
        period = self.settings.envelope.update_period
        by_sensor = sensor.rate < 1.0 / period
        return LoopStation(
            self.clock, self.output, sensor, sensor.rate if by_sensor else 1.0 / period,
            f"the {sensor.stream}" if by_sensor else "the envelope (update_period)",
            preparation, parked(self.output), self._driven.gains, self.settings.noise,
        )  # fmt: skip

    def _fed_back(self, plan: LoopPlan) -> tuple[Acquisition, Preparation]:
        """Return the sensor of a reading, and what prepares it."""
        optics = self.settings.interferometer
        if self.interferometer is not None and optics is not None and plan.reading == "x":
            rate = optics.rate or NORMAL_RATE
            if rate > NORMAL_RATE:
                raise UnusableInput(
                    f"{self.settings.name}: [interferometer] rate = {rate:g} Hz, but the device "
                    f"streams at {NORMAL_RATE:g} Hz at most, and a loop cannot wait for a block"
                )
            return Streaming(self.interferometer, rate, patience=plan.patience), self.interferometer
        others: dict[str, Acquisition] = {}
        if self._readout is not None and self.settings.readout is not None:
            others[self.settings.readout.channel] = self._readout
        if self._gauge is not None:
            others["F"] = self._gauge
        if plan.reading in others:
            return others[plan.reading], no_preparation()
        known = [*(("x",) if self.interferometer is not None else ()), *others]
        raise unknown_name("reading", plan.reading, self.settings.name, known)

    def close(self) -> None:
        """Park, then release everything; any number of times.

        Signals are held back until the output is parked; whatever interrupts even that leaves the
        link open, so that another `close` ends it.
        """
        try:
            with parked(self.output):
                pass
        except BaseException as error:
            # parked before a signal acted, or nothing more can be done over this link
            if self.output.state is OutputState.PARKED or isinstance(error, Exception):
                with contextlib.suppress(Exception):
                    self._closing.close()
            raise
        self._closing.close()

    def __enter__(self) -> Self:
        """Return itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close."""
        self.close()


def open_station(settings: StationSettings) -> OpenStation:
    """Open all devices of a bench; see `OpenStation`.

    Examples
    --------
    >>> with virtual_bench() as station:  # on a real one open_station(read_settings(path))
    ...     print(station.settings.output.kind)
    mf634
    """
    return OpenStation(settings)


def _clock(settings: ClockSettings, opened: contextlib.ExitStack) -> Clock:
    if not settings.bench:
        return WallClock()
    from hardware.simulators.control import BenchClock

    try:
        clock = BenchClock(settings.bench, ppm=settings.ppm)
    except OSError as error:
        raise LinkLost(f"{error}; start one with bondsight bench serve") from None
    opened.callback(clock.close)
    return _VirtualTime(clock)


@final
class _VirtualTime:
    """The clock of a virtual bench, with errors of the bench as those of a device."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock

    def now(self) -> float:
        """Present time (s)."""
        with _as_hardware():
            return self._clock.now()

    def sleep(self, seconds: float) -> None:
        """Let time pass (s)."""
        with _as_hardware():
            self._clock.sleep(seconds)


@contextlib.contextmanager
def _as_hardware() -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise LinkLost(f"{error}; its time stands still, and with it every device") from None
    except ValueError as error:
        raise ProtocolFault(f"the clock of the virtual bench: {error}") from None


def _interferometer(
    settings: InterferometerSettings | None, clock: Clock, opened: contextlib.ExitStack
) -> Interferometer | None:
    if settings is None:
        return None
    device = Interferometer(
        settings.connection, library=settings.library or None, clock=clock,
        dead_path=settings.dead_path, channel=settings.channel,
    )  # fmt: skip
    opened.callback(device.close)
    return device


def _readout(
    settings: ReadoutSettings | None, card: Card | None, clock: Clock
) -> AnalogueReadout | None:
    if settings is None or card is None:
        return None
    s = settings
    return AnalogueReadout(
        CardInputs(card, (s.input,)), card.identity, clock, channel=s.channel, unit=s.unit,
        scale=s.scale, offset=s.offset, rate=s.rate,
    )  # fmt: skip


def _gauge(
    settings: GaugeSettings | None, clock: Clock, opened: contextlib.ExitStack
) -> ForceGauge | None:
    if settings is None:
        return None
    host, _, port = settings.connection.rpartition(":")
    line: Transport = (
        TcpTransport(host, int(port))
        if host and port.isdigit()
        else SerialTransport(settings.connection, SerialSettings(settings.baud))
    )
    gauge = ForceGauge(line, clock, settings.rate)
    opened.callback(gauge.close)
    return gauge


def _sensors(
    device: Interferometer | None, settings: InterferometerSettings | None, plan: TakePlan
) -> tuple[tuple[Acquisition, ...], Preparation, tuple[str, ...]]:
    """Return what records, what prepares it, and what is done otherwise than was asked for."""
    if device is None or settings is None:
        return (), no_preparation(), ()
    options: dict[str, Any] = {"patience": plan.patience}
    if settings.quadrature:
        options["extras"] = ("sin", "cos")
    if plan.synchronisation == "clock":
        # shows an edge of the sample clock that was too many or was missed
        options["extras"] = (*options.get("extras", ()), "clock")
        return (_clocked(device, settings, plan, options),), device, ()
    start = plan.synchronisation == "start"
    asked = settings.rate
    block = _own_block(plan, asked) if start else None
    if block is not None:
        made: Acquisition = Block(device, *block, start=True, **options)
        return (made,), device, ()
    rate = min(asked or NORMAL_RATE, NORMAL_RATE)
    # what begins by itself has no end either: the take ends it
    count = math.ceil((plan.seconds + 4.0 / plan.rate) * rate) if start else None
    made = Streaming(device, rate, count, start=start, **options)
    if asked is None or (asked == rate and not start):
        return (made,), device, ()
    remark = (
        f"{made.stream}: {plan.seconds:.4g} s at {asked:g} Hz were asked for, which is no block of "
        f"{MEMORY} samples that a trigger starts; it streams at {rate:g} Hz"
    )
    return (made,), device, (remark,)


def _clocked(
    device: Interferometer,
    settings: InterferometerSettings,
    plan: TakePlan,
    options: dict[str, Any],
) -> Acquisition:
    """Return what takes a sample at every edge, in a mode in which the device can."""
    n, block = plan.volts.size, settings.clocked == "block"
    if block and n <= MEMORY:
        # the device needs a whole rate as what is expected; the edges decide
        return Block(device, n, float(round(plan.rate)), start=False, external=True, **options)
    if plan.rate <= NORMAL_RATE:
        return Triggered(device, plan.rate, n, **options)
    if block:
        raise UnusableInput(
            f"{plan.name}: {n} samples clocked at {plan.rate:g} Hz fit neither a block of "
            f"{MEMORY} nor a stream of {NORMAL_RATE:g} Hz; ask for less of one of them"
        )
    raise UnusableInput(
        f"{plan.name}: {n} samples clocked at {plan.rate:g} Hz, but the station says that edges "
        f"clock only the fast mode, up to {NORMAL_RATE:g} Hz; lower the rate, synchronise by "
        "'start', or say [interferometer] clocked = \"block\" if the device can"
    )


def _own_block(plan: TakePlan, asked: float | None) -> tuple[int, float] | None:
    """Return samples and rate of a block on the sensor's own clock; None if it holds too little.

    The rate is the finest whole one that is useful. The block lasts four periods of the output
    longer than the wave, as far as they fit without a rate below the output's.
    """
    longer = plan.seconds + 4.0 / plan.rate
    rate = asked
    if rate is None:
        within, exact = (int(MEMORY / s * (1.0 + 1e-12)) for s in (longer, plan.seconds))
        finest = within if within >= plan.rate else exact
        rate = float(max(1, min(finest, round(FINER * plan.rate), 1_000_000)))
    if plan.seconds * rate > MEMORY * (1.0 + 1e-12):
        return None
    return min(math.ceil(longer * rate), MEMORY), rate
