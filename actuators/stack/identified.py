"""A stack as its recordings told it: constants and operator, plain JSON in and out."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from actuators.stack.conversions import Lumped, lumped_law
from actuators.stack.loading_curve import Interval
from actuators.stack.lumped import stack_lumped
from bondgraph.graph.bond_graph import BondGraph
from bondgraph.hysteresis import (
    AlJanaideh,
    Ang,
    Cascade,
    KelvinVoigtCreep,
    MaxwellResistiveCapacitor,
    Operator,
)
from bondgraph.hysteresis.catalogue import read_operator
from bondgraph.hysteresis.fitting.numbered import FittedNumber
from bondgraph.hysteresis.invertible import InvertibleOperator
from bondgraph.laws import Hysteretic
from bondgraph.signals.drive_limits import DriveLimits, VoltageLimit
from bondgraph.support.bounds import Positive
from bondgraph.support.errors import UnusableInput
from bondgraph.support.json_text import plain_data
from bondgraph.support.ops import FloatArray
from bondgraph.support.typed_reader import Rules, make, record, require_object
from bondgraph.support.whole_file import write_atomically

FORMAT = "bondsight identified stack 1"
_RULES = Rules({Operator: read_operator})


@dataclass(frozen=True, slots=True)
class IdentifiedStack:
    """What an identification found, SI.

    Attributes
    ----------
    name : str
    sources : tuple of str
        Names of the recordings.
    transducer, stiffness : Interval
        T (N/V) and k (N/m), short circuit.
    operator : AlJanaideh or Ang
        V to m; from virgin rest at 0 V.
    numbers : tuple of FittedNumber
        Of the operator, with intervals where the recordings determine them.
    low, high : float
        Voltages that were recorded, V.
    noise, rms, held_out : float
        Of the displacement; of the operator over all samples; of one that had not seen them (m).
    lag : float
        Of the displacement behind the voltage: hold of the converter, charging, body, s.
    remanence : Interval, optional
        m.
    capacitance, mass : float, optional
        As given: clamped, F; moved, kg.
    damping : Interval, optional
        N s/m.
    creep : KelvinVoigtCreep, optional
        Behind the operator.
    capacitor : MaxwellResistiveCapacitor, optional
        C to V, of the lumped model; and the rms it held out (m).
    capacitor_held_out : float, optional
    """

    name: str
    sources: tuple[str, ...]
    transducer: Interval
    stiffness: Interval
    operator: AlJanaideh | Ang
    numbers: tuple[FittedNumber, ...]
    low: float
    high: float
    noise: float
    rms: float
    held_out: float
    lag: float = 0.0
    remanence: Interval | None = None
    capacitance: Positive | None = None
    mass: Positive | None = None
    damping: Interval | None = None
    creep: KelvinVoigtCreep | None = None
    capacitor: MaxwellResistiveCapacitor | None = None
    capacitor_held_out: float | None = None

    def __post_init__(self) -> None:
        """Refuse a range that is none, and constants that are not positive."""
        if not self.low < self.high:
            raise UnusableInput(f"{self.name}: voltages {self.low:g} .. {self.high:g} are no range")
        if not (self.transducer.value > 0.0 and self.stiffness.value > 0.0):
            raise UnusableInput(f"{self.name}: T and k must be positive")

    @property
    def model(self) -> InvertibleOperator[Any]:
        """The operator with its creep; timed if it creeps."""
        return self.operator if self.creep is None else Cascade(self.operator, self.creep)

    @property
    def trained(self) -> FloatArray:
        """Voltages after which every play that loops move is known: up to `high` and back."""
        return np.array([0.0, self.high, 0.0])

    @property
    def settling(self) -> float:
        """Seconds after which the creep of a stroke is over, and 0.05 s at least."""
        return 0.05 if self.creep is None else min(4.0 * max(map(float, self.creep.times)), 60.0)

    def response(self, volt: FloatArray, rate: float, history: ArrayLike = ()) -> FloatArray:
        """Return the displacement from the first sample on (m), after a history of voltages."""
        past = np.asarray(history, float)
        _, memory = self.operator.run(past) if past.size else (None, None)
        late = np.arange(volt.size) - self.lag * rate
        x, _ = self.operator.run(np.interp(late, np.arange(volt.size), volt), memory)
        x = x - x[0]
        if self.creep is not None:
            x, _ = self.creep.run(x, self.creep.initial_memory(0.0), step=1.0 / rate)
        return x

    def stroke(self, history: ArrayLike = ()) -> float:
        """Return how far the stack goes from where the history leaves it, up to `high`, m."""
        past = np.asarray(history, float)
        x, _ = self.operator.run(np.concatenate((past, [0.0, self.high])))
        return float(x[-1] - x[-2])

    def voltage(
        self, x_ref: FloatArray, rate: float, history: ArrayLike, limits: DriveLimits
    ) -> FloatArray:
        """Return the voltage that makes a displacement, counted from where the history ends.

        Parameters
        ----------
        x_ref : ndarray, shape (N,), m
            From 0.
        rate : float
            Hz.
        history : array
            Voltages before, from virgin rest on; ends at 0 V.
        limits : DriveLimits

        Raises
        ------
        VoltageLimit
            If the target asks for more than the limits or the recorded voltages.
        NotInvertible
            If the operator has no inverse.
        """
        past = np.asarray(history, float)
        start = self.operator.initial_memory(0.0)
        if past.size:
            _, start = self.operator.run(past)
        inverse, before = self.operator.inverse(), self.operator.inverse_memory(start)
        rest = float(self.operator.run([0.0], start)[0][0])
        # the target comes early, by as much as the displacement comes late
        early = np.arange(x_ref.size) + self.lag * rate
        wanted = np.interp(early, np.arange(x_ref.size), x_ref)
        if self.creep is not None:
            at_rest = self.creep.initial_memory(0.0)
            wanted, _ = self.creep.inverse().run(wanted, at_rest, step=1.0 / rate)
        volt, _ = inverse.run(wanted + rest, before)
        low, high = max(limits.low, self.low), min(limits.high, self.high)
        bad = np.flatnonzero((volt < low - 1e-3 * (high - low)) | (volt > high * (1.0 + 1e-9)))
        if bad.size:
            i = int(bad[0])
            hint = (
                f"this stack goes from 0 to {1e6 * self.stroke(history):.4g} um there"
                if volt[i] > high
                else "what has crept comes back slowly, so come back later, or less far"
            )
            raise VoltageLimit(
                f"target: {1e6 * x_ref[i]:.4g} um at sample {i} needs {volt[i]:.4g} V, outside of "
                f"{low:g} .. {high:g} V; {hint}"
            )
        return np.asarray(np.clip(volt, low, high))

    def graph(self) -> BondGraph:
        """Return the complete model: lumped stack with the operator as its hysteresis.

        Creep stands behind it, as the law of the reading; the lag is left to the chain.

        Raises
        ------
        UnusableInput
            If the capacitance is not known.
        """
        if self.capacitance is None:
            raise UnusableInput(
                f"{self.name}: the lumped model needs the capacitance; give --capacitance (F)"
            )
        at = Lumped(self.capacitance, self.transducer.value, self.stiffness.value)
        more: dict[str, Any] = {} if self.mass is None else {"mass": self.mass}
        more |= {} if self.damping is None else {"damping": self.damping.value}
        graph = stack_lumped(
            lumped_law(self.operator, at), capacitance=at.capacitance, transducer=at.transducer,
            stiffness=at.stiffness, **more,
        )  # fmt: skip
        return graph if self.creep is None else graph.with_element("x", law=Hysteretic(self.creep))

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        content: dict[str, Any] = {"format": FORMAT}
        for f in fields(self):
            value = getattr(self, f.name)
            if value is not None:
                content[f.name] = _plain(value)
        return content

    @classmethod
    def from_dict(cls, data: Any, where: str = "") -> Self:
        """Read plain data, checked.

        Raises
        ------
        UnusableInput
            One line: which field, why.
        """
        content = dict(require_object(data, where or "the whole file", "an identified stack"))
        if content.pop("format", None) != FORMAT:
            raise UnusableInput(
                f"{where}: is no identified stack; bondsight stack identify writes one"
            )
        return make(lambda: record(cls, content, "", _RULES, "an identified stack"), where)

    def save(self, path: Path) -> None:
        """Write it as JSON, whole or not at all."""
        write_atomically(path, json.dumps(self.to_dict(), indent=1, allow_nan=False) + "\n")

    @classmethod
    def open(cls, path: Path) -> Self:
        """Read it from a file; raises as `from_dict`."""
        data, where = plain_data(path)
        return cls.from_dict(data, where)


def _plain(value: Any) -> Any:
    if isinstance(value, Operator):
        return value.to_dict()
    if isinstance(value, FittedNumber):
        return {name: v for name, v in asdict(value).items() if v != ""}
    if isinstance(value, Interval):
        return asdict(value)
    if isinstance(value, tuple):
        return [_plain(v) for v in value]
    return value
