"""What came of one real recording, as plain data, and the table of all."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from bondgraph.support.errors import UnusableInput
from identification.report.tables import markdown
from tests.proof.real.case import RealCase
from tests.proof.real.judging import NOTHING, REASSURING

__all__ = ["Outcome", "counts", "documented", "read_outcome", "table"]

FILE = "outcome.json"
REASSURED = 3.0
"""Held-out error in noise floors beyond which nobody may be told that nothing is missing."""
COUNTED = (
    ("right", "right name"), ("right kind", "right kind"),
    ("set of the kind", "look-alikes of the right kind"), ("family", "family"),
    ("look-alike set", "other look-alikes"), ("unknown", "unknown"), ("rightly nothing", ""),
    ("no finding", "no finding"), ("wrong name", "wrong name"), ("wrong place", "wrong place"),
    ("failed", "failed"), ("absent", ""),
)  # fmt: skip
"""Outcomes in the order of the summary, and their words there; those without show if they came."""
ANSWERED = ("right", "family", "right kind", "set of the kind")
"""Outcomes that say what is missing, and where."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """One line of the table.

    Parameters
    ----------
    case, label : str
        Name, and whether the recording was seen before.
    outcome, said, place, note : str
        As `tests.proof.real.judging.Judgement`.
    verdict : str
        Kind of the verdict; empty if there is none.
    before, after, floor : mapping of str to float
        Held-out error (root mean square) of the nominal and of the repaired model, and the noise
        floor, SI, by sensor; `after` is empty where nothing was named.
    units : mapping of str to str
        SI unit of each sensor.
    documented : str
        The physics that the owners of the data document.
    published : str
        Best published value; empty if there is none.
    seconds : float
        Time of the diagnosis.
    samples : int
        Samples of the recording as it was diagnosed.
    split, comment, failure : str
        Rule of the split; what a reader must know; what stopped the diagnosis, if anything.
    kind : str
        Kinds of physics of all findings that tell one, in their order.
    official : mapping of str to mapping of str to float
        Free-run error of the repaired model on the official tests, by test and sensor, SI.
    """

    case: str
    label: str
    outcome: str
    said: str = ""
    place: str = ""
    note: str = ""
    verdict: str = ""
    before: Mapping[str, float] = field(default_factory=dict)
    after: Mapping[str, float] = field(default_factory=dict)
    floor: Mapping[str, float] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    documented: str = ""
    published: str = ""
    seconds: float = 0.0
    samples: int = 0
    split: str = ""
    comment: str = ""
    failure: str = ""
    kind: str = ""
    official: Mapping[str, Mapping[str, float]] = field(default_factory=dict)

    @property
    def counted(self) -> str:
        """Outcome in the summary: to be silent about a control is right, but names nothing."""
        silent = self.outcome == "right" and self.said == NOTHING
        return "rightly nothing" if silent else self.outcome

    @property
    def false_reassurance(self) -> bool:
        """Nothing is said to be missing while a held-out reading errs by several noise floors."""
        errors = {**self.before, **self.after}
        return self.verdict in REASSURING and any(
            error > REASSURED * self.floor[name]
            for name, error in errors.items()
            if name in self.floor
        )

    def text(self) -> str:
        """Return the outcome as JSON."""
        return json.dumps(asdict(self), indent=2, allow_nan=False) + "\n"


def documented(case: RealCase) -> str:
    """Documented effects of a case, and the kinds that are right too, in a few words."""
    words = ", ".join(dict.fromkeys(t.effect for t in case.truth))
    words += f" (kind: {' or '.join(case.kinds)})"
    return f"{words}, or nothing" if case.control else words


def read_outcome(folder: Path) -> Outcome | None:
    """Return the outcome that lies in the folder of a case; None if it was not finished.

    Raises
    ------
    UnusableInput
        The file is damaged.
    """
    path = folder / FILE
    if not path.is_file():
        return None
    try:
        return Outcome(**json.loads(path.read_text(encoding="utf-8")))
    except (TypeError, ValueError) as error:
        raise UnusableInput(
            f"{path}: not an outcome ({error}); remove the folder to run this case again"
        ) from None


def table(found: Sequence[Outcome]) -> str:
    """Return all outcomes as a Markdown table, the failures with what stopped them."""
    head = (
        "case", "seen", "documented", "verdict", "kind", "name", "place",
        "held-out before", "after", "noise floor", "official tests", "best published",
        "s", "judged",
    )  # fmt: skip
    lines = [markdown(head, [_row(o) for o in found]), "", counts(found)]
    failed = [o for o in found if o.failure]
    if failed:
        lines += ["", "Not finished:", "", *(f"- {o.case}: {o.failure}" for o in failed)]
    remarks = [o for o in found if o.comment]
    if remarks:
        lines += ["", "Remarks:", "", *(f"- {o.case}: {o.comment}" for o in remarks)]
    return "\n".join(lines) + "\n"


def counts(found: Sequence[Outcome]) -> str:
    """Return how often each outcome came, unseen recordings apart from those seen before."""
    labels = dict.fromkeys(o.label for o in found)
    lines = [_counted(label, [o for o in found if o.label == label]) for label in labels]
    return "\n\n".join(lines) or "nothing was run."


def _counted(label: str, found: Sequence[Outcome]) -> str:
    words = []
    for outcome, word in COUNTED:
        these = [o for o in found if o.counted == outcome]
        lulled = sum(o.false_reassurance for o in these)
        told = (
            f" ({lulled} of these false reassurance)" if outcome == "no finding" or lulled else ""
        )
        if word or these:
            words.append(f"{len(these)} {word or outcome}{told}")
    run = [o for o in found if o.outcome != "absent"]
    answered = sum(o.counted in ANSWERED and bool(o.place) for o in run)
    return (
        f"{len(found)} {label}: {', '.join(words)}. Answered (right name, family, or kind at the "
        f"right place): {answered} of {len(run)}."
    )


def _row(o: Outcome) -> tuple[str, ...]:
    judged = f"{o.outcome} ({o.note})" if o.note else o.outcome
    official = "; ".join(f"{test} {_values(e, o.units)}" for test, e in o.official.items())
    cells = (
        o.case, o.label, o.documented, o.verdict, o.kind, o.said, o.place,
        _values(o.before, o.units), _values(o.after, o.units), _values(o.floor, o.units),
        official, o.published, f"{o.seconds:.0f}" if o.seconds else "", judged,
    )  # fmt: skip
    return tuple(c.replace("|", "/") or "-" for c in cells)


def _values(values: Mapping[str, float], units: Mapping[str, Any]) -> str:
    alone = len(values) == 1
    return "; ".join(
        f"{'' if alone else f'{n} '}{v:.3g} {units.get(n, '')}".rstrip() for n, v in values.items()
    )
