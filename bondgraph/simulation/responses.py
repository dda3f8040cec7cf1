"""Answers of a model at rest to a step and to a pulse of one source."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from bondgraph.equations.derivation import equations
from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import Modulated, Source
from bondgraph.simulation.simulate import simulate
from bondgraph.simulation.start import even_grid
from bondgraph.simulation.trajectory import Trajectory
from bondgraph.support.arrays import Array
from bondgraph.support.errors import UnusableInput, require_known


def step_response(
    graph: BondGraph,
    time: Array,
    source: str | None = None,
    size: float = 1.0,
    parameters: Mapping[str, float] | None = None,
    *,
    observed: Sequence[str] = (),
) -> Trajectory:
    """Simulate a step of one source at the first sample; before, everything rests at zero inputs.

    Parameters
    ----------
    time : ndarray, shape (N,), s
        Even grid.
    source : str, optional
        The only one that is commanded when not given; the others stay at zero.
    size : float, SI
        Height of the step.

    Examples
    --------
    >>> from bondgraph import BondGraph, Df, I, One, R, Se
    >>> with BondGraph("cart") as cart:
    ...     body = One("body")
    ...     _ = Se("F", unit="N") >> body >> I("m", 0.5, unit="kg")
    ...     _ = body >> R("d", 1.0, unit="N*s/m")
    ...     _ = body >> Df("v", unit="m/s")
    >>> v = step_response(cart, np.arange(1000) * 1e-3)["v"]
    >>> [round(float(x), 4) for x in v[[0, 500, 999]]]  # 1 - exp(-t / 0.5 s)
    [0.0, 0.6321, 0.8644]
    """
    time = even_grid(graph.name, time)
    return _answer(graph, time, source, np.full(time.size, float(size)), parameters, observed)


def impulse_response(
    graph: BondGraph,
    time: Array,
    source: str | None = None,
    size: float = 1.0,
    parameters: Mapping[str, float] | None = None,
    *,
    observed: Sequence[str] = (),
) -> Trajectory:
    """Simulate a pulse of area `size` (SI times s), held from the first sample to the second.

    As a converter would give it; parameters are those of `step_response`. For a linear model it is
    the answer to an impulse at half the first interval, to second order in the interval.

    Examples
    --------
    >>> rung = impulse_response(graph, t)
    >>> round(float(rung["x"].max()), 4)  # m
    0.0285
    """
    time = even_grid(graph.name, time)
    pulse = np.zeros(time.size)
    pulse[0] = size / (time[1] - time[0])
    return _answer(graph, time, source, pulse, parameters, observed)


def _answer(
    graph: BondGraph,
    time: Array,
    source: str | None,
    values: Array,
    parameters: Mapping[str, float] | None,
    observed: Sequence[str],
) -> Trajectory:
    names = [e.name for e in graph.of_type(Source) if not isinstance(e, Modulated)]
    if source is None:
        if len(names) != 1:
            raise UnusableInput(
                f"{graph.name} has {len(names)} sources ({', '.join(names)}); say which: source="
            )
        source = names[0]
    require_known("source", graph.name, names, source)
    if f"d_{source}" in equations(graph).input_rates:
        raise UnusableInput(
            f"{graph.name}: the equations need the rate of {source}, and what jumps has none; put "
            f"what yields between {source} and what it moves, or simulate a command that is smooth"
        )
    commands = {n: values if n == source else np.zeros(time.size) for n in names}
    return simulate(graph, time, commands, parameters, hold="hold", observed=observed)
