"""An identified stack held against a recording that no fit has seen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from actuators.stack.conversions import Lumped
from actuators.stack.identified import IdentifiedStack
from actuators.stack.lumped import stack_lumped
from actuators.stack.ramps import FromRest, from_rest
from bondgraph.graph.bond_graph import BondGraph
from bondgraph.hysteresis.turning_points import turning_points
from bondgraph.laws import Hysteretic
from bondgraph.signals.recording import Recording
from bondgraph.simulation.simulate import simulate
from bondgraph.support.ops import FloatArray

PRINTED = {"operator and": "28.63, 33.88, table 6.3", "Maxwell": "87.36, table 6.5"}
"""What the thesis prints of the sine that it fitted, rms in nm."""
CREEPS = 2.0
"""Of the noise: more of a change during the rest is told."""
TURN = 20
"""Samples from one voltage of the history to the next."""


@dataclass(frozen=True, slots=True)
class Validation:
    """Errors on a recording that was not fitted.

    Attributes
    ----------
    name : str
    span, noise, creeping : float
        Range of the displacement, its noise from sample to sample, and how far it still crept
        while it rested (m).
    errors : dict of str to ndarray
        Model less measurement from the end of the rest on (m): of the operator with its creep; of
        the complete model, which is the lumped stack with the operator as its hysteresis; of the
        lumped stack with Maxwell elements, if they are known.
    """

    name: str
    span: float
    noise: float
    creeping: float
    errors: dict[str, FloatArray]

    def __str__(self) -> str:
        """Return the table, the thesis' numbers beside."""
        lines = [
            f"validation: {self.name}, which no fit has seen, {1e6 * self.span:.3f} um, noise "
            f"{1e9 * self.noise:.2f} nm (rms, of its range, largest; thesis)"
        ]
        for name, e in self.errors.items():
            printed = next((said for word, said in PRINTED.items() if word in name), "-")
            lines.append(
                f"  {name:36s}{1e9 * rms(e):8.2f} nm {100 * rms(e) / self.span:7.3f} % "
                f"{1e9 * float(np.abs(e).max()):8.1f} nm   ({printed})"
            )
        if abs(self.creeping) > CREEPS * self.noise:
            lines.append(
                f"  note: x crept by {1e9 * self.creeping:.1f} nm while it rested; models begin at "
                "rest, so wait longer before such a take"
            )
        return "\n".join(lines)


def rms(error: FloatArray) -> float:
    """Return the root of the mean square.

    Examples
    --------
    >>> rms(np.array([3.0, -3.0]))
    3.0
    """
    return float(np.sqrt(np.mean(error**2)))


def validate(
    stack: IdentifiedStack, fresh: Recording, before: Sequence[Recording] = ()
) -> Validation:
    """Hold a stack against a recording.

    Parameters
    ----------
    stack : IdentifiedStack
    fresh : Recording
        From rest at 0 V.
    before : sequence of Recording
        What the actuator has seen since it was virgin; none if it was demagnetised.

    Raises
    ------
    UnusableInput
        If a recording does not begin at rest, or the capacitance is not known.
    """
    record = from_rest(fresh)
    inputs = [r.volt - r.volt[0] for r in map(from_rest, before)]
    history = np.concatenate([np.zeros(0), *(u[turning_points(u)] for u in inputs)])
    volt = record.volt - record.volt[0]
    found = {
        "operator and creep": stack.response(volt, record.rate, history),
        "complete model: lumped + operator": _complete(stack, stack.graph(), record, history),
    }
    if stack.capacitor is not None and stack.capacitance is not None:
        at = Lumped(stack.capacitance, stack.transducer.value, stack.stiffness.value)
        graph = stack_lumped(
            Hysteretic(stack.capacitor), capacitance=at.capacitance, transducer=at.transducer,
            stiffness=at.stiffness,
        )  # fmt: skip
        if stack.creep is not None:
            graph = graph.with_element("x", law=Hysteretic(stack.creep))
        found["complete model: lumped + Maxwell"] = _complete(stack, graph, record, history)
    errors = {k: (x - record.x)[record.resting :] for k, x in found.items()}
    third = max(record.resting // 3, 1)
    crept = float(
        record.x[record.resting - third : record.resting].mean() - record.x[:third].mean()
    )
    return Validation(record.name, float(np.ptp(record.x)), record.noise, crept, errors)


def _complete(
    stack: IdentifiedStack, graph: BondGraph, record: FromRest, history: FloatArray
) -> FloatArray:
    """Return the displacement of a graph behind a history and a rest (m)."""
    turns = np.append(history, 0.0)
    past = np.interp(np.arange(TURN * turns.size) / TURN, np.arange(turns.size), turns)
    rest = np.zeros(round(stack.settling * record.rate))
    volt = np.concatenate((past, rest, record.volt - record.volt[0]))
    late = np.arange(volt.size) - stack.lag * record.rate
    drive = np.interp(late, np.arange(volt.size), volt)
    x = simulate(graph, np.arange(volt.size) / record.rate, {"V_in": drive}, hold="linear")["x"]
    begin = past.size + rest.size
    return np.asarray(x[begin:] - x[begin : begin + record.resting].mean())
