"""The numbers of an exam that must be watched together."""

from __future__ import annotations

import statistics
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from hardware.simulators.generator.families import FAMILIES
from hardware.simulators.judging.claims import ExamAnswer
from hardware.simulators.judging.outcome import ExamOutcome, judge_exam
from hardware.simulators.judging.truths import ExamTruth
from tests.proof.exam.separable import kind_separable, name_separable, no_law_fits
from tests.proof.trial.calibration import Reliability, reliability
from tests.proof.trial.rates import Rate, rate

LEFT = 1.0
"""A declared model leaves a misfit if more than this many times the noise remains beside it."""

_BINS = (0.0, 0.5, 0.7, 0.8, 0.9, 0.95, 0.99, 1.0)


@dataclass(frozen=True, eq=False)
class ExamScore:
    """What was counted over the recordings that have an answer.

    Attributes
    ----------
    rates : mapping
        Every rate by what it counts, in the order of the table.
    seconds : mapping
        Median and 95th percentile, on the clock and of the processor.
    cells : mapping
        Counts of outcomes for each cell.
    """

    outcomes: tuple[ExamOutcome, ...]
    rates: Mapping[str, Rate]
    seconds: Mapping[str, float]
    cells: Mapping[str, Counter[str]]
    reliability: tuple[Reliability, ...]


def score_exam(
    truths: Mapping[str, ExamTruth],
    answers: Mapping[str, ExamAnswer],
    again: Mapping[str, Mapping[str, ExamAnswer]] | None = None,
) -> ExamScore:
    """Count the answers that are there.

    Parameters
    ----------
    again : mapping, optional
        Answers to the same recordings in another guise (half of them, transplants), by a word for
        the guise: they should agree with `answers`, whatever the truth is.
    """
    outcomes = tuple(judge_exam(truths[i], answers[i]) for i in sorted(answers) if i in truths)
    cells: dict[str, Counter[str]] = {}
    for o in outcomes:
        cells.setdefault(o.truth.cell, Counter())[o.outcome] += 1
    return ExamScore(
        outcomes,
        {
            **_errors(outcomes),
            **_sets(outcomes),
            **_several(outcomes),
            **{k: v for word, a in (again or {}).items() for k, v in _again(outcomes, a, word)},
        },
        _seconds(outcomes),
        cells,
        reliability(stated(outcomes), _BINS),
    )


def _errors(outcomes: Sequence[ExamOutcome]) -> dict[str, Rate]:
    controls = [o for o in outcomes if o.truth.empty]
    concealing = [o for o in outcomes if not o.truth.empty]
    reassured = [o for o in outcomes if o.answer.reassuring]
    said = [(o, c) for o in concealing for c in o.claims]
    # channels that were exchanged have no name: whatever is named there is wrong
    inside = [c for o, c in said if not o.truth.outside or o.truth.mixed_up]
    outside = [o for o in concealing if o.truth.outside and not o.truth.mixed_up]
    return {
        "false alarms, of the controls": rate(o.false_alarm for o in controls),
        "insufficient data, of the controls": rate(
            o.answer.verdict == "insufficient_data" for o in controls
        ),
        "misfit above 3 times the noise, of those called explained": rate(
            o.misfit_explained for o in reassured
        ),
        "called explained, of those where an effect shows": rate(
            o.effect_explained for o in concealing if o.truth.shows
        ),
        "wrong names, of the names given": rate(
            c.name is False for c in inside if c.name is not None
        ),
        "wrong exact names, of those given": rate(
            c.name is False for c in inside if c.claim.answer == "exact"
        ),
        "wrong approximate names, of those given": rate(
            c.name is False for c in inside if c.claim.answer == "approximate"
        ),
        "wrong places, of the places given": rate(
            c.place is False for _, c in said if c.place is not None
        ),
        "wrong kinds, of the kinds given": rate(
            c.kind is False for _, c in said if c.kind is not None
        ),
        "outside the catalogue named exactly": rate(o.outside_named for o in outside),
        "outside named exactly, where an oracle excludes every law": rate(
            o.outside_named for o in outside if no_law_fits(o.truth, o.answer.first)
        ),
        "outside the catalogue given any name or set": rate(
            any(c.claim.names for c in o.claims) for o in outside
        ),
        "mistakes in the recording, told as such": rate(
            o.answer.mistake for o in outcomes if o.truth.mixed_up
        ),
        "mistakes told where the recording has none": rate(
            o.answer.mistake for o in outcomes if not o.truth.mixed_up
        ),
        "crashes": rate(bool(o.answer.error) or not o.answer.verdict for o in outcomes),
    }


