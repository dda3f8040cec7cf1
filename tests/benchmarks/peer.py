"""BondGraphTools on the same chain: seconds in its own Python, and whether the equations agree."""

from __future__ import annotations

import json
import subprocess
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import sympy as sp

from bondgraph.analysis.linear import linear_rates
from bondgraph.equations.derivation import equations
from bondgraph.support.errors import UnusableInput
from tests.benchmarks.chain import DAMPING, STIFFNESS, chain, mass
from tests.proof.conformance.reader import read_expression

_SCRIPT = Path(__file__).with_name("peer_chain.py")


@dataclass(frozen=True)
class PeerTime:
    """What the peer needed for one chain.

    Attributes
    ----------
    seconds : float or None
        From the first component to the state equations, without imports; None beyond the limit.
    difference : float or None
        Largest difference of a coefficient from ours, relative to the largest of its equation.
    """

    seconds: float | None
    difference: float | None


def peer_time(python: str, segments: int, limit: float) -> PeerTime:
    """Let BondGraphTools derive the plain chain with numbers.

    Parameters
    ----------
    python : str
        A Python with BondGraphTools.
    segments : int
    limit : float
        Seconds, the start of its Python included.

    Raises
    ------
    UnusableInput
        It fails.
    """
    values = {
        "masses": [mass(i) for i in range(1, segments + 1)],
        "compliance": 1.0 / STIFFNESS,
        "damping": DAMPING,
    }
    try:
        run = subprocess.run(
            [python, "-I", str(_SCRIPT)],
            input=json.dumps(values), capture_output=True, text=True, timeout=limit,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        return PeerTime(None, None)
    if run.returncode:
        last = (run.stderr.strip().splitlines() or ["no message"])[-1]
        raise UnusableInput(f"--peer {python} fails on a chain of {segments}: {last}")
    reply = json.loads(run.stdout)
    return PeerTime(float(reply["seconds"]), difference(segments, reply))


def difference(segments: int, reply: dict[str, Any]) -> float:
    """Return the largest relative difference of the peer's coefficients from ours."""
    ours = linear_rates(equations(chain(segments)))
    names = [s.name for s in equations(chain(segments)).stored]
    position = {n: i for i, n in enumerate(names)}
    table = {x: f"{'p' if n.startswith('m') else 'q'}_{n}" for x, n in reply["states"].items()}
    table |= reply["controls"]
    worst, met = 0.0, set()
    for text in reply["relations"]:
        relation = sp.expand(read_expression(text))
        found = {str(v): float(relation.coeff(v)) for v in relation.free_symbols}
        (rate,) = (n for n in found if n.startswith("dx_"))
        row = position[table[rate[1:]]]
        met.add(row)
        scale = -found.pop(rate)
        theirs = {table[n]: v / scale for n, v in found.items()}
        mine = {n: float(v) for n, v in ours[row].items()}
        largest = max(abs(v) for v in mine.values())
        for n in theirs.keys() | mine.keys():
            worst = max(worst, abs(theirs.get(n, 0.0) - mine.get(n, 0.0)) / largest)
    return worst if len(met) == len(names) else float("inf")
