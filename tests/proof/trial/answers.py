"""What the tool said about one recording: kept as plain data, read in the terms of the score."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from bondgraph.support.errors import UnusableInput
from tests.proof.trial.vocabulary import FAMILIES, FAMILY_OF

Kept = TypeVar("Kept")
SPELLINGS = {
    "exact": "exact",
    "approximate": "exact",
    "kind": "unknown",
    "family": "family",
    "look_alikes": "look_alikes",
    "look_alike": "look_alikes",
    "look-alikes": "look_alikes",
    "look-alike": "look_alikes",
    "ambiguous": "look_alikes",
    "unknown": "unknown",
}
"""Ways in which a finding may say what kind of answer it is."""
EXPLAINED = 0.85
"""Part of the misfit that a set of names had to explain in verdicts that do not say it."""


@dataclass(frozen=True, slots=True)
class Statement:
    """One finding in the terms of the score.

    Attributes
    ----------
    answer : str
        ``exact``, ``family``, ``look_alikes`` or ``unknown``.
    effect : str
        The name, for exact answers.
    family : str
        The family, for exact and family answers.
    names : frozenset of str
        Effects that the finding holds possible: one for exact answers, the set of look-alikes.
    also : frozenset of str
        What an exact answer lists as not excluded.
    element : str
        The place stated first; empty if none was.
    places : frozenset of str
        The place with all that the finding calls indistinguishable from it.
    resolved : bool
        A place was given: one at least and not more than half of the model's ports.
    """

    answer: str
    effect: str
    family: str
    names: frozenset[str]
    also: frozenset[str]
    element: str
    kind: str
    places: frozenset[str]
    resolved: bool
    confidence: float


@dataclass(frozen=True, slots=True)
class Answer:
    """What came of one recording.

    Attributes
    ----------
    verdict : str
        As in the contract; empty after a crash.
    error : str
        Text of what stopped the diagnosis; empty if nothing did.
    nominal_train, nominal_test : float
        Mean square over the floor of the model as it is.
    trials : tuple of mapping
        Every effect that was fitted: effect, family, element, home, train, test, parameters.
    black_box : float
        Held-out mean square over the floor that a black box on the residual reaches.
    sparse : mapping or None
        Effect and element by a sparse regression, where it could be done.
    samples : int
        Training samples times sensors, as the trials counted them.
    """

    id: str
    verdict: str
    statements: tuple[Statement, ...]
    seconds: float
    error: str = ""
    train_rmse: Mapping[str, float] | None = None
    nominal_rmse: Mapping[str, float] | None = None
    repaired_rmse: Mapping[str, float] | None = None
    floor: Mapping[str, float] | None = None
    nominal_train: float = float("nan")
    nominal_test: float = float("nan")
    nominal_parameters: int = 0
    samples: int = 0
    trials: tuple[Mapping[str, Any], ...] = ()
    kinds: Mapping[str, str] | None = None
    black_box: float = float("nan")
    sparse: Mapping[str, Any] | None = None

    @property
    def alarm(self) -> bool:
        """Something was said to be missing."""
        return self.verdict in ("missing_physics", "unknown_physics") or bool(self.statements)


def share_of(verdict: Mapping[str, Any]) -> float:
    """Return the share that a name needs by the limits of a verdict."""
    return float((verdict.get("limits") or {}).get("share", EXPLAINED))


def statement_of(finding: Mapping[str, Any], ports: int, share: float = EXPLAINED) -> Statement:
    """Read a finding of the verdict.

    The kind of answer is taken from the finding where it says so. Otherwise an effect of the
    vocabulary is exact; an unknown one is a set of look-alikes if it lists two effects or more that
    explain as much as a name needs, and a family if it names one. What merely comes closest is no
    statement.

    Parameters
    ----------
    ports : int
        Elements of the model that may hold an effect.
    share : float
        Part of the misfit that a name must explain.
    """
    effect, family = str(finding["effect"]), str(finding.get("family", ""))
    possible = frozenset(str(p["effect"]) for p in finding.get("also_possible", ())) - {"unknown"}
    explained = float(finding.get("share_of_misfit_explained") or 0.0)
    answer = SPELLINGS.get(str(finding.get("answer", "")), "")
    if effect in FAMILIES and effect not in FAMILY_OF:
        answer, family = answer or "family", effect
    if not answer:
        if effect != "unknown":
            answer = "exact"
        elif len(possible) > 1 and explained >= share:
            answer = "look_alikes"
        elif family not in ("", "outside"):
            answer = "family"
        else:
            answer = "unknown"
    names = {"exact": frozenset({effect}), "look_alikes": possible | {effect}}.get(
        answer, frozenset()
    ) - {"unknown"}
    place = finding.get("location", {})
    element = str(place.get("element", ""))
    places = frozenset(map(str, [element, *place.get("indistinguishable_from", ())])) - {""}
    return Statement(
        answer,
        effect if answer == "exact" else "",
        family if answer in ("exact", "family") else "",
        names,
        possible if answer == "exact" else frozenset(),
        element,
        str(place.get("kind", "")),
        places,
        bool(element) and 2 * len(places) <= max(ports, 2),
        float(finding.get("confidence") or 0.0),
    )


def answer_of(content: Mapping[str, Any]) -> Answer:
    """Read the content of an answer's file."""
    verdict = content.get("verdict") or {}
    kinds = content.get("kinds") or {}
    fit = verdict.get("fit") or {}
    nominal, repaired = fit.get("nominal") or {}, fit.get("repaired") or {}
    scored = content.get("nominal") or {}
    return Answer(
        str(content["id"]),
        str(verdict.get("verdict", "")),
        tuple(statement_of(f, len(kinds), share_of(verdict)) for f in verdict.get("findings", ())),
        float(content.get("seconds") or 0.0),
        str(content.get("error") or ""),
        nominal.get("train_rmse"),
        nominal.get("test_rmse"),
        repaired.get("test_rmse"),
        fit.get("noise_floor"),
        _number(scored.get("train")),
        _number(scored.get("test")),
        int(scored.get("parameters") or 0),
        int(scored.get("samples") or 0),
        tuple(content.get("trials") or ()),
        kinds,
        _number((content.get("black_box") or {}).get("test")),
        content.get("sparse"),
    )


def _number(value: Any) -> float:
    return float("nan") if value is None else float(value)


def read_answers(folder: Path) -> dict[str, Answer]:
    """Read every answer of a folder by the id of its recording."""
    return read_each(folder, answer_of)


def read_each(folder: Path, read: Callable[[Mapping[str, Any]], Kept]) -> dict[str, Kept]:
    """Read every file of a folder by the id that stands in it.

    Raises
    ------
    UnusableInput
        A file is damaged.
    """
    found = {}
    for path in sorted(folder.glob("*.json")):
        try:
            content = json.loads(path.read_text(encoding="utf-8"))
            found[str(content["id"])] = read(content)
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            raise UnusableInput(f"{path}: no answer ({error!r}); remove it and run again") from None
    return found
