"""Several fits to the same data, side by side."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import permutations
from typing import Any

import numpy as np

from bondgraph.support.arrays import Array
from bondgraph.support.errors import UnusableInput
from identification.statistics.blocks import paired_z
from identification.statistics.bootstrap import block_length
from identification.statistics.criteria import (
    Criteria,
    LikelihoodRatio,
    ResidualLevel,
    criteria,
    likelihood_ratio,
)
from identification.validation.channel import level_on
from identification.validation.judge import Judgement, judge
from identification.validation.validation_data import ValidationData, ValidationRecord

FEWEST_BLOCKS, MOST_BLOCKS = 10, 40


@dataclass(frozen=True)
class Nested:
    """Test of a fit against one that frees more of the same model."""

    simpler: str
    richer: str
    test: LikelihoodRatio


@dataclass(frozen=True, eq=False)
class Contestant:
    """One fit among several.

    Attributes
    ----------
    judgement : Judgement
    held_out : float
        Mean square over the floor on the held-out samples of all readings (training samples where
        nothing is held out).
    blocks : int
        Blocks of held-out samples on which it was compared with the best.
    criteria : Criteria or None
        Counted with the memory of the fit with the least training misfit.
    behind : float
        Standard errors by which it lies behind the best, block by block; 0 for the best. Negative
        where it is better in most blocks and a few carry its mean square.
    p : float
        Chance of so large a distance between equally good fits.
    """

    name: str
    judgement: Judgement
    held_out: float
    blocks: int
    criteria: Criteria | None
    behind: float
    p: float

    @property
    def words(self) -> str:
        """Where it stands."""
        if self.behind == 0.0:
            return "best on held-out samples"
        if self.p < 0.05 and self.behind < 0:
            return (
                "larger in the mean square, but smaller in most stretches, by "
                f"{-self.behind:.1f} standard errors: look at the few where it fails"
            )
        if self.p < 0.05:
            return f"worse than the best by {self.behind:.1f} standard errors"
        return "not worse than the best beyond chance"


@dataclass(frozen=True, eq=False)
class Comparison:
    """Fits side by side, best held-out error first; prints as text, in notebooks as HTML.

    Attributes
    ----------
    contestants : tuple of Contestant
    nested : tuple of Nested
        Likelihood-ratio tests of fits that free less of the same model.

    Examples
    --------
    >>> poorer = estimate(study.changed(free=("d", "k")))
    >>> [c.name for c in compare({"m d k": fit, "d k": poorer}).contestants]
    ['m d k', 'd k']
    """

    contestants: tuple[Contestant, ...]
    nested: tuple[Nested, ...]

    @property
    def best(self) -> Contestant:
        """Least held-out error."""
        return self.contestants[0]

    def __str__(self) -> str:
        """Return the comparison as text."""
        from identification.validation.compare_tables import text_comparison

        return text_comparison(self)

    def __repr__(self) -> str:
        """Return one line."""
        names = ", ".join(c.name for c in self.contestants)
        return f"Comparison({names}; best {self.best.name!r})"

    def _repr_html_(self) -> str:
        """Return the comparison as HTML for notebooks."""
        from identification.validation.compare_tables import html_comparison

        return html_comparison(self)

    def to_pandas(self) -> Any:
        """Return a DataFrame with one row a fit; needs pandas."""
        from identification.validation.compare_tables import frame

        return frame(self)


def compare(fits: Mapping[str, Any]) -> Comparison:
    """Put fits to the same data side by side.

    Parameters
    ----------
    fits : mapping of str to fit
        Anything that `judge` takes, or a Judgement, by the name to print.

    Raises
    ------
    UnusableInput
        Fewer than two fits, or fits that were not scored on the same samples.

    Examples
    --------
    >>> poorer = estimate(study.changed(free=("d", "k")))
    >>> compare({"m d k": fit, "d k": poorer}).best.name
    'm d k'
    """
    if len(fits) < 2:
        raise UnusableInput(f"{len(fits)} fit is nothing to compare; give two or more by name")
    judged = {n: f if isinstance(f, Judgement) else judge(f) for n, f in fits.items()}
    first, *others = judged
    for n in others:
        _same_data(first, judged[first].material, n, judged[n].material)
    totals = {n: _total(j.material) for n, j in judged.items()}
    leader = min(judged, key=lambda n: totals[n])
    levels = _common_levels(judged)
    memories = _common_memories(levels)
    found = []
    for n, j in judged.items():
        mine, best = _paired_blocks(j.material, judged[leader].material)
        z = 0.0 if n == leader else paired_z(mine, best)
        found.append(
            Contestant(
                n, j, totals[n], mine.size, _criteria(levels[n], j.material, memories), z,
                1.0 if n == leader else _chance(z, mine.size),
            )
        )  # fmt: skip
    found.sort(key=lambda c: (c.name != leader, c.held_out))
    return Comparison(tuple(found), tuple(_nested(judged, levels)))


def _chance(z: float, blocks: int) -> float:
    from scipy.stats import t as student

    return float(2 * student.sf(abs(z), max(blocks - 1, 1))) if np.isfinite(z) else 0.0


def _same_data(name_a: str, a: ValidationData, name_b: str, b: ValidationData) -> None:
    def refuse(why: str) -> UnusableInput:
        return UnusableInput(
            f"{name_a} and {name_b} cannot be compared: {why}; fit both to the same recordings "
            "with the same splits"
        )

    if [r.name for r in a.records] != [r.name for r in b.records]:
        raise refuse(
            f"records {', '.join(r.name for r in a.records)} against "
            f"{', '.join(r.name for r in b.records)}"
        )
    for r, s in zip(a.records, b.records, strict=True):
        why = _difference(r, s)
        if why:
            raise refuse(f"{r.name} {why}")


def _difference(r: ValidationRecord, s: ValidationRecord) -> str:
    if r.sha256 and s.sha256 and r.sha256 != s.sha256:
        return "comes from two different files"
    if r.names != s.names:
        return f"is read as {', '.join(r.names)} and as {', '.join(s.names)}"
    if r.measured.shape != s.measured.shape:
        return f"has {r.measured.shape[0]} samples in one and {s.measured.shape[0]} in the other"
    if not np.array_equal(r.measured, s.measured, equal_nan=True):
        return "holds different measured values"
    if not (np.array_equal(r.test, s.test) and np.array_equal(r.train, s.train)):
        return "is split differently"
    if not np.allclose(r.floor, s.floor, rtol=1e-9, atol=0):
        return "has two different noise floors"
    return ""


def _part(r: ValidationRecord) -> Array:
    return r.part("test" if r.test.any() else "train")


def _squares(r: ValidationRecord) -> Array:
    """Mean square over the floor, all readings of a scored sample; shape (n,)."""
    square = (r.residual[_part(r)] / r.floor) ** 2
    return np.asarray(np.where(np.isfinite(square), square, np.nan))


def _paired_blocks(m: ValidationData, leader: ValidationData) -> tuple[Array, Array]:
    """Mean squares of both on the same blocks: as long as the difference remembers, 10 to 40."""
    mine: list[float] = []
    other: list[float] = []
    for r, s in zip(m.records, leader.records, strict=True):
        a, b = np.nanmean(_squares(r), axis=1), np.nanmean(_squares(s), axis=1)
        if a.size < 8:
            continue
        length = block_length(np.nan_to_num(a - b))
        count = int(min(np.clip(a.size // length, FEWEST_BLOCKS, MOST_BLOCKS), a.size // 4))
        mine += [float(np.nanmean(v)) for v in np.array_split(a, count)]
        other += [float(np.nanmean(v)) for v in np.array_split(b, count)]
    return np.array(mine), np.array(other)


def _total(m: ValidationData) -> float:
    values = np.concatenate([_squares(r).ravel() for r in m.records])
    return float(np.nanmean(values)) if np.isfinite(values).any() else float("inf")


def _levels(j: Judgement) -> list[ResidualLevel] | None:
    trained = [c for c in j.channels if c.train.n]  # recordings that are only judged have no level
    known = [c.level for c in trained if c.level is not None and c.level.mean_square > 0]
    return known if known and len(known) == len(trained) else None


def _common_levels(judged: Mapping[str, Judgement]) -> dict[str, list[ResidualLevel] | None]:
    """Return the levels of all fits on the samples that all of them score.

    Noise models of unlike order begin at different samples.
    """
    levels = {n: _levels(j) for n, j in judged.items()}
    if len({tuple(x.n for x in v) for v in levels.values() if v is not None}) < 2:
        return levels
    every = [j.material.records for j in judged.values()]
    shared = [
        [
            np.logical_and.reduce([r.train & np.isfinite(r.innovations(c)) for r in same])
            for c in range(len(same[0].names))
        ]
        for same in zip(*every, strict=True)
        if same[0].train.any()
    ]
    found: dict[str, list[ResidualLevel] | None] = {}
    for name, j in judged.items():
        trained = [r for r in j.material.records if r.train.any()]
        pairs = [
            (r, c, rows)
            for r, own in zip(trained, shared, strict=True)
            for c, rows in enumerate(own)
        ]
        own = [level_on(r, c, rows) for r, c, rows in pairs]
        known = [v for v in own if v is not None and v.mean_square > 0]
        found[name] = known if levels[name] is not None and len(known) == len(own) else None
    return found


def _common_memories(levels: Mapping[str, list[ResidualLevel] | None]) -> list[float] | None:
    known = [v for v in levels.values() if v is not None]
    if not known:
        return None
    nearest = min(known, key=lambda v: sum(x.n * float(np.log(x.mean_square)) for x in v))
    return [x.memory for x in nearest]


def _criteria(
    levels: list[ResidualLevel] | None, m: ValidationData, memories: list[float] | None
) -> Criteria | None:
    if levels is None or memories is None:
        return None
    return criteria(levels, m.n_free, memories)


def _same_held(simple: Judgement, rich: Judgement) -> bool:
    """Whether what the richer fit holds has the same value in the simpler one."""
    a, b = simple.estimation, rich.estimation
    if a is None or b is None:
        return True
    held = [n for n in b.values if n not in b.study.free_names]
    return all(np.isclose(a.values.get(n, np.nan), b.values[n], rtol=1e-9, atol=0) for n in held)


def _nested(
    judged: Mapping[str, Judgement], levels: Mapping[str, list[ResidualLevel] | None]
) -> list[Nested]:
    """Test every fit against those of the same model that free more."""
    found = []
    for a, b in permutations(judged, 2):
        simple, rich = judged[a].material, judged[b].material
        names = ({n.name for n in m.numbers + m.nuisances} for m in (simple, rich))
        fewer, more = names
        low, high = levels[a], levels[b]
        if simple.model != rich.model or not fewer < more or low is None or high is None:
            continue
        if not _same_held(judged[a], judged[b]):
            continue
        if rich.n_free > simple.n_free:
            test = likelihood_ratio(low, high, rich.n_free - simple.n_free)
            found.append(Nested(a, b, test))
    return found
