"""Practical identifiability after a fit, in five classes with numbers.

A fit that ends on a flat valley picks some point of it and still reports success; these classes say
so. *Dead*: the readings hardly change with the parameter. *Flat direction*: several parameters may
move together unseen; the combination that is determined is given. *Trade-off pair*: two estimates
whose errors are correlated beyond 0.95. *Not pinned*: the 95 % interval is wider than a limit.
*At bound*: the estimate was stopped, with what the misfit would gain beyond the bound.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import log

import numpy as np

from bondgraph.support.arrays import FloatArray
from identification.uncertainty.combinations import FlatBlock, flat_blocks, null_space
from identification.uncertainty.information import Information, Sensitivities, information
from identification.uncertainty.statements import (
    Statement,
    bound_words,
    dead_words,
    flat_words,
    is_loose,
    not_pinned_words,
    trade_offs,
)

DEAD = 2.0
"""Total change of all readings, in noise, for ten times (or one scale more) of a parameter."""
CORRELATED = 0.95
FACTOR, SHARE = 1.5, 0.5
"""Widest 95 % interval of a pinned parameter: a factor either way, or half of it in its scale."""


@dataclass(frozen=True, eq=False)
class Practical:
    """What a fit determined.

    Attributes
    ----------
    information : Information
        Of the parameters that are neither dead nor at a bound.
    statements : tuple of Statement
    flat : tuple of FlatBlock
    pinned : tuple of str
        Parameters with a useful interval of their own.
    """

    information: Information
    statements: tuple[Statement, ...]
    flat: tuple[FlatBlock, ...]
    pinned: tuple[str, ...]

    def of(self, kind: str) -> tuple[Statement, ...]:
        """Return statements of one kind."""
        return tuple(s for s in self.statements if s.kind == kind)

    def __str__(self) -> str:
        """One line a statement."""
        head = f"determined one by one: {', '.join(self.pinned) or 'none'}"
        return "\n".join([head, *map(str, self.statements)])


def practical(
    sensitivities: Sensitivities,
    residual: FloatArray | None = None,
    *,
    bounds: Mapping[str, tuple[float, float]] | None = None,
    further: Sequence[Sensitivities] = (),
    prior: FloatArray | None = None,
    channels: Sequence[int] = (),
    variance: float = 1.0,
    dead: float = DEAD,
    readings: Sequence[int] = (),
) -> Practical:
    """Sort parameters into the classes.

    Parameters
    ----------
    sensitivities : Sensitivities
        At the fitted values; nuisances already eliminated.
    residual : ndarray, shape (M,), optional
        Weighted residuals, measured less simulated: sandwich covariance, and gain beyond bounds.
    bounds : mapping of str to (float, float), optional
        SI; a value within 1e-6 of a bound (relative) is at it.
    further : sequence of Sensitivities, optional
        At other values of the same parameters. A flat combination must hold there too; without
        them round values may let a sum look like a product.
    prior, channels, variance, readings
        As in `information`.
    dead : float
        Below this total change a parameter is dead.
    """
    stopped = _at_bounds(sensitivities, bounds or {})
    size = sensitivities.strength * np.where(sensitivities.log, log(10.0), 1.0) / np.sqrt(variance)
    known = prior if prior is not None else np.zeros(size.size)
    idle = [n for i, n in enumerate(sensitivities.names) if size[i] < dead and not known[i]]
    kept = [n for n in sensitivities.names if n not in idle and n not in stopped]
    part = _restricted(sensitivities, kept)
    at = [sensitivities.names.index(n) for n in kept]
    info = information(
        part, residual, prior=known[at], channels=channels, variance=variance, readings=readings
    )
    blocks = _flat(part, [_restricted(s, kept) for s in further], known[at])
    statements = [dead_words(n, sensitivities, float(size[sensitivities.index(n)])) for n in idle]
    statements += [flat_words(b, info, part) for b in blocks]
    tied = {n for b in blocks for n in b.names}
    statements += trade_offs(info, part, CORRELATED, tied)
    free = [n for n in kept if n not in tied]
    loose = [n for n in free if is_loose(info, part, n, FACTOR, SHARE)]
    statements += [not_pinned_words(n, info, part) for n in loose]
    for n, side in stopped.items():
        if n not in idle:
            made = bound_words(n, side, sensitivities, residual, bounds or {}, stopped)
            statements.append(made)
    pinned = tuple(n for n in kept if n not in tied and n not in loose)
    return Practical(info, tuple(statements), tuple(blocks), pinned)


def _restricted(s: Sensitivities, names: Sequence[str]) -> Sensitivities:
    at = [s.index(n) for n in names]
    return replace(
        s,
        names=tuple(names),
        values=s.values[at],
        jacobian=s.jacobian[:, at],
        log=tuple(s.log[i] for i in at),
        scale=s.scale[at],
        units=tuple(s.units[i] for i in at),
    )


def _at_bounds(s: Sensitivities, bounds: Mapping[str, tuple[float, float]]) -> dict[str, str]:
    found = {}
    for i, n in enumerate(s.names):
        low, high = bounds.get(n, (-np.inf, np.inf))
        near = 1e-6 * (abs(s.values[i]) if s.log[i] else s.scale[i])
        if s.values[i] - low <= near:
            found[n] = "lower"
        elif high - s.values[i] <= near:
            found[n] = "upper"
    return found


def _flat(
    part: Sensitivities, further: Sequence[Sensitivities], prior: FloatArray
) -> tuple[FlatBlock, ...]:
    """Return flat blocks in relative changes; what a prior holds is not flat."""
    points = [part, *further]
    nulls = []
    for s in points:
        rows = np.vstack([s.jacobian, np.diag(np.sqrt(prior))]) if prior.any() else s.jacobian
        relative = np.where(s.values == 0, 1.0, s.values)
        nulls.append(null_space(rows) * (s.slopes / relative)[:, None])
    if not part.names or not nulls[0].shape[1]:
        return ()
    return flat_blocks(part.names, [s.values for s in points], nulls, units=part.units)
