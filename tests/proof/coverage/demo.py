"""Plants for the coverage of intervals: a spring and a hysteretic spring."""

from __future__ import annotations

from dataclasses import replace

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import C, I, One, R, Se
from bondgraph.graph.sensors import Dq
from bondgraph.laws import StopSum
from identification.uncertainty.cases import SAMPLES, case_of
from identification.uncertainty.coverage import Case


def demo_cases(samples: int = SAMPLES, noise: float = 0.02) -> tuple[Case, ...]:
    """Return a linear and a hysteretic spring, each with white and with coloured noise.

    Coloured noise (correlation 0.8 from sample to sample) is once taken for white, once modelled.
    """
    found = []
    for name, graph in (("linear", _spring(None)), ("hysteretic", _spring(_stops()))):
        case = case_of(graph, samples=samples, noise=noise, amplitude=6.0, top=8.0)
        found.append(replace(case, name=f"{name} spring, white noise"))
        coloured = replace(case, colour=0.8, name=f"{name} spring, coloured noise taken for white")
        found.append(coloured)
        modelled = f"{name} spring, coloured noise taken for coloured"
        found.append(replace(coloured, model="coloured", name=modelled))
    return tuple(found)


def _stops() -> StopSum:
    return StopSum((0.01, 0.03), height=40.0, scale=40.0, unit="N/m")


def _spring(law: StopSum | None) -> BondGraph:
    with BondGraph("spring" if law is None else "hysteretic_spring") as g:
        body = One("body")
        Se("F", unit="N") >> body >> I("m", 0.5, unit="kg")
        body >> R("d", 2.0, unit="N*s/m")
        body >> C("k", stiffness=200.0, unit="N/m", law=law)
        body >> Dq("x", unit="m")
    return g
