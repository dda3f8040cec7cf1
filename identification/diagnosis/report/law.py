"""The law that was found, along the recording: argument, deviation, whole output."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import sympy as sp

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import C, I, R
from bondgraph.simulation.exact_run import prepare, run_prepared
from bondgraph.support.arrays import Array
from bondgraph.support.errors import BondsightError
from identification.diagnosis.catalogue.places import law_of, sense
from identification.diagnosis.explanation.law_formula import variable_names
from identification.diagnosis.screening.observation import traced
from identification.diagnosis.search.candidates import Candidate
from identification.estimation.single_record import Fit
from identification.study.residual import by_step, parameters_at, time_memories, windows


@dataclass(frozen=True)
class LawPath:
    """Where the argument of a law went and what the law added to the straight line.

    Attributes
    ----------
    time, argument, deviation : ndarray, shape (N,), SI
    slope : float
        Slope of the straight line it deviates from, SI.
    """

    time: Array
    argument: Array
    deviation: Array
    slope: float
    argument_unit: str
    output_unit: str
    argument_word: str
    output_word: str


def path(trial: Candidate) -> LawPath | None:
    """Path of the law that `trial` inserted; None when it inserted none, or none that is seen."""
    f = trial.fit
    ports, data = law_ports(f), f.problem.data
    found = _run(f, ports.index(trial.element)) if trial.element in ports else _seen(trial)
    if found is None:
        return None
    s, w = found
    good = np.isfinite(s) & np.isfinite(w) & (data.mask("train") | data.mask("held-out"))
    if not good.any():
        return None
    graph = f.problem.graph
    return LawPath(
        f.problem.data.time[good], s[good], w[good], slope_of(graph, trial.element, f.values),
        *variable_names(graph, trial.element),
    )  # fmt: skip


def law_ports(f: Fit) -> list[str]:
    """Elements with a scalar law, in the order of the exact step; empty for general graphs."""
    lure = f.problem.dynamics.lure
    return [] if lure is None else [p.element for p in lure.laws]


def _run(f: Fit, column: int) -> tuple[Array, Array]:
    problem = f.problem
    s, w = np.full(problem.data.n, np.nan), np.full(problem.data.n, np.nan)
    p = parameters_at(problem, f.point.theta)
    ready = by_step(lambda h: prepare(problem.compiled, p, h, problem.steps))
    for part, x0 in zip(windows(problem), f.point.states, strict=True):
        own = ready(problem.data.step(part))
        run = run_prepared(
            own, problem.inputs[part], x0,
            fine=problem.fine_inputs(part), memory=time_memories(problem, part.start),
        )  # fmt: skip
        s[part], w[part] = run.s[:, column], run.w[:, column]
    return s, w


def _seen(trial: Candidate) -> tuple[Array, Array] | None:
    """Return argument and deviation of a storage's or resistor's law in a general graph."""
    f, element = trial.fit, trial.element
    graph = f.problem.graph
    if not isinstance(graph[element], C | R) or law_of(graph[element]) is None:
        return None
    if f.problem.dynamics.lure is not None:
        return None
    try:
        found = traced(f, element)
    except BondsightError:
        return None
    if found is None:
        return None
    argument, output = sense(graph, graph[element]) * found[0], found[1]
    return argument, output - slope_of(graph, element, f.values) * argument


def slope_of(graph: BondGraph, element: str, values: dict[str, float]) -> float:
    """Linear coefficient of an element at fitted values; 1 for sources and sensors."""
    e = graph[element]
    if not isinstance(e, C | I | R):
        return 1.0
    if isinstance(e, R) and e.value == 0:
        return 0.0
    expression = sp.sympify(graph.slope(e))
    known = {v: values[str(v)] for v in expression.free_symbols if str(v) in values}
    found = expression.subs(known)
    return float(found) if found.is_number else 1.0
