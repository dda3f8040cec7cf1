"""Whose unit would explain that a fit carries values absurdly far from what is declared.

A channel in another unit is made up for by all parameters alike: with a current in kA every
impedance is a thousand times too large. How they would do so follows from the fit itself, as the
change of the values that takes back a small change of that channel, or of the time.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from bondgraph.graph.parameter import Parameter
from bondgraph.signals.files.time_base import TIME
from bondgraph.support.arrays import Array
from identification.estimation.single_record import Fit
from identification.estimation.threads import calm
from identification.report.words import listed
from identification.study.data import Data
from identification.study.residual import evaluate, slots

STEP = 1e-5
"""Relative change of a channel."""
LEFT = 0.3
"""Part of the change of a channel that the values may leave."""
OFF = 3.0
"""Factor by which declared values may be off beside a unit."""
LEAST = 5.0
"""Factor of a channel that is worth a word."""
SHARE = 0.4
"""Part of the farthest value that may remain unexplained (in logarithms)."""
CLOCKS, ROUND, NEAR = (1e3, 1e6), (60.0, 3600.0), 1.3
"""What times are off by, milli and micro, or minutes and hours where they are that near."""
STAY = 2.0
"""Factor within which values that stay tell of no unit."""


def plainly(many: float, digits: int) -> str:
    """Few digits, without an exponent where that is short."""
    text = f"{many:.{digits}g}"
    return f"{float(text):.0f}" if "e" in text and many < 1e6 else text


@dataclass(frozen=True)
class Suspect:
    """A channel, or the time, that would make up for all values alike.

    Attributes
    ----------
    channels : tuple of str
        Those of one unit, or ``time``.
    factor : float
        How many times too large it would be.
    miss : float
        How far it leaves the farthest value off, logarithmic.
    moves : int
        Values that it moves.
    """

    channels: tuple[str, ...]
    factor: float
    miss: float
    moves: int

    def __str__(self) -> str:
        """Say it in a few words."""
        many, size = max(self.factor, 1 / self.factor), "large" if self.factor > 1 else "small"
        if self.channels == (TIME,):
            near = [c for c in ROUND if 1 / NEAR < many / c < NEAR]
            many = min(near or CLOCKS, key=lambda c: abs(np.log(many / c)))
        return f"{listed(self.channels)} (about {plainly(many, 1)} times too {size})"


def suspects(fit: Fit, declared: Mapping[str, Parameter]) -> tuple[Suspect, ...]:
    """Return what alone would have carried the fitted values where they are, the likeliest first.

    Parameters
    ----------
    fit : Fit
    declared : mapping of str to Parameter
        Parameters before any fit.
    """
    problem = fit.problem
    known = [i for i, f in enumerate(problem.free) if f.log and f.parameter.name in declared]
    names = [problem.free[i].parameter.name for i in known]
    moved = np.log([fit.values[n] / declared[n].value for n in names])
    found: list[Suspect] = []
    if not names or np.abs(moved).max() < np.log(STAY):
        return ()
    with calm():
        now = evaluate(problem, fit.point)
        columns = _columns(now.jacobian, now.local)
        size = np.linalg.norm(columns, axis=0)
        if not np.isfinite(size).all():
            return ()
        size[size == 0] = np.inf
        at = slots(problem).free.start + np.array(known, int)
        for channels, data in _changed(problem.data):
            there = evaluate(replace(problem, data=data), fit.point, derivatives=False)
            change = (there.residual - now.residual) / STEP
            if not np.isfinite(change).all() or not change.any():
                continue
            powers, *_ = np.linalg.lstsq(columns / size, change, rcond=1e-7)
            left = change - columns / size @ powers
            if np.linalg.norm(left) < LEFT * np.linalg.norm(change):
                found += _explained(channels, (powers / size)[at], moved)
    least = max(np.log(2.0), min((s.miss for s in found), default=0.0))
    return tuple(sorted((s for s in found if s.miss <= least), key=lambda s: s.miss))


def _columns(jacobian: Array, local: list[tuple[slice, Array]]) -> Array:
    """Return derivatives by all unknowns, initial states of every window included."""
    starts = np.zeros((jacobian.shape[0], sum(m.shape[1] for _, m in local)))
    done = 0
    for rows, m in local:
        starts[rows, done : done + m.shape[1]] = m
        done += m.shape[1]
    return np.hstack([jacobian, starts])


def sharing_a_unit(data: Data) -> tuple[tuple[str, ...], ...]:
    """Return the readings that were read in the same unit, where several were."""
    groups: dict[str, list[str]] = {}
    for n in data.names:
        groups.setdefault(data.read_in.get(n, ""), []).append(n)
    return tuple(tuple(g) for unit, g in groups.items() if unit and len(g) > 1)


def _changed(data: Data) -> Iterator[tuple[tuple[str, ...], Data]]:
    """Yield the recording with one channel, readings of one unit, or the time a little larger."""
    more = 1.0 + STEP
    for group in (*((n,) for n in data.names), *sharing_a_unit(data)):
        readings = data.readings.copy()
        readings[:, [data.names.index(n) for n in group]] *= more
        yield group, replace(data, readings=readings)
    for name, u in data.commands.items():
        if np.ptp(u) > 0:
            finer = tuple(
                (n, {**values, name: more * values[name]} if name in values else values)
                for n, values in data.finer
            )
            yield (name,), replace(data, commands={**data.commands, name: more * u}, finer=finer)
    yield (TIME,), replace(data, time=more * data.time)


def _explained(channels: tuple[str, ...], powers: Array, moved: Array) -> list[Suspect]:
    """Return the channel if one factor of it explains how far the values have moved."""
    if not powers.any():
        return []
    many = float(powers @ moved / (powers @ powers))
    miss = float(np.abs(moved - many * powers).max())
    if abs(many) < np.log(LEAST) or miss > max(np.log(OFF), SHARE * np.abs(moved).max()):
        return []
    return [Suspect(channels, float(np.exp(many)), miss, int(np.sum(np.abs(powers) > 0.5)))]
