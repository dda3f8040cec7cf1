"""Controllers of a loop by name, or described in a file; and the virtual benches they suit."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from bondgraph.support.bounds import NonNegative, Positive
from bondgraph.support.errors import UnusableInput, unknown_name


@dataclass(frozen=True, slots=True)
class InverseDescription:
    """PI behind the inverse of an operator (V to the reading), or of a plain gain.

    Parameters
    ----------
    rate : float
        Ticks a second (Hz).
    reading : str
        Channel that is fed back.
    proportional, integral : float
        Command per error, 1/s; an integral that is not given is three tenths of the rate, which
        leaves a gain margin of 6 around an actuator that follows within a tick.
    feedforward : bool
        Whether the reference goes through the inverse too.
    operator : mapping or str, optional
        As in files of operators, or the name of such a file (JSON).
    gain : float, optional
        Reading per volt, where no operator is given.
    """

    rate: Positive = 1000.0
    reading: str = "x"
    proportional: NonNegative = 0.0
    integral: NonNegative | None = None
    feedforward: bool = True
    operator: Any = None
    gain: Positive | None = None

    def made(self, rate: float) -> Any:
        """Return the controller at this rate (Hz)."""
        from bondgraph.hysteresis import PrandtlIshlinskii, operator_from_dict
        from bondgraph.hysteresis.invertible import InvertibleOperator
        from bondgraph.support.json_text import plain_data
        from hardware.regulation import InverseLoop

        if (self.operator is None) == (self.gain is None):
            raise UnusableInput("controller: give either an operator or a gain (reading per volt)")
        content = self.operator
        if isinstance(content, str):
            content, _ = plain_data(Path(content))
        model: Any = content
        if content is None:
            model = PrandtlIshlinskii((0.0,), (float(self.gain or 0.0),))
        elif isinstance(content, Mapping):
            model = operator_from_dict(content)
        if not isinstance(model, InvertibleOperator):
            raise UnusableInput(
                f"controller: the operator {getattr(model, 'kind', content)!r} has no inverse; "
                "give one that has, or a gain"
            )
        integral = 0.3 * rate if self.integral is None else self.integral
        return InverseLoop(model, self.proportional, integral, rate, feedforward=self.feedforward)


@dataclass(frozen=True, slots=True)
class StageDescription:
    """PID on the position of the ultrasonic stage, force through the inverse characteristic.

    Parameters
    ----------
    rate : float
        Ticks a second (Hz).
    reading : str
    crossover : float, optional
        Of the loop if it were not sampled (Hz), with a derivative that cancels the stage's pole;
        else the numbers below.
    gain, integral, derivative, breakaway : float
        N/m, s, s, N; see `PositionController`.
    tolerance : float
        Error within which the drive is off (m).
    """

    rate: Positive = 1000.0
    reading: str = "x"
    crossover: Positive | None = None
    gain: Positive | None = None
    integral: Positive = math.inf
    derivative: NonNegative = 0.0
    breakaway: NonNegative = 0.0
    tolerance: NonNegative = 0.0

    def made(self, rate: float) -> Any:
        """Return the controller at this rate (Hz)."""
        from actuators import ultrasonic as us

        if (self.crossover is None) == (self.gain is None):
            raise UnusableInput("controller: give either a crossover (Hz) or a gain (N/m)")
        if self.crossover is not None:
            lead = us.designed(self.crossover).time_constant
            found = us.designed(self.crossover, derivative=lead).controller
            controller = replace(found, breakaway=self.breakaway)
        else:
            controller = us.PositionController(
                self.gain or 0.0, self.integral, self.derivative, self.breakaway
            )
        return us.StageLoop(controller, us.Sampling(rate, tolerance=self.tolerance))


@dataclass(frozen=True, slots=True)
class OpenDescription:
    """No feedback: the target is a voltage."""

    rate: Positive = 1000.0
    reading: str = "x"

    def made(self, rate: float) -> Any:
        """Return the controller."""
        from hardware.regulation import OpenLoop

        return OpenLoop()


@dataclass(frozen=True, slots=True)
class LockDescription:
    """A phase-locked loop of the resonance: tuning voltage from a phase detector's reading.

    The reading rises where the drive is too fast: the sine of the phase by which the current lags.

    Parameters
    ----------
    rate : float
        Ticks a second (Hz).
    reading : str
    bandwidth : float
        Of the locked loop (Hz), far below the half width of the resonance.
    tuning : float
        Of the oscillator, Hz per volt.
    half_width : float
        Of the resonance (Hz).
    """

    rate: Positive = 200.0
    reading: str = "lag"
    bandwidth: Positive = 5.0
    tuning: Positive = 1000.0
    half_width: Positive = 1075.0

    def made(self, rate: float) -> Any:
        """Return the controller at this rate (Hz)."""
        step = 2.0 * math.pi * self.bandwidth / rate
        if step > 0.5:
            raise UnusableInput(
                f"controller: a lock of {self.bandwidth:g} Hz needs at least "
                f"{4.0 * math.pi * self.bandwidth:.3g} ticks a second, not {rate:g}"
            )
        # near the resonance sin(lag) is the detuning by the half width
        return InverseDescription(
            integral=2.0 * math.pi * self.bandwidth, feedforward=False,
            gain=self.tuning / self.half_width,
        ).made(rate)  # fmt: skip


Description = InverseDescription | StageDescription | OpenDescription | LockDescription
KINDS: Mapping[str, type[Description]] = {
    "inverse": InverseDescription,
    "stage": StageDescription,
    "lock": LockDescription,
    "open": OpenDescription,
}


def _stack() -> Description:
    from bondgraph.hysteresis import Ang

    return InverseDescription(operator=Ang.stack_2hz())


STACK: Mapping[str, Any] = {
    "plant": {
        "effect": "none", "play_radii": [4.0, 12.0, 24.0, 36.0],
        "play_gains": [0.12, 0.06, 0.05, 0.04], "creep_ratios": [0.01, 0.01],
        "creep_times": [0.05, 0.8],
    },
}  # fmt: skip
"""With a loop and a creep that are those of no controller here."""
M661: Mapping[str, Any] = {"plant": {"name": "m661", "seed": 0}, "driver": "ultrasonic"}
PLATE: Mapping[str, Any] = {
    "plant": {"name": "plate"}, "driver": "oscillator", "fronts": ["card"], "readout": 5.0,
}  # fmt: skip
GAUGE: Mapping[str, Any] = {
    "plant": {"name": "m661-gauge", "seed": 0}, "driver": "ultrasonic", "fronts": ["card", "gauge"],
}  # fmt: skip
NAMED: Mapping[str, tuple[Callable[[], Description], Mapping[str, Any]]] = {
    "stack": (_stack, STACK),
    "stack-linear": (lambda: InverseDescription(gain=50e-9), STACK),
    "stack-open": (OpenDescription, STACK),
    "m661": (lambda: StageDescription(crossover=20.0), M661),
    "lock": (LockDescription, PLATE),
    "force": (lambda: OpenDescription(100.0, "F"), GAUGE),
}
"""Controllers by name, and the virtual bench that each of them is shown on."""


def controller_of(text: str) -> tuple[Description, Mapping[str, Any]]:
    """Return what a name or a file describes, and its virtual bench.

    Raises
    ------
    UnusableInput
        One line: no such name, no file, a key unknown or of another type.
    """
    from bondgraph.support.typed_reader import chosen, make, record
    from hardware.station.settings import toml_of

    if text in NAMED:
        description, bench = NAMED[text]
        return description(), bench
    file = Path(text)
    if not (file.suffix or file.exists()):
        raise unknown_name("controller", text, "the loop", (*NAMED, "or a TOML file"))
    content = toml_of(file, "a file that describes a controller")
    kind = content.pop("kind", None)
    cls = chosen(KINDS, kind, f"{file.name}: kind", "controller")
    # the branches differ in their fields, which the reader takes from the class
    made: Any = make(lambda: record(cls, content, "", what="a controller"), file.name)
    benches = {"stage": M661, "lock": PLATE}
    return made, benches.get(str(kind), GAUGE if made.reading == "F" else STACK)
