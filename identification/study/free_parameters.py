"""Which parameters of a model vary in a study, and which cannot."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import Valued
from bondgraph.graph.sensors import Sensor
from bondgraph.support.errors import UnusableInput, require_known
from identification.study.factors import drives
from identification.study.specification import Vary

_VALUES = ("value", "stiffness", "ratio")


def varied(
    graph: BondGraph, free: Sequence[str | Vary] | None, fixed: Mapping[str, float]
) -> tuple[Vary, ...]:
    """Return what varies: every parameter that is not fixed, or what is named.

    Raises
    ------
    UnknownName, UnusableInput
        A name that does not exist, is given twice, is fixed too, or does nothing.
    """
    known = graph.parameters
    require_known("parameter", graph.name, known, *fixed)
    if free is None:
        without = idle(graph)
        return tuple(
            Vary(n) for n, p in known.items() if not p.fixed and n not in fixed and n not in without
        )
    if isinstance(free, str):
        raise UnusableInput(f"free = {free!r}: give a sequence of names, such as ({free!r},)")
    found: dict[str, Vary] = {}
    for entry in free:
        v = Vary(entry) if isinstance(entry, str) else entry
        if not isinstance(v, Vary):
            raise UnusableInput(f"free parameter {entry!r}: give its name or a Vary(name, ...)")
        require_known("free parameter", graph.name, known, v.name)
        if v.name in found:
            raise UnusableInput(f"{v.name} is given as free twice; give it once")
        if v.name in idle(graph):
            raise UnusableInput(
                f"{v.name} does nothing in {graph.name}: the law of the element has a slope of its "
                "own; leave it out, or free numbers of the law"
            )
        if coarse := [e.name for e in graph.of_type(Sensor) if v.name in _step_of(graph, e)]:
            raise UnusableInput(
                f"{v.name} is the resolution of {coarse[0]}, on which its readings do not depend "
                "but for jumps: no fit finds it; read it off the recording and hold it"
            )
        if v.name in fixed:
            raise UnusableInput(f"{v.name} is given as free and as fixed; choose one")
        found[v.name] = v
    return tuple(found.values())


def _step_of(graph: BondGraph, e: Sensor) -> set[str]:
    step = graph.channel_value(e, "resolution")
    return set() if step is None else {str(s) for s in step.free_symbols}


def idle(graph: BondGraph) -> frozenset[str]:
    """Names of element values that a law with a slope of its own replaces."""
    replaced = {
        e.name for e in graph.of_type(Valued) if e.law is not None and e.law.slope is not None
    }
    values = [getattr(e, k, None) for e in graph.elements.values() for k in _VALUES]
    named = {str(s) for v in values for s in getattr(v, "free_symbols", ())}
    return frozenset(replaced - named)


def dead_times(graph: BondGraph) -> frozenset[str]:
    """Names of the parameters that are dead times of drives and sensors."""
    late = {s.drive.delay for s in drives(graph) if s.drive is not None and s.drive.delay}
    return frozenset(late | {s.delay for s in graph.of_type(Sensor) if s.delay})


def clocks(graph: BondGraph) -> frozenset[str]:
    """Names of the parameters that are ratio errors of clocks of the sensors."""
    return frozenset(s.clock for s in graph.of_type(Sensor) if s.clock)


def refuse_clocks(graph: BondGraph, method: str) -> None:
    """Refuse sensors that declare clocks of their own: only free runs read them at their times."""
    if own := [s.name for s in graph.of_type(Sensor) if s.clock]:
        raise UnusableInput(
            f"{method}: {', '.join(own)} is read by a clock of its own, which only a free run "
            "follows; use method='single_shooting'"
        )
