"""What an actuator and its amplifier stand."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from typing import Any, final

from bondgraph.signals.drive_limits import DriveLimits
from bondgraph.signals.quantity import engineering
from bondgraph.support.errors import UnusableInput, real_number
from hardware.envelope.capacitance import Capacitance

ROUNDING = 1e-9
"""Share of the range by which a command may miss a limit: what arithmetic leaves of 0 V."""
PLAUSIBLE = 0.05
"""Share of the range by which a reading may be off: noise and offset of a monitor."""


@final
@dataclass(frozen=True, slots=True)
class Dwell:
    """Longest uninterrupted time beyond a voltage.

    Parameters
    ----------
    level : float
        V; beyond means above a level that lies above the safe value, and below one under it.
    seconds : float
        Longest time there (s).
    """

    level: float
    seconds: float

    def __post_init__(self) -> None:
        """Check the numbers."""
        real_number("dwell: level", self.level)
        if not real_number("dwell: seconds", self.seconds) > 0.0:
            raise UnusableInput(f"dwell: {self.seconds} s beyond {self.level} V; give more than 0")


@final
@dataclass(frozen=True, slots=True)
class Converter:
    """What the device in front of the actuator can produce, in voltages of the actuator.

    Parameters
    ----------
    v_min, v_max : float
        Its own range (V), after the amplifier.
    resolution : float
        Smallest step (V); 0 if unknown.
    rate_max : float, optional
        Highest rate of a waveform (Hz).
    """

    v_min: float
    v_max: float
    resolution: float = 0.0
    rate_max: float | None = None

    def __post_init__(self) -> None:
        """Check the numbers."""
        low = real_number("converter: v_min", self.v_min)
        high = real_number("converter: v_max", self.v_max)
        if not low < high:
            raise UnusableInput(f"converter: {low} .. {high} V leaves no room; swap the ends?")
        if not 0.0 <= real_number("converter: resolution", self.resolution) < high - low:
            raise UnusableInput(f"converter: a step of {self.resolution} V does not fit its range")
        if self.rate_max is not None and not real_number("converter: rate", self.rate_max) > 0.0:
            raise UnusableInput("converter: the highest rate must be positive (Hz)")


@final
@dataclass(frozen=True, slots=True)
class Envelope:
    """All limits between a command and an actuator.

    A converter holds its value between updates, so each change is a jump. A jump is judged as if
    it took one `update_period`, or one sample of a waveform if that is shorter: its slew is
    ``|dV| / dt`` and its current ``C |dV| / dt`` with the largest capacitance on the way. Thus a
    waveform that is played slowly but coarsely is refused like a single large step.

    Not covered: current and overvoltage by a resonance of the actuator, the average heat of a long
    run, and images of the waveform above half the sampling rate.

    Parameters
    ----------
    v_min, v_max : float
        At the actuator (V).
    slew : float
        Fastest change (V/s).
    i_max : float, optional
        Largest current of amplifier and actuator (A); needs `capacitance`.
    capacitance : float or Capacitance, optional
        F, large-signal.
    f_max : float, optional
        Content of a waveform above this frequency (Hz) ...
    f_share : float
        ... may nowhere be higher than this share of ``v_max - v_min``.
    dwell : sequence of Dwell
        Longest times beyond levels (creep, depolarisation, heat).
    safe : float
        Where the output is parked (V).
    gentle : float, optional
        Rate of ramps (V/s); else the range in a second, or slower if slew or current ask for it.
    update_period : float
        Shortest time between two single commands (s).
    name : str
        Of the actuator, for messages.

    Raises
    ------
    UnusableInput
        If limits are missing, not finite or contradict each other.

    Examples
    --------
    >>> print(Envelope(0.0, 100.0, 1e5, i_max=0.2, capacitance=1.5e-6).describe())
    0 .. 100 V, 100 kV/s, 200 mA into 1.5 uF, safe at 0 V, ramps of 100 V/s, updates >= 1 ms
    """

    v_min: float
    v_max: float
    slew: float
    i_max: float | None = None
    capacitance: float | Capacitance | None = None
    f_max: float | None = None
    f_share: float = 0.01
    dwell: Sequence[Dwell] = ()
    safe: float = 0.0
    gentle: float | None = None
    update_period: float = 1e-3
    name: str = ""
    curve: Capacitance | None = field(init=False, repr=False, compare=False)
    """The capacitance as a curve."""
    ramp_rate: float = field(init=False, repr=False, compare=False)
    """Rate of ramps (V/s)."""
    slack: float = field(init=False, repr=False, compare=False)
    """What passes as rounding (V)."""

    def __post_init__(self) -> None:
        """Check the limits one by one and against each other."""
        place = f"envelope {self.name}".rstrip()
        for key in ("v_min", "v_max", "slew", "f_share", "safe", "update_period"):
            object.__setattr__(self, key, real_number(f"{place}: {key}", getattr(self, key)))
        for key in ("i_max", "f_max", "gentle"):
            if getattr(self, key) is not None:
                object.__setattr__(self, key, real_number(f"{place}: {key}", getattr(self, key)))
                _require(getattr(self, key) > 0.0, f"{place}: {key} must be positive")
        _require(
            self.v_min < self.v_max,
            f"{place}: {self.v_min:g} .. {self.v_max:g} V leaves no room; swap v_min and v_max?",
        )
        _require(
            self.v_min <= self.safe <= self.v_max,
            f"{place}: the safe value {self.safe:g} V lies outside {self.v_min:g} .. "
            f"{self.v_max:g} V; widen the limits or choose another",
        )
        _require(self.slew > 0.0, f"{place}: slew must be positive (V/s)")
        _require(self.update_period > 0.0, f"{place}: update_period must be positive (s)")
        _require(0.0 < self.f_share < 1.0, f"{place}: f_share must lie between 0 and 1")
        object.__setattr__(self, "slack", ROUNDING * (self.v_max - self.v_min))
        object.__setattr__(self, "curve", self._curve(place))
        object.__setattr__(self, "dwell", self._dwells(place))
        object.__setattr__(self, "ramp_rate", self._ramp_rate(place))

    def _curve(self, place: str) -> Capacitance | None:
        given = self.capacitance
        _require(
            (given is None) == (self.i_max is None),
            f"{place}: i_max and capacitance need each other; give both or neither",
        )
        if given is None or isinstance(given, Capacitance):
            covered = given is None or len(given.volts) == 1
            _require(
                covered or (given.volts[0] <= self.v_min and given.volts[-1] >= self.v_max),  # type: ignore[union-attr]
                f"{place}: the capacitance is not known over all of {self.v_min:g} .. "
                f"{self.v_max:g} V; add points at the ends",
            )
            return given
        return Capacitance.constant(real_number(f"{place}: capacitance", given))

    def _dwells(self, place: str) -> tuple[Dwell, ...]:
        dwells = tuple(self.dwell)
        for d in dwells:
            _require(isinstance(d, Dwell), f"{place}: dwell takes Dwell(level, seconds), not {d!r}")
            _require(
                self.v_min < d.level < self.v_max and d.level != self.safe,
                f"{place}: no dwell can be counted from {d.level:g} V; the level must lie inside "
                f"{self.v_min:g} .. {self.v_max:g} V and away from the safe {self.safe:g} V",
            )
        return dwells

    def _ramp_rate(self, place: str) -> float:
        fastest = self.fastest(self.v_min, self.v_max)
        if self.gentle is None:
            return min((self.v_max - self.v_min) / 1.0, fastest)
        _require(
            self.gentle <= fastest * (1.0 + ROUNDING),
            f"{place}: ramps of {engineering(self.gentle, 'V/s')} are faster than slew and current "
            f"allow ({engineering(fastest, 'V/s')}); lower gentle",
        )
        return self.gentle

    @property
    def limits(self) -> DriveLimits:
        """Range, slew and current alone, with the largest capacitance."""
        if self.curve is None or self.i_max is None:
            return DriveLimits(self.v_min, self.v_max, self.slew)
        return DriveLimits(self.v_min, self.v_max, self.slew, self.i_max, self.curve.largest)

    def fastest(self, before: float, after: float) -> float:
        """Return the fastest change (V/s) that slew and current allow between two voltages (V)."""
        if self.curve is None or self.i_max is None:
            return self.slew
        return min(self.slew, self.i_max / self.curve.worst(before, after))

    def largest_step(self, before: float, after: float) -> float:
        """Return the largest jump (V) of a single command between two voltages (V)."""
        return self.fastest(before, after) * self.update_period

    def ramp_step(self, before: float, after: float) -> float:
        """Return the largest step (V) of a ramp between two voltages (V).

        Half of what a single command may do: room for a read-back that is a little off.
        """
        return 0.5 * self.largest_step(before, after)

    def ramp_time(self, before: float, after: float) -> float:
        """Return how long a gentle ramp takes (s)."""
        return abs(after - before) / self.ramp_rate

    def is_beyond(self, dwell: Dwell, volts: float) -> bool:
        """Whether a voltage counts against a dwell."""
        return volts > dwell.level if dwell.level > self.safe else volts < dwell.level

    def describe(self) -> str:
        """Return all limits in one line."""
        parts = [f"{self.v_min:g} .. {self.v_max:g} V", engineering(self.slew, "V/s")]
        if self.curve is not None and self.i_max is not None:
            parts.append(f"{engineering(self.i_max, 'A')} into {self.curve.describe()}")
        if self.f_max is not None:
            parts.append(
                f"above {engineering(self.f_max, 'Hz')} at most "
                f"{engineering(self.f_share * (self.v_max - self.v_min), 'V')}"
            )
        for d in self.dwell:
            side = "above" if d.level > self.safe else "below"
            parts.append(f"{engineering(d.seconds, 's')} {side} {d.level:g} V")
        parts += [
            f"safe at {self.safe:g} V",
            f"ramps of {engineering(self.ramp_rate, 'V/s')}",
            f"updates >= {engineering(self.update_period, 's')}",
        ]
        return (f"{self.name}: " if self.name else "") + ", ".join(parts)

    def as_dict(self) -> dict[str, Any]:
        """Return all limits as plain numbers, for a record's provenance."""
        plain: dict[str, Any] = {
            k: getattr(self, k)
            for k in ("name", "v_min", "v_max", "slew", "i_max", "f_max", "f_share", "safe")
        }
        plain |= {"gentle": self.ramp_rate, "update_period": self.update_period}
        plain["dwell"] = [asdict(d) for d in self.dwell]
        curve = self.curve
        plain["capacitance"] = (
            None if curve is None else {"volts": list(curve.volts), "farads": list(curve.farads)}
        )
        return plain


def _require(condition: bool, message: str) -> None:
    if not condition:
        raise UnusableInput(message)
