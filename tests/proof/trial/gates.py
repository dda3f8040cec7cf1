"""The gates of the sealed trial: counted, with 95 % intervals, passed or failed."""

from __future__ import annotations

import math
import statistics
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from tests.proof.trial.matching import Judged, Outcome
from tests.proof.trial.oracles import OracleAnswer, repair_ratio
from tests.proof.trial.rates import Rate, rate

INSIDE = ("single", "form", "look_alike", "double")
"""Cells whose effects the catalogue has."""


@dataclass(frozen=True, slots=True)
class Gate:
    """One demand on the trial.

    Attributes
    ----------
    value : float
        Point estimate; nan where nothing could be counted.
    most : bool
        The value must not exceed the limit; otherwise it must reach it.
    counted : Rate or None
        Where the value is a rate.
    gated : bool
        False for what is printed beside the gates and decides nothing.
    """

    name: str
    value: float
    limit: float
    most: bool
    counted: Rate | None = None
    gated: bool = True

    @property
    def passed(self) -> bool | None:
        """Whether the demand is met; None where there was nothing to count."""
        if math.isnan(self.value):
            return None
        return self.value <= self.limit if self.most else self.value >= self.limit


def at_most(name: str, counted: Rate, limit: float, gated: bool = True) -> Gate:
    """Demand that a rate stays below a limit."""
    return Gate(name, counted.value, limit, True, counted, gated)


def at_least(name: str, counted: Rate, limit: float, gated: bool = True) -> Gate:
    """Demand that a rate reaches a limit."""
    return Gate(name, counted.value, limit, False, counted, gated)


def gates(
    outcomes: Sequence[Outcome], oracles: Mapping[str, OracleAnswer] | None = None
) -> tuple[Gate, ...]:
    """Count all gates; those that need the oracle are empty without it."""
    oracles = oracles or {}
    said = [(o, j) for o in outcomes if not o.truth.empty for j in o.judged]
    return (
        false_alarms(outcomes),
        at_most("wrong place, of the places given", wrong_places(said), 0.03),
        at_most("wrong name, of the names given", wrong_names(said), 0.02),
        at_most("physics outside the catalogue named", outside_named(outcomes), 0.05),
        *distinguished(outcomes, oracles),
        repaired(outcomes, oracles),
        at_most("recordings without an answer", rate(bool(o.answer.error) for o in outcomes), 0.0),
    )


def false_alarms(outcomes: Sequence[Outcome]) -> Gate:
    """Count controls in which something was said to be missing; a crash is none but is printed."""
    controls = [o for o in outcomes if o.truth.empty]
    return at_most("false alarms, of the controls", rate(o.answer.alarm for o in controls), 0.02)


def wrong_places(said: Sequence[tuple[Outcome, Judged]]) -> Rate:
    """Count findings whose place excludes the true one, of those that give a place."""
    return rate(j.place == "wrong" for _, j in said if j.place != "unresolved")


def wrong_names(said: Sequence[tuple[Outcome, Judged]]) -> Rate:
    """Count names, families and sets of names that exclude the truth, of those given."""
    return rate(j.name == "wrong" for o, j in said if j.names and o.truth.cell in INSIDE)


def outside_named(outcomes: Sequence[Outcome]) -> Rate:
    """Count false names and sets of names for physics outside the catalogue."""
    return rate(
        any(j.name == "wrong" and j.statement.names for j in o.judged)
        for o in outcomes
        if o.truth.cell == "outside"
    )


def asked_for(
    outcomes: Sequence[Outcome], oracles: Mapping[str, OracleAnswer], *, separable: bool
) -> list[Outcome]:
    """Return single effects that show, and that the oracle can (or cannot) tell from rivals."""
    return [
        o
        for o in outcomes
        if o.truth.cell in ("single", "look_alike")
        and not o.truth.empty
        and (oracle := oracles.get(o.truth.id)) is not None
        and oracle.detectable
        and oracle.separable == separable
    ]


def sorted_out(outcomes: Sequence[Outcome], oracles: Mapping[str, OracleAnswer]) -> dict[str, int]:
    """Count the recordings with one effect by what the oracle says of them."""
    counts = {"no oracle": 0, "below 3 dB": 0, "not separable": 0, "distinguishable": 0}
    for o in outcomes:
        if o.truth.empty or o.truth.cell not in ("single", "look_alike"):
            continue
        oracle = oracles.get(o.truth.id)
        if oracle is None or math.isnan(oracle.z) or math.isnan(oracle.excess):
            counts["no oracle"] += 1
        elif not oracle.detectable:
            counts["below 3 dB"] += 1
        else:
            counts["distinguishable" if oracle.separable else "not separable"] += 1
    return counts


def distinguished(
    outcomes: Sequence[Outcome], oracles: Mapping[str, OracleAnswer]
) -> tuple[Gate, ...]:
    """Count right places and names where they can be asked for, look-alikes where not."""
    clear = asked_for(outcomes, oracles, separable=True)
    alike = asked_for(outcomes, oracles, separable=False)
    return (
        at_least("distinguishable: right class of ports and right name",
                 rate(o.right for o in clear), 0.95),
        at_least("distinguishable: right class of ports",
                 rate(o.place == "right" for o in clear), 0.95),
        at_least("distinguishable: right name", rate(o.name == "right" for o in clear), 0.95),
        at_least("not separable even for the oracle: the truth or a set that holds it",
                 rate(o.name in ("right", "look_alikes") for o in alike), 0.95, gated=False),
        at_most("not separable even for the oracle: a wrong name",
                rate(o.name == "wrong" for o in alike), 0.02, gated=False),
    )  # fmt: skip


def repaired(outcomes: Sequence[Outcome], oracles: Mapping[str, OracleAnswer]) -> Gate:
    """Return the median over distinguishable effects of the held-out error over the oracle's."""
    ratios = [
        repair_ratio(o.answer, oracles[o.truth.id])
        for o in asked_for(outcomes, oracles, separable=True)
    ]
    ratios = [r for r in ratios if not math.isnan(r)]
    value = statistics.median(ratios) if ratios else float("nan")
    return Gate("median held-out error after the repair over the oracle's", value, 1.10, True)
