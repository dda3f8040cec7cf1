"""Structural identifiability: what inputs and readings of a graph could determine at best.

Linear graphs are decided exactly (see `transfer_jacobian`). Others are decided by their exact
sensitivities on rich random inputs of many sizes and speeds, at random parameter values, with a
gap in the singular values as the judge (see `joint_sensitivities`); a gap that is not wide is said.
Local identifiability at generic values is meant throughout: a combination that is called
determined may still have a finite number of values (Ljung and Glad, Automatica 30 (1994) 265).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bondgraph.analysis.kalman import null_vectors
from bondgraph.equations.derivation import equations
from bondgraph.equations.elimination import PRIME, echelon
from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.sensors import Sensor
from bondgraph.support.errors import UnusableInput, require_known
from bondgraph.support.spelled import spelled
from identification.uncertainty.combinations import Combination, FlatBlock, flat_blocks
from identification.uncertainty.joint_sensitivities import rich_nulls
from identification.uncertainty.transfer_jacobian import (
    random_integers,
    reconstructed,
    transfer_jacobian,
)


@dataclass(frozen=True)
class StructuralIdentifiability:
    """What the structure of a model lets data determine.

    Attributes
    ----------
    name : str
    free : tuple of str
        Parameters taken as unknown.
    rank : int
        How many numbers data can determine.
    exact : bool
        Decided exactly (linear graph), not by a gap in singular values.
    gap : float
        Ratio of the smallest nonzero to the largest zero singular value; infinite if exact.
    blocks : tuple of FlatBlock
        Dead parameters and groups with what they do determine.
    rests : tuple of str
        On which fixed numbers of a memory this rests, in sentences (`uncertainty.pinned`).

    Examples
    --------
    >>> from bondsight import identifiability
    >>> answer = identifiability(graph, ["m", "d", "k"])
    >>> answer.rank, len(answer.free)
    (3, 3)
    """

    name: str
    free: tuple[str, ...]
    rank: int
    exact: bool
    gap: float
    blocks: tuple[FlatBlock, ...]
    rests: tuple[str, ...] = ()

    @property
    def dead(self) -> tuple[str, ...]:
        """Parameters that no reading depends on."""
        return tuple(b.names[0] for b in self.blocks if b.dead)

    @property
    def groups(self) -> tuple[FlatBlock, ...]:
        """Groups of parameters that are only determined together."""
        return tuple(b for b in self.blocks if not b.dead)

    @property
    def determined(self) -> tuple[str, ...]:
        """Parameters determined one by one."""
        tied = {n for b in self.blocks for n in b.names}
        return tuple(n for n in self.free if n not in tied)

    @property
    def missing(self) -> int:
        """How many numbers are missing."""
        return len(self.free) - self.rank

    def __str__(self) -> str:
        """One line a statement."""
        how = "exactly" if self.exact else f"gap of {self.gap:.0e} in the singular values"
        what = "numbers" if not self.missing else "numbers, or combinations of them,"
        lines = [f"{self.name}: {self.rank} of {len(self.free)} {what} can be determined ({how})"]
        if self.determined:
            lines.append(f"  determined: {', '.join(self.determined)}")
        lines += [f"  {'dead' if b.dead else 'tied'}: {b}" for b in self.blocks]
        lines += [f"  but {said}" for said in self.rests]
        if not self.exact and self.gap < 1e3:
            lines.append("  the gap is narrow: take this as a hint, not as a proof")
        return "\n".join(lines)


@spelled
def identifiability(
    graph: BondGraph,
    free: Sequence[str] | None = None,
    *,
    values: Mapping[str, float] | None = None,
    seed: int = 1,
) -> StructuralIdentifiability:
    """Return what inputs and readings of `graph` can determine about the `free` parameters.

    Parameters
    ----------
    graph : BondGraph
    free : sequence of str, optional
        All parameters that are not declared fixed, when not given.
    values : mapping of str to float, optional
        Where a nonlinear graph is looked at; the declared values when not given.
    seed : int
        Of the generic points.

    Raises
    ------
    UnknownName
        A name of `free` is no parameter.
    UnusableInput
        The graph has no reading or no free parameter.

    Examples
    --------
    >>> print(identifiability(graph))
    positioner: 3 of 3 numbers can be determined (exactly)
      determined: m, d, k
    """
    graph.require_sound()
    names = _free(graph, free)
    graph = _not_rounded(graph)
    try:
        return _exact(graph, names, seed)
    except UnusableInput:
        from identification.uncertainty.pinned import pinned

        return replace(_by_gap(graph, names, values, seed), rests=pinned(graph, names))


def _not_rounded(graph: BondGraph) -> BondGraph:
    """Return the graph with readings as they are before rounding, which hides no parameter."""
    for e in graph.of_type(Sensor):
        if e.resolution is not None:
            graph = graph.with_element(e.name, resolution=None)
    return graph


def structural_rank(graph: BondGraph, free: Sequence[str], seed: int = 1) -> int:
    """Return how many numbers about `free` can be determined, without naming combinations."""
    graph = _not_rounded(graph)
    try:
        everything = tuple(dict.fromkeys((*equations(graph).parameters, *free)))
        point = random_integers(everything, seed)
        return len(echelon(transfer_jacobian(graph, free, point)))
    except UnusableInput:
        return len(free) - int(rich_nulls(graph, free, None, seed, points=1)[1][0].shape[1])


def _free(graph: BondGraph, free: Sequence[str] | None) -> tuple[str, ...]:
    known = dict(equations(graph).parameters)
    known |= {n: p for n, p in graph.parameters.items() if n not in known}
    if free is not None:
        require_known("parameter", graph.name, known, *free)
    names = tuple(free) if free is not None else tuple(n for n, p in known.items() if not p.fixed)
    if not names:
        raise UnusableInput(f"{graph.name}: no parameter is free; name some with free=")
    if not equations(graph).readings:
        raise UnusableInput(f"{graph.name} has no sensor, so nothing is determined; add one")
    return names


def _exact(graph: BondGraph, names: tuple[str, ...], seed: int) -> StructuralIdentifiability:
    everything = tuple(dict.fromkeys((*equations(graph).parameters, *names)))
    points = [random_integers(everything, seed + k) for k in range(2)]
    forms = [echelon(transfer_jacobian(graph, names, p)) for p in points]
    rank = max(len(f) for f in forms)
    generic = [(f, p) for f, p in zip(forms, points, strict=True) if len(f) == rank]
    residues = [
        np.array(null_vectors(f, len(names)), object).T.reshape(len(names), -1) for f, _ in generic
    ]
    nulls = [
        np.array([[float(reconstructed(int(v))) for v in row] for row in r]).reshape(r.shape)
        for r in residues
    ]
    values = [np.array([float(p[n]) for n in names]) for _, p in generic]
    blocks = []
    units = _units(graph, names)
    for b in flat_blocks(names, values, nulls, units=units) if rank < len(names) else ():
        proved = tuple(
            c
            for c in b.determined
            if all(_proved(c, names, p, r) for (_, p), r in zip(generic, residues, strict=True))
        )
        blocks.append(FlatBlock(b.names, b.missing, proved, b.direction))
    return StructuralIdentifiability(graph.name, names, rank, True, float("inf"), tuple(blocks))


def _units(graph: BondGraph, names: Sequence[str]) -> list[str]:
    known = graph.parameters
    return [known[n].unit for n in names]


def _proved(
    c: Combination, names: Sequence[str], point: Mapping[str, int], null: NDArray[np.object_]
) -> bool:
    """Whether a combination is at right angles to every flat direction, exactly."""
    power = {"product": 0, "sum": 1}.get(c.form, -1)
    for column in null.T:
        total = sum(
            w * int(pow(point[n], power, PRIME)) * int(column[names.index(n)])
            for n, w in zip(c.names, c.weights, strict=True)
        )
        if int(total) % PRIME:
            return False
    return True


def _by_gap(
    graph: BondGraph, names: tuple[str, ...], values: Mapping[str, float] | None, seed: int
) -> StructuralIdentifiability:
    at, nulls, gap = rich_nulls(graph, names, values, seed)
    rank = len(names) - nulls[0].shape[1]
    units = _units(graph, names)
    blocks = flat_blocks(names, at, nulls, units=units) if rank < len(names) else ()
    return StructuralIdentifiability(graph.name, names, rank, False, gap, blocks)
