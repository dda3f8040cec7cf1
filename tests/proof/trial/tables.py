"""Tables of the score: confusion of names and places, power against strength, cells, pairs."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from tests.proof.trial.answers import Statement
from tests.proof.trial.matching import Outcome
from tests.proof.trial.oracles import OracleAnswer
from tests.proof.trial.rates import Rate, rate

NOTHING = "(nothing)"


@dataclass(frozen=True)
class Confusion:
    """How often each truth (row) got each answer (column).

    Attributes
    ----------
    counts : dict
        By row, then column.
    right : dict of str to Rate
        Right answers of each row, with their interval.
    """

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


def name_confusion(outcomes: Sequence[Outcome]) -> Confusion:
    """Names given for controls and single effects; recordings with two are counted elsewhere."""
    entries = []
    for o in outcomes:
        if o.truth.cell == "double":
            continue
        row = o.truth.effects[0].effect if o.truth.effects else NOTHING
        if o.truth.cell in ("outside", "form"):
            row = f"{row} ({o.truth.cell})"
        first = o.judged[0].statement if o.judged else None
        entries.append((row, _column(first, o), o.name in ("right", "quiet")))
    return _confusion(entries)


def _column(said: Statement | None, o: Outcome) -> str:
    if said is None:
        return "(crash)" if o.answer.error else "unknown" if o.answer.alarm else NOTHING
    return {
        "exact": said.effect,
        "family": f"family {said.family}",
        "look_alikes": "look-alikes",
    }.get(said.answer, "unknown")


def place_confusion(outcomes: Sequence[Outcome]) -> dict[str, Confusion]:
    """Places given, by plant: the true element, or the element stated first."""
    found: dict[str, list[tuple[str, str, bool]]] = {}
    for o in outcomes:
        if o.truth.empty or o.truth.cell == "double":
            continue
        true = o.truth.effects[0].element
        first = o.judged[0] if o.judged else None
        if first is None or not first.statement.element:
            column = NOTHING if not o.answer.alarm else "(unresolved)"
        elif first.place == "unresolved":
            column = "(unresolved)"
        else:
            # a class that holds the true element counts as the true element
            column = true if first.place == "right" else first.statement.element
        found.setdefault(o.truth.plant, []).append((true, column, o.place == "right"))
    return {plant: _confusion(rows) for plant, rows in sorted(found.items())}


def cells(outcomes: Sequence[Outcome]) -> dict[str, Counter[str]]:
    """How the recordings of each cell ended, by the name of the outcome."""
    found: dict[str, Counter[str]] = {}
    for o in outcomes:
        if o.truth.cell == "double":
            wrong = any(j.name == "wrong" for j in o.judged)
            end = f"{o.found} of 2 found" + (", a wrong name" if wrong else "")
        else:
            end = o.name
        found.setdefault(o.truth.cell, Counter())[end] += 1
    return found


@dataclass(frozen=True, slots=True)
class Power:
    """Detection and naming in one range of strength, dB of excess over the floor."""

    low: float
    high: float
    detected: Rate
    named: Rate
    wrong: Rate


def power(
    outcomes: Sequence[Outcome],
    oracles: Mapping[str, OracleAnswer] | None = None,
    width: float = 5.0,
) -> tuple[Power, ...]:
    """Power against strength, for single effects of the catalogue.

    Strength is what the nominal model leaves after its fit, as the oracle measured it; where there
    is no oracle, what the generator aimed at.
    """
    bins: dict[int, list[Outcome]] = {}
    for o in outcomes:
        if o.truth.empty or o.truth.cell not in ("single", "look_alike"):
            continue
        oracle = (oracles or {}).get(o.truth.id)
        excess = oracle.excess if oracle and math.isfinite(oracle.excess) else o.truth.strength
        if math.isfinite(excess):
            # one bin holds all that is below the noise, one all that is plain
            at = min(max(excess, -2 * width), 6 * width + width / 2)
            bins.setdefault(math.floor(at / width), []).append(o)
    return tuple(
        Power(
            b * width,
            (b + 1) * width,
            rate(o.answer.alarm for o in group),
            rate(o.right for o in group),
            rate(o.name == "wrong" for o in group),
        )
        for b, group in sorted(bins.items())
    )


@dataclass(frozen=True, slots=True)
class Pair:
    """How the members of a look-alike pair fared under one kind of excitation."""

    name: str
    decisive: bool
    outcomes: Mapping[str, int]


def pairs(outcomes: Sequence[Outcome]) -> tuple[Pair, ...]:
    """Outcomes of every look-alike pair, decisive and indecisive excitation apart."""
    found: dict[tuple[str, bool], Counter[str]] = {}
    for o in outcomes:
        if o.truth.cell == "look_alike":
            found.setdefault((o.truth.pair, o.truth.decisive), Counter())[o.name] += 1
    return tuple(Pair(name, decisive, c) for (name, decisive), c in sorted(found.items()))
