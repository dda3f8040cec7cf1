"""How many plays and dead zones: as many as pay on samples that the fit has not seen."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any, final

from bondgraph.hysteresis.errors import BadInput
from bondgraph.hysteresis.fitting.al_janaideh import fit_al_janaideh
from bondgraph.hysteresis.fitting.ang import fit_ang
from bondgraph.hysteresis.fitting.loop_records import LoopRecords
from bondgraph.hysteresis.fitting.numbered import NumberedFit

WORTHWHILE = 0.02
"""A larger operator has to lower the held-out error by this share."""
COUNTS = (4, 6, 8, 10, 12, 14, 16)
ZONES = (0, 1, 2)


@final
@dataclass(frozen=True, slots=True)
class TriedOperator:
    """Kind and counts of an operator, how many numbers it has, rms seen and held out."""

    kind: str
    plays: int
    zones: int
    numbers: int
    rms: float
    held_out: float


@final
@dataclass(frozen=True, slots=True, eq=False)
class OperatorChoice:
    """The operator whose held-out error is the least, or nearly so with fewer numbers.

    Attributes
    ----------
    fit : NumberedFit
        Of all samples; `held_out` is of the fit that had not seen them.
    tried : tuple of TriedOperator
    """

    fit: NumberedFit[Any]
    tried: tuple[TriedOperator, ...]

    def best(self, kind: str) -> TriedOperator:
        """Return what would be chosen within a kind."""
        return _chosen([t for t in self.tried if t.kind == kind])


def choose_operator(
    records: LoopRecords,
    kinds: Sequence[str] = ("al_janaideh", "ang"),
    *,
    counts: Iterable[int] = COUNTS,
    zones: Iterable[int] = ZONES,
) -> OperatorChoice:
    """Fit operators of several sizes and choose one by its error on held-out samples.

    Parameters
    ----------
    records : LoopRecords
        The last record, or the last third of a single one, is held out.
    kinds : sequence of {"al_janaideh", "ang"}
    counts, zones : iterable of int
        J, and m of Ang's operator.

    Raises
    ------
    BadInput
        If none can be fitted.
    """
    train, test = records.split()
    seen, unseen = train.thinned(3000), test.thinned()
    tried: list[TriedOperator] = []

    def attempt(kind: str, n: int, m: int) -> None:
        try:
            fit = _fit(kind, n, m)(seen)
        except BadInput:
            return
        held = unseen.misfit(fit.operator)
        tried.append(TriedOperator(kind, n, m, len(fit.numbers), fit.rms, held))

    numbers, bends = tuple(counts), tuple(zones)
    for kind in kinds:
        for n in numbers:
            for m in (m for m in bends if m < 2) if kind == "ang" else (0,):
                attempt(kind, n, m)
    plain = [t for t in tried if t.kind == "ang"]
    for m in (m for m in bends if m >= 2):
        # several bends have many valleys: tried with the number of plays that is best without
        for n in {_chosen(plain).plays} if plain else numbers:
            if "ang" in kinds:
                attempt("ang", n, m)
    if not tried:
        raise BadInput("no operator that can be inverted follows these records; look at them first")
    best = _chosen(tried)
    final = _fit(best.kind, best.plays, best.zones)(records.thinned(20_000))
    return OperatorChoice(replace(final, held_out=best.held_out), tuple(tried))


def _fit(kind: str, plays: int, zones: int) -> Callable[[LoopRecords], NumberedFit[Any]]:
    if kind == "ang":
        return lambda records: fit_ang(records, plays, zones)
    return lambda records: fit_al_janaideh(records, plays)


def _chosen(tried: Sequence[TriedOperator]) -> TriedOperator:
    least = min(t.held_out for t in tried)
    return min(
        (t for t in tried if t.held_out <= (1.0 + WORTHWHILE) * least),
        key=lambda t: (t.numbers, t.held_out),
    )