def _sets(outcomes: Sequence[ExamOutcome]) -> dict[str, Rate]:
    """Count where one main effect with a name shows."""
    shown = [o for o in outcomes if o.truth.single and o.truth.main and o.truth.main.shows]
    told = [o for o in shown if o.answer.alarm]
    # where fitted parameters take up what the effect moved, there is nothing left to be named
    left = [o for o in shown if o.left > LEFT]
    by_name = [o for o in shown if name_separable(o.truth, o.answer.first)]
    by_kind = [o for o in shown if kind_separable(o.truth, o.answer.first)]
    return {
        "sharp: right name at the right place": rate(o.truth.main in o.found for o in shown),
        "sharp: right place, and right name or kind": rate(map(sorted_out, shown)),
        "sharp: right place, and a name, set, family or kind that holds": rate(
            any(
                here and (c.name is True or c.kind is True)
                for here, c in zip(_place_of_main(o), o.claims, strict=True)
            )
            for o in shown
        ),
        "sharp: right place": rate(any(_place_of_main(o)) for o in shown),
        "sharp where the declared model leaves a misfit: right name and place": rate(
            o.truth.main in o.found for o in left
        ),
        "sharp where the declared model leaves a misfit: right place": rate(
            any(_place_of_main(o)) for o in left
        ),
        "sharp where an oracle separates names: right name and place": rate(
            o.truth.main in o.found for o in by_name
        ),
        "sharp where an oracle separates kinds: right place, and right name or kind": rate(
            map(sorted_out, by_kind)
        ),
        "said to miss something": rate(o.answer.alarm for o in shown),
        "truth in the set of names, of those told": rate(map(_name_held, told)),
        "truth in the set of places, of those told": rate(map(_place_held, told)),
        "truth not excluded, names": rate(map(_name_open, told)),
        "truth not excluded, places": rate(map(_place_open, told)),
    }


def _place_of_main(o: ExamOutcome) -> list[bool]:
    return [c.place is True and o.truth.main in c.about for c in o.claims]


def sorted_out(o: ExamOutcome) -> bool:
    """Whether the main effect got its place with its name or its kind."""
    return any(
        here and (c.exactly or c.kind is True)
        for here, c in zip(_place_of_main(o), o.claims, strict=True)
    )


def _name_held(o: ExamOutcome) -> bool:
    main = o.truth.main
    assert main is not None
    held = set[str]()
    for j in o.claims:
        held |= j.claim.names | j.claim.also
        if j.claim.answer == "family":
            held |= set(FAMILIES.get(j.claim.family, ()))
    return bool(main.names & held)


def _place_held(o: ExamOutcome) -> bool:
    main = o.truth.main
    assert main is not None
    return any(main.places & (j.claim.places | j.claim.also_places) for j in o.claims)


def _name_open(o: ExamOutcome) -> bool:
    """Whether the answer holds the name or leaves it open: a kind its own names, unknown all."""
    told = [c for c in o.claims if c.claim.answer != "unknown"]
    return (
        not told
        or any(c.claim.answer == "kind" and c.kind is True for c in told)
        or (_name_held(o))
    )


def _place_open(o: ExamOutcome) -> bool:
    """Whether the answer leaves the place open or holds it."""
    return not any(c.claim.resolved for c in o.claims) or _place_held(o)


def _several(outcomes: Sequence[ExamOutcome]) -> dict[str, Rate]:
    several = [
        o
        for o in outcomes
        if o.truth.cell in ("two", "three") and all(e.shows for e in o.truth.effects)
    ]
    return {
        "several effects that all show: all found": rate(
            o.found >= set(o.truth.effects) for o in several
        ),
        "several effects that all show: strongest found": rate(
            o.truth.main in o.found for o in several
        ),
        "several effects that all show: any found": rate(bool(o.found) for o in several),
    }


def _again(
    outcomes: Sequence[ExamOutcome], again: Mapping[str, ExamAnswer], word: str
) -> Iterator[tuple[str, Rate]]:
    """Count where a recording and its other guise are answered otherwise; needs no truth."""
    pairs = [(o.answer, again[o.id]) for o in outcomes if o.id in again]
    yield f"{word}: alarm on one side only", rate(a.alarm != b.alarm for a, b in pairs)
    for what, said in (("names", _names), ("places", _places)):
        both = [(said(a), said(b)) for a, b in pairs]
        yield (
            f"{word}: {what} that exclude each other",
            rate(not a & b for a, b in both if a and b),
        )
    yield f"{word}: the same verdict, names and places", rate(_same(a, b) for a, b in pairs)
    # where nothing was told there is no repair either, so nothing to agree with
    told = [(a, b) for a, b in pairs if not a.alarm or any(c.resolved for c in a.claims)]
    yield f"{word}: the same, where the first told something", rate(_same(a, b) for a, b in told)


def _same(a: ExamAnswer, b: ExamAnswer) -> bool:
    return (a.alarm, _names(a), _places(a)) == (b.alarm, _names(b), _places(b))


def _names(a: ExamAnswer) -> frozenset[str]:
    return frozenset(n for c in a.claims for n in c.names)


def _places(a: ExamAnswer) -> frozenset[str]:
    return frozenset(p for c in a.claims if c.resolved for p in c.places)


def _seconds(outcomes: Sequence[ExamOutcome]) -> dict[str, float]:
    found = {}
    for word, values in (
        ("seconds", [o.answer.seconds for o in outcomes]),
        ("processor seconds", [o.answer.cpu for o in outcomes]),
    ):
        known = sorted(v for v in values if v == v)
        found[f"{word}, median"] = statistics.median(known) if known else float("nan")
        last = max(0, -(-95 * len(known) // 100) - 1)
        found[f"{word}, 95th percentile"] = known[last] if known else float("nan")
    return found


def stated(outcomes: Sequence[ExamOutcome]) -> list[tuple[float, bool]]:
    """Return the probability of every name that states one, and whether it was right.

    That is asked as by `certifying.right_lines`, from which the probability is read: a right name
    at a wrong place is wrong. On controls every name is wrong.
    """
    return [
        (c.claim.probability, c.holds)
        for o in outcomes
        for c in o.claims
        if c.claim.probability is not None and c.claim.answer in ("exact", "approximate")
    ]
