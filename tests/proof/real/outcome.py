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

__all__ = ["Outcome", "counts", "read_outcome", "table"]

FILE = "outcome.json"


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

    def text(self) -> str:
        """Return the outcome as JSON."""
        return json.dumps(asdict(self), indent=2, allow_nan=False) + "\n"


def documented(case: RealCase) -> str:
    """Documented effects of a case in a few words."""
    words = ", ".join(dict.fromkeys(t.effect for t in case.truth))
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
        "case", "seen", "documented", "place", "name", "verdict", "held-out before", "after",
        "noise floor", "best published", "s", "judged",
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
    lines = []
    for label in dict.fromkeys(o.label for o in found):
        names = [o.outcome for o in found if o.label == label]
        each = ", ".join(f"{names.count(n)} {n}" for n in dict.fromkeys(names))
        lines.append(f"{len(names)} {label}: {each}")
    return "; ".join(lines) + "." if lines else "nothing was run."


def _row(o: Outcome) -> tuple[str, ...]:
    judged = f"{o.outcome} ({o.note})" if o.note else o.outcome
    cells = (
        o.case, o.label, o.documented, o.place, o.said, o.verdict,
        _values(o.before, o.units), _values(o.after, o.units), _values(o.floor, o.units),
        o.published, f"{o.seconds:.0f}" if o.seconds else "", judged,
    )  # fmt: skip
    return tuple(c.replace("|", "/") or "-" for c in cells)


def _values(values: Mapping[str, float], units: Mapping[str, Any]) -> str:
    alone = len(values) == 1
    return "; ".join(
        f"{'' if alone else f'{n} '}{v:.3g} {units.get(n, '')}".rstrip() for n, v in values.items()
    )
