"""A trial that was published, read from its folder: the seal checked, where its errors lie.

``python -m tests.proof.trial.opened [tests/proof/trial/trials/trial_2]``; also of a draw of
development once it was run, which has no seal to check.
"""

from __future__ import annotations

import gzip
import json
import sys
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from operator import attrgetter
from pathlib import Path

from bondgraph.support.errors import UnusableInput
from hardware.simulators.judging.claims import exam_answer_of
from hardware.simulators.judging.outcome import ExamOutcome, JudgedClaim, judge_exam
from hardware.simulators.judging.truths import truth_of
from tests.proof.exam.said import read_exam_answers
from tests.proof.exam.truths import read_exam_truths
from tests.proof.trial.commitment import truths_hash
from tests.proof.trial.layout import Layout
from tests.proof.trial.rates import Rate
from tests.proof.trial.running import require_own

PUBLISHED = Path(__file__).parent / "trials" / "trial_2"
LATER_PLANTS = ("table", "speaker")
"""Plants that development never draws, see `DESIGN.md`."""


def opened(folder: Path) -> tuple[ExamOutcome, ...]:
    """Return every recording's outcome.

    Raises
    ------
    UnusableInput
        The truths are not those that were committed.
    """
    draw = Layout(folder)
    if draw.answers.is_dir():
        require_own(draw, draw.answers)
        found = read_exam_answers(draw.answers)
        known = read_exam_truths(draw.truths)
        return tuple(judge_exam(known[name], answer) for name, answer in found.items())
    with gzip.open(folder / "truths.json.gz", "rt", encoding="utf-8") as file:
        rows = json.load(file)
    committed = json.loads((folder / "commitment.json").read_text(encoding="utf-8"))
    salt = (folder / "salt.txt").read_text(encoding="utf-8").strip()
    if truths_hash(salt, rows) != committed["truths_sha256"]:
        raise UnusableInput(f"{folder}: these are not the truths that were committed")
    truths = {t.id: t for t in map(truth_of, rows)}
    with gzip.open(folder / "answers.jsonl.gz", "rt", encoding="utf-8") as file:
        answers = [exam_answer_of(json.loads(line)) for line in file]
    return tuple(judge_exam(truths[a.id], a) for a in answers)


def lines(outcomes: Sequence[ExamOutcome]) -> Iterator[str]:
    """Say how many names and places were wrong, and of what."""
    name, place = attrgetter("name"), attrgetter("place")

    def of_catalogue(some: Sequence[ExamOutcome]) -> list[ExamOutcome]:
        return [o for o in some if not o.truth.outside or o.truth.mixed_up]

    something = [o for o in outcomes if not o.truth.empty]
    inside = [o for o in something if not o.truth.outside]
    named = of_catalogue(something)
    outside = [o for o in something if o.truth.outside]
    later = [o for o in something if o.truth.plant in LATER_PLANTS]
    known = [o for o in something if o.truth.plant not in LATER_PLANTS]

    empty = [o for o in outcomes if o.truth.empty]
    yield f"false alarms: {Rate(sum(o.false_alarm for o in empty), len(empty))}"
    yield f"wrong names: {_wrong(named, name)}"
    yield f"  of first findings: {_wrong(named, name, slice(0, 1))}"
    yield f"  of later findings: {_wrong(named, name, slice(1, None))}"
    yield f"  on plants that development draws too: {_wrong(of_catalogue(known), name)}"
    yield f"  on plants that it never draws: {_wrong(of_catalogue(later), name)}"
    for word in ("exact", "approximate"):
        yield f"  given as {word}: {_wrong(named, partial(_given_as, word))}"
    yield f"wrong places: {_wrong(something, place)}"
    yield f"  of physics outside the catalogue: {_wrong(outside, place)}"
    yield f"  of all other: {_wrong(inside, place)}"
    yield f"  on plants that development draws too: {_wrong(known, place)}"
    yield f"  on plants that it never draws: {_wrong(later, place)}"
    yield "called explained though an effect shows, with the misfit that is left over the noise:"
    yield from (f"  {o.id} {o.truth.words}: {o.left:.2g}" for o in something if o.effect_explained)


def _given_as(word: str, claim: JudgedClaim) -> bool | None:
    return claim.name if claim.claim.answer == word else None


def _wrong(
    outcomes: Sequence[ExamOutcome],
    of: Callable[[JudgedClaim], bool | None],
    which: slice = slice(None),
) -> str:
    judged = [of(c) for o in outcomes for c in o.claims[which] if of(c) is not None]
    return str(Rate(sum(j is False for j in judged), len(judged)))


if __name__ == "__main__":
    print(*lines(opened(Path(sys.argv[1]) if len(sys.argv) > 1 else PUBLISHED)), sep="\n")
