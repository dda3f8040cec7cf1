"""The variables of a unit: one list, whose order fixes the value references in C and XML."""

from __future__ import annotations

from dataclasses import dataclass

from bondgraph.equations.program import Program
from bondgraph.export.fmu.names import unique

# name, unit, description, start, reference of the state it is the derivative of
_Row = tuple[str, str, str, float | None, int | None]


@dataclass(frozen=True, slots=True)
class Variable:
    """One variable.

    Attributes
    ----------
    name, unit, description : str
    reference : int
        Value reference; also its position in the list.
    causality, variability : str
        Of FMI; ``initial`` follows from whether there is a start value.
    start : float or None
    derivative : int or None
        Value reference of the state whose derivative this is.
    kind : str
        ``time input output parameter state rate algebraic memory option indicator``.
    """

    name: str
    unit: str
    description: str
    reference: int
    causality: str
    variability: str
    start: float | None
    derivative: int | None
    kind: str


def variables(
    program: Program,
    largest_step: float,
    tolerance: float,
    events: tuple[int, ...],
    switches: int = 0,
) -> tuple[Variable, ...]:
    """List time, inputs, outputs, parameters, states, rates, unknowns, memory, options, indicators.

    The blocks stand in the order that ``model.h`` counts them in.
    """
    rates = {f"d_{name}" for name in program.inputs} & set(program.input_rates)
    names = unique(
        [
            ("input", program.inputs),
            ("output", program.outputs),
            ("parameter", program.parameters),
            ("state", program.states),
            ("unknown", program.algebraic),
            ("memory", program.memory),
            ("time", ["time"]),
            ("solver", ["solver.largest_step", "solver.tolerance"]),
            ("event", [f"event.turning_{i}" for i in range(len(events))]),
            ("switch", [f"event.switch_{i}" for i in range(switches)]),
        ]
    )
    out: list[Variable] = []

    def add(kind: str, causality: str, variability: str, rows: list[_Row]) -> None:
        for name, unit, text, start, derivative in rows:
            first = None if start is None else float(start)
            at = len(out)
            out.append(
                Variable(name, unit, text, at, causality, variability, first, derivative, kind)
            )

    def unit(name: str) -> str:
        return program.units.get(name, "")

    add("time", "independent", "continuous", [(names["time"][0], "s", "Time", None, None)])
    add("input", "input", "continuous", [
        (shown, unit(own), _input_text(own, own in rates), 0.0, None)
        for shown, own in zip(names["input"], program.inputs, strict=True)
    ])  # fmt: skip
    add("output", "output", "continuous", [
        (shown, unit(own), "Reading of a sensor", None, None)
        for shown, own in zip(names["output"], program.outputs, strict=True)
    ])  # fmt: skip
    add("parameter", "parameter", "tunable", [
        (shown, unit(own), "Parameter", value, None)
        for shown, own, value in zip(
            names["parameter"], program.parameters, program.nominal, strict=True
        )
    ])  # fmt: skip
    first_state = len(out)
    add("state", "local", "continuous", [
        (shown, unit(own), "State", value, None)
        for shown, own, value in zip(names["state"], program.states, program.start, strict=True)
    ])  # fmt: skip
    add("rate", "local", "continuous", [
        (f"der({shown})", _per_second(unit(own)), f"Rate of {shown}", None, first_state + i)
        for i, (shown, own) in enumerate(zip(names["state"], program.states, strict=True))
    ])  # fmt: skip
    add("algebraic", "local", "continuous", [
        (shown, unit(own), "Algebraic unknown", None, None)
        for shown, own in zip(names["unknown"], program.algebraic, strict=True)
    ])  # fmt: skip
    # not `discrete`: it moves on accepted steps, without an event
    add("memory", "local", "continuous", [
        (shown, unit(own), "Memory of a law; it moves on accepted steps only", value, None)
        for shown, own, value in zip(names["memory"], program.memory, program.virgin, strict=True)
    ])  # fmt: skip
    add("option", "parameter", "fixed", [
        (names["solver"][0], "s", "Largest internal step; 0: chosen by the error alone",
         largest_step, None),
        (names["solver"][1], "", "Relative tolerance of the internal steps", tolerance, None),
    ])  # fmt: skip
    add("indicator", "local", "continuous", [
        (name, "", f"Crosses zero where the argument of law {laws} turns", None, None)
        for name, laws in zip(names["event"], events, strict=True)
    ])  # fmt: skip
    add("indicator", "local", "continuous", [
        (name, "", "Crosses zero where a law changes its piece", None, None)
        for name in names["switch"]
    ])  # fmt: skip
    return tuple(out)


def _input_text(name: str, rate: bool) -> str:
    if rate:
        return f"Time derivative of the input {name.removeprefix('d_')}"
    return "Input, held over a communication step unless its slope is given"


def _per_second(unit: str) -> str:
    return f"({unit})/s" if unit not in ("", "1") else ""
