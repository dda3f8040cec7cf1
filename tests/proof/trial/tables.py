"""Tables of the score: names and places that were mixed up, power against strength."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

from hardware.simulators.judging.outcome import ExamOutcome, JudgedClaim
from tests.proof.exam.counting import sorted_out
from tests.proof.trial.rates import Rate, rate

NOTHING = "(nothing)"
OUTSIDE = "(outside)"
OPEN = "(open)"

STRENGTHS = (0.0, 1.0, 3.0, 10.0, 30.0, 100.0, float("inf"))
"""Edges of what an effect moves the readings by, over their noise (rms)."""


@dataclass(frozen=True)
class Confusion:
    """How often each truth (row) got each answer (column), and how often that was right."""

    rows: tuple[str, ...]
    columns: tuple[str, ...]
    counts: Mapping[str, Mapping[str, int]]
    right: Mapping[str, Rate]


def _confusion(entries: Sequence[tuple[str, str, bool]]) -> Confusion:
    counts: dict[str, Counter[str]] = {}
    for row, column, _ in entries:
        counts.setdefault(row, Counter())[column] += 1
    rows = tuple(sorted(counts))
    columns = tuple(sorted({c for _, c, _ in entries}, key=lambda c: (c not in rows, c)))
    right = {r: rate(ok for row, _, ok in entries if row == r) for r in rows}
    return Confusion(rows, columns, counts, right)


def name_confusion(outcomes: Sequence[ExamOutcome]) -> Confusion:
    """Return what was said of each effect; recordings with several are counted elsewhere.

    Any name that the truth accepts stands in the column of the effect's own.
    """
    entries = []
    for o in outcomes:
        main = o.truth.main
        if main is not None and not (o.truth.single or o.truth.outside):
            continue
        row = NOTHING if main is None else main.effect if main.names else OUTSIDE
        said = _telling(o)
        right = o.outcome == "quiet" if main is None else said is not None and said.exactly
        entries.append((row, row if right else _column(o, said), right))
    return _confusion(entries)


def _telling(o: ExamOutcome) -> JudgedClaim | None:
    """Return the finding that a recording is remembered for: a wrong one, else the right name."""
    order = [c for c in o.claims if c.name is False] or [c for c in o.claims if c.exactly]
    return next(iter([*order, *o.claims]), None)


def _column(o: ExamOutcome, said: JudgedClaim | None) -> str:
    if said is None:
        if o.answer.alarm:
            return "(unknown)"
        return NOTHING if o.answer.reassuring else f"({o.answer.verdict or 'crash'})"
    if said.claim.answer in ("exact", "approximate"):
        return said.claim.effect
    return f"({said.claim.answer}{', wrong' if said.name is False or said.kind is False else ''})"


def place_confusion(outcomes: Sequence[ExamOutcome]) -> dict[str, Confusion]:
    """Return where each effect was said to be, by plant; a class that holds it is its place."""
    found: dict[str, list[tuple[str, str, bool]]] = {}
    for o in outcomes:
        main = o.truth.main
        if main is None or not (o.truth.single or o.truth.outside):
            continue
        row = "/".join(sorted(main.places))
        told = sorted((c for c in o.claims if c.place is not None), key=lambda c: bool(c.place))
        column = OPEN if o.answer.alarm else NOTHING
        if told:
            column = row if told[0].place else "/".join(sorted(told[0].claim.places))
        found.setdefault(o.truth.plant, []).append((row, column, column == row))
    return {plant: _confusion(rows) for plant, rows in sorted(found.items())}


@dataclass(frozen=True, slots=True)
class Power:
    """What was said of single effects that move the readings by so many times their noise.

    Attributes
    ----------
    told : Rate
        Something was said to be missing.
    placed : Rate
        Right place with the right name or kind.
    named : Rate
        Right name at the right place.
    wrong : Rate
        A wrong name.
    """

    low: float
    high: float
    told: Rate
    placed: Rate
    named: Rate
    wrong: Rate


def power(outcomes: Sequence[ExamOutcome]) -> dict[str, tuple[Power, ...]]:
    """Return the share found against strength: of all single effects, then of each cell."""
    single = [o for o in outcomes if o.truth.single]
    cells = sorted({o.truth.cell for o in single})
    groups = {"all": single, **{c: [o for o in single if o.truth.cell == c] for c in cells}}
    return {name: _powers(group) for name, group in groups.items()}


def _powers(group: Sequence[ExamOutcome]) -> tuple[Power, ...]:
    found = []
    for low, high in pairwise(STRENGTHS):
        inside = [o for o in group if o.truth.main and low <= o.truth.main.moved < high]
        if inside:
            found.append(
                Power(
                    low,
                    high,
                    rate(o.answer.alarm for o in inside),
                    rate(map(sorted_out, inside)),
                    rate(o.truth.main in o.found for o in inside),
                    rate(any(c.name is False for c in o.claims) for o in inside),
                )
            )
    return tuple(found)
