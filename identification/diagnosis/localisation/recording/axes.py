"""Axes along which the misfit may gather: time, and what each port does."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import C, Source, TwoPort
from bondgraph.graph.sensors import Sensor
from bondgraph.support.arrays import Array
from identification.diagnosis.localisation.recording.history import since_turning
from identification.diagnosis.localisation.recording.variables import (
    displacement_words,
    two_port_variables,
    variables_of,
)
from identification.diagnosis.screening.port_history import PortHistory
from identification.report.numbers import unit_of_level

NOTHING: Mapping[str, str] = MappingProxyType({})


@dataclass(frozen=True, eq=False)
class MisfitAxis:
    """One variable along the record.

    Attributes
    ----------
    name : str
        Words, ``displacement of k``.
    values : ndarray, shape (N,), SI
    kind : str
        ``time``, ``amplitude``, ``velocity`` or ``history``.
    """

    name: str
    values: Array
    unit: str
    kind: str
    element: str = ""


def time_axis(time: Array) -> MisfitAxis:
    """Time itself."""
    return MisfitAxis("time", time, "s", "time")


def axes_of(
    graph: BondGraph, name: str, past: PortHistory, read_in: Mapping[str, str] = NOTHING
) -> tuple[MisfitAxis, ...]:
    """Amplitude, velocity and history of one port; empty for what does not move.

    Storages, resistors and inertias have a displacement and its rate (the flow); sources,
    sensors and two-ports the variable they carry and its rate.

    Parameters
    ----------
    read_in : mapping of str to str, optional
        Units in which the numbers of channels were read.
    """
    e = graph[name]
    moved, rate = past.argument, past.rate
    if isinstance(e, Source | Sensor):
        unit = str(e.unit or "")
        what = "reading" if isinstance(e, Sensor) else "input" if e.measured else "command"
        shown = unit_of_level(unit, read_in.get(name, ""))
        named = ((f"{what} {name}", shown), (f"rate of {name}", f"{unit}/s" if unit else ""))
    elif isinstance(e, TwoPort):
        unit, _, word, _ = two_port_variables(graph, e)
        named = ((word, unit), (f"rate of the {word}", f"{unit}/s" if unit else ""))
    else:
        v = variables_of(e)
        if not isinstance(e, C):
            moved, rate = past.argument if past.moved is None else past.moved, past.argument
        named = (
            (displacement_words(e), v.displacement_unit),
            (f"{v.flow} of {name}", v.flow_unit),
        )
    (amplitude, unit), (velocity, per_second) = named
    made = [
        MisfitAxis(amplitude, moved, unit, "amplitude", name),
        MisfitAxis(velocity, rate, per_second, "velocity", name),
        MisfitAxis(
            f"the way of {name} since it last turned", since_turning(_finite(moved)), unit,
            "history", name,
        ),
    ]  # fmt: skip
    return tuple(a for a in made if np.isfinite(a.values).any() and np.ptp(_finite(a.values)) > 0)


def port_axes(
    graph: BondGraph,
    past: Iterable[tuple[str, PortHistory]],
    first: Iterable[str] = (),
    read_in: Mapping[str, str] = NOTHING,
) -> tuple[MisfitAxis, ...]:
    """Axes of all ports, those of `first` before the others."""
    order = list(first)
    found = sorted(past, key=lambda p: order.index(p[0]) if p[0] in order else len(order))
    return tuple(a for n, p in found if n in graph.elements for a in axes_of(graph, n, p, read_in))


def _finite(v: Array) -> Array:
    return np.where(np.isfinite(v), v, 0.0)
