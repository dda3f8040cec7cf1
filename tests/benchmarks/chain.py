"""Chains of mass, spring and damper: how the cost of equations grows, one size in one process.

Runs alone: ``python -m tests.benchmarks.chain FAMILY SEGMENTS`` prints one JSON
object with seconds and MiB, so that its peak memory is that of one chain.
"""

from __future__ import annotations

import gc
import json
import resource
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from bondgraph import TF, BondGraph, C, I, One, R, Se, Zero
from bondgraph.graph.elements import Element

__all__ = ["DAMPING", "FAMILIES", "MOST_CLOSED", "STIFFNESS", "chain", "mass", "measure"]

MOST_CLOSED = 200
"""Segments beyond which the closed symbolic forms are not asked for."""

REPEATED = 50
"""Segments up to which the best of three runs counts."""

STIFFNESS, DAMPING = 1000.0, 0.5


def mass(i: int) -> float:
    """Mass of segment `i`, kg: no two are alike, so nothing cancels by chance."""
    return 1.0 + 0.001 * i


def chain(segments: int, family: str = "plain") -> BondGraph:
    """Return a driven chain with a spring and a damper behind each mass, the last on the ground.

    Parameters
    ----------
    segments : int
    family : {"plain", "resistive", "rigid"}
        "resistive": two more dampers in series in every segment, an algebraic loop each.
        "rigid": a second mass on a lever at every mass, a dependent storage each.
    """
    beside = FAMILIES[family]
    with BondGraph(f"chain_{segments}") as graph:
        at = Se("F") >> One("v_1")
        for i in range(1, segments + 1):
            at >> I(f"m_{i}", mass(i))
            between = at >> Zero(f"n_{i}")
            link = between >> One(f"d_{i}")
            link >> C(f"k_{i}", stiffness=STIFFNESS)
            link >> R(f"b_{i}", DAMPING)
            beside(i, at, link)
            if i < segments:
                at = between >> One(f"v_{i + 1}")
    return graph


def _plain(_: int, at: Element, link: Element) -> None:
    """Add nothing."""


def _resistive(i: int, at: Element, link: Element) -> None:
    node = link >> Zero(f"g_{i}")
    node >> R(f"a_{i}", 0.2)
    node >> R(f"c_{i}", 0.3)


def _rigid(i: int, at: Element, link: Element) -> None:
    at >> TF(f"l_{i}", 2.0) >> One(f"w_{i}") >> I(f"j_{i}", 0.1)


FAMILIES: dict[str, Callable[[int, Element, Element], None]] = {
    "plain": _plain,
    "resistive": _resistive,
    "rigid": _rigid,
}
"""What every segment has beside its mass, spring and damper."""


def measure(segments: int, family: str = "plain") -> dict[str, Any]:
    """Return seconds of every stage, totals from the graph on, and the peak memory in MiB.

    ``equations`` is causality and ordered equations, ``numeric`` the state equations with numbers,
    ``function`` the CasADi function of the right-hand side, ``closed`` the closed symbolic forms.
    """
    _once(3, family)  # imports and first calls belong to no size
    runs = [_once(segments, family) for _ in range(3 if segments <= REPEATED else 1)]
    best = {k: min(r[k] for r in runs) for k in runs[0]}
    return {
        "segments": segments,
        "family": family,
        **best,
        "numeric_total": min(r["build"] + r["equations"] + r["numeric"] for r in runs),
        "function_total": min(r["build"] + r["equations"] + r["function"] for r in runs),
        "peak": peak_memory(),
    }


def _once(segments: int, family: str) -> dict[str, float]:
    from sympy.core.cache import clear_cache

    from bondgraph.analysis.linear import linear_rates
    from bondgraph.equations.codegen import program_of
    from bondgraph.equations.derivation import equations

    clear_cache()  # a repetition must not find the work of the one before
    gc.collect()
    seconds: dict[str, float] = {}

    def timed(name: str, action: Callable[[], Any]) -> Any:
        begin = time.perf_counter()
        made = action()
        seconds[name] = time.perf_counter() - begin
        return made

    graph = timed("build", lambda: chain(segments, family))
    model = timed("equations", lambda: equations(graph))
    timed("function", lambda: program_of(model).rhs)
    timed("numeric", lambda: linear_rates(model))
    if segments <= MOST_CLOSED:
        timed("closed", lambda: model.rates)
    return seconds


def peak_memory() -> float:
    """Peak of this process in MiB; where Linux says it, without what its parent held."""
    try:
        lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
        return next(float(v.split()[1]) for v in lines if v.startswith("VmHWM")) / 1024
    except (OSError, StopIteration):
        unit = 2**20 if sys.platform == "darwin" else 1024
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / unit


if __name__ == "__main__":
    print(json.dumps(measure(int(sys.argv[2]), sys.argv[1])))
