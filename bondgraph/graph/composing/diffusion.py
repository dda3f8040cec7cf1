"""Diffusion that never ends as a ladder: Warburg's impedance over a band."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, log, log10, pi, sqrt

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.composing.hierarchy import Port
from bondgraph.graph.elements import C, One, R, Zero

STEP = sqrt(10.0)
"""Ratio of neighbouring time constants."""


@dataclass(frozen=True)
class Ladder:
    """``1/sqrt(s)`` as ``direct + 1/(s kept) + sum r / (1 + s tau)``; everything for a ``W`` of 1.

    From ``1/sqrt(s) = (1/pi) integral sqrt(tau) / (1 + s tau) d(ln tau)``: the trapezoidal rule in
    ``ln tau``, two time constants a decade, with an error of ``2 exp(-pi^2 / ln STEP)``; what is
    faster than the first is a resistance, what is slower than the last a capacity, each exact to
    first order. Warburg, Ann. Physik 303 (1899) 493; the sum is Foster's first form.

    Attributes
    ----------
    branches : tuple of (float, float)
        Resistance and time constant, s, of every branch.
    direct, kept : float
        Resistance and capacity of the tails.
    """

    branches: tuple[tuple[float, float], ...]
    direct: float
    kept: float


def warburg_ladder(slowest: float, fastest: float) -> Ladder:
    """Return the ladder that holds between two times, s, to a per cent.

    Examples
    --------
    >>> len(warburg_ladder(100.0, 1.0).branches)
    9
    """
    count = 2 * ceil(log10(slowest / fastest)) + 5  # a decade beyond the band on either side
    first = sqrt(slowest * fastest) * STEP ** (-0.5 * (count - 1))
    taus = [first * STEP**k for k in range(count)]
    low, high = first / sqrt(STEP), taus[-1] * sqrt(STEP)  # the rule reaches half a step beyond
    branches = tuple((log(STEP) / pi * sqrt(tau), tau) for tau in taus)
    return Ladder(branches, 2.0 / pi * sqrt(low), 0.5 * pi * sqrt(high))


def warburg(coefficient: float = 1e-3, slowest: float = 1000.0, fastest: float = 0.1) -> BondGraph:
    """Diffusion in a cell, in series: ``u_left - u_right = W i / sqrt(s)`` over a band.

    A current step ``i`` gives ``2 W i sqrt(t / pi)`` between the times `fastest` and `slowest`, s.
    Ports ``left``, ``right`` (V). Parameter ``W`` (ohm/s^0.5, a number of ohm here): ``sqrt(2)``
    times the Warburg coefficient of ``sigma (1 - j) / sqrt(omega)``.
    """
    ladder = warburg_ladder(slowest, fastest)
    with BondGraph("warburg") as g:
        w = g.parameter("W", coefficient)
        path = One("path")
        Port("left", unit="V") >> path >> R("R_fast", w * ladder.direct)
        path >> C("C_slow", ladder.kept / w)
        for k, (r, tau) in enumerate(ladder.branches, start=1):
            node = Zero(f"layer_{k}")
            path >> node >> R(f"R_{k}", w * r)
            node >> C(f"C_{k}", tau / r / w)
        path >> Port("right", unit="V")
    return g
