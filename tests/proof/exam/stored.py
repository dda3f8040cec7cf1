"""Evidence of decisions as plain numbers: other knobs can be tried without a new diagnosis."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any
from unittest.mock import patch

import numpy as np

from bondgraph.support.arrays import Array
from identification.diagnosis.catalogue.effect import Insertion
from identification.diagnosis.diagnose import Diagnosis, diagnose, on_finer_stretches
from identification.diagnosis.evidence.answer import Decision
from identification.diagnosis.evidence.block_score import BlockScore
from identification.diagnosis.evidence.decision import decide
from identification.diagnosis.evidence.hypotheses import Evidence, Scored, Thresholds
from identification.diagnosis.evidence.kind_score import KindScore
from identification.diagnosis.evidence.leave_out import stretch_sums
from identification.diagnosis.evidence.remaining import Remaining
from identification.diagnosis.search import one_step
from identification.diagnosis.search.forward_selection import SelectionStage, steps


@dataclass(frozen=True, eq=False)
class StoredScore:
    """A score whose comparisons with the others of its decision are known.

    Attributes
    ----------
    place : int
        Row and column of the tables.
    noise : ndarray, shape (n_y,)
        Standard deviation of each reading's prediction error, over the floor.
    aparts, pairs, excesses : ndarray, shape (n, n)
        What the methods say of row and column.
    foretold : float
        Share of what is left that its own past foretells; zero of answers that do not hold it.
    besides : tuple of float
        Of the first: standard errors by which it lags beside noise with a memory.
    out : namespace
        What is left of each of several recordings, one row each; nothing of a single one.
    """

    place: int
    loss: float
    noise: Array
    aparts: Array
    pairs: Array
    excesses: Array
    out: Any = None
    foretold: float = 0.0
    besides: tuple[float, ...] = ()

    @property
    def square(self) -> float:
        """Return the mean square of the prediction errors over the floor."""
        return float(np.mean(self.noise**2))

    def behind(self, better: StoredScore) -> float:
        """Return the stored standard errors."""
        if self.loss < better.loss:
            return -better.behind(self)
        return max(float(self.aparts[self.place, better.place]), self.paired(better), key=abs)

    def paired(self, better: StoredScore) -> float:
        """Return the stored standard errors by which stretches agree."""
        return float(self.pairs[self.place, better.place])

    def beside_colour(self, better: StoredScore) -> float:
        """Return the stored lag beside noise with a memory; without bounds where none is stored."""
        return self.besides[better.place] if self.besides else np.inf

    def excess(self, best: StoredScore) -> float:
        """Return the stored mean square beyond that of `best`."""
        return float(self.excesses[self.place, best.place])


@contextmanager
def recorded() -> Iterator[list[dict[str, Any]]]:
    """Collect the evidence of every decision of the last diagnosis made meanwhile, in order.

    Of a decision that was made again with more laws the last evidence is kept. That of a further
    search on finer stretches comes after that of the first one, if what it found is what is told.
    """
    found: list[dict[str, Any]] = []
    seen: list[Any] = []
    floors: dict[str, float] = {}

    def begun(*arguments: Any) -> SelectionStage:
        found.clear()
        data = arguments[0].fit.problem.data
        floors.update(zip(data.names, map(float, data.floor), strict=True))
        return steps(*arguments)

    def further(*arguments: Any) -> tuple[Diagnosis | None, bool]:
        first, known = found[:], dict(floors)
        result, stopped = on_finer_stretches(*arguments)
        found[:] = first if result is None else [*first, *found]
        floors.update(known)
        return result, stopped

    def noted(evidence: Evidence, limits: Thresholds | None = None) -> Decision:
        if found and seen and evidence.plain is seen[-1]:
            found.pop()
        seen.append(evidence.plain)
        found.append(stored(evidence) | {"floors": dict(floors)})
        return decide(evidence, limits)

    with (
        patch(f"{one_step.__name__}.decide", noted),
        patch(f"{diagnose.__module__}.steps", begun),
        patch(f"{diagnose.__module__}.on_finer_stretches", further),
    ):
        yield found


def stored(e: Evidence) -> dict[str, Any]:
    """Return evidence as values that JSON can hold."""
    scores = [e.plain, *(s.score for s in e.laws), *(k.score for k in e.kinds)]
    n = len(scores)
    apart, paired = np.zeros((2, n, n))
    for i, worse in enumerate(scores):
        for j, better in enumerate(scores):
            if worse is not better and worse.loss >= better.loss:
                both = worse.sound and better.sound
                apart[i, j] = worse.apart(better) if both else worse.behind(better)
                paired[i, j] = worse.paired(better) if both else apart[i, j]
    quiet = scores if e.before.is_noise(Thresholds().noise) else ()
    classes = e.classes
    elements = sorted({s.element for s in e.laws} | {k.element for k in e.kinds})
    return {
        "apart": [[_number(v) for v in row] for row in apart],
        "paired": [[_number(v) for v in row] for row in paired],
        "noise": [[_number(v) for v in s.noise] for s in scores],
        "loss": [_number(s.loss) for s in scores],
        "foretold": [_number(s.foretold) for s in quiet],
        "beside": [_number(e.plain.beside_colour(s)) for s in quiet],
        "stretches": [_stretches(s) for s in scores[: 1 + len(e.laws)]],
        "laws": [_law(s) for s in e.laws],
        "kinds": [[k.element, k.kind] for k in e.kinds],
        "before": _left(e.before),
        "nominal": _number(e.nominal),
        "trained": _number(e.trained),
        "named": list(e.named),
        "untried": [list(x) for x in e.untried],
        "classes": [] if classes is None else [sorted(classes.class_of(x)) for x in elements],
        "elements": elements,
        "located": list(e.located),
        "along": e.along,
        "held": [list(x) for x in e.paired],
        "several": e.several,
        "recordings": _by_recording(e) if e.several and e.laws else [],
    }


def _by_recording(e: Evidence) -> list[list[float]]:
    """Square sums of the prediction errors over the floor, of each recording that trains."""
    starts = e.laws[0].trial.fit.problem.data.starts
    run = np.searchsorted(starts, e.plain.out.rows.sample, side="right")
    trains = np.bincount(run) > 0
    sums = (
        np.bincount(run, np.clip(s.out.residual, -1e100, 1e100) ** 2)
        for s in (e.plain, *(s.score for s in e.laws))
    )
    return [[_number(v) for v in row[trains]] for row in sums]


def _stretches(s: Any) -> list[list[float]]:
    """Mean square of the prediction errors over the floor, by stretch and reading."""
    if not isinstance(s, BlockScore):
        return []
    rows = s.out.rows
    total = stretch_sums(rows, np.clip(s.out.residual, -1e100, 1e100) ** 2, s.channels)
    count = np.maximum(stretch_sums(rows, np.ones(rows.block.size), s.channels), 1)
    return [[_number(v) for v in row] for row in total / count]


def _number(value: float) -> float:
    return float(f"{np.clip(np.nan_to_num(value, nan=1e300), -1e300, 1e300):.5g}")


def _seen(value: float | None) -> float | None:
    return None if value is None or math.isnan(value) else _number(value)


def _left(left: Remaining) -> list[Any]:
    over = {name: _number(v) for name, v in left.over_noise.items()}
    follows, louder = _number(left.follows), _number(left.louder)
    return [over, left.measured, follows, {}, louder, sorted(left.sure)]


def _law(s: Scored) -> dict[str, Any]:
    made = s.trial.insertion
    return {
        "effect": s.trial.effect, "element": s.element, "label": s.trial.label,
        "home": s.trial.home, "itself": s.trial.itself, "misstated": s.trial.misstated,
        "family": made.family, "kind": made.kind,
        "simpler": list(made.simpler), "form": made.form, "train": _number(s.trial.train),
        "test": _number(s.trial.test), "left": _left(s.left), "idle": s.idle,
        "added": _seen(vars(s.trial).get("added")),  # where the decision asked for it
    }  # fmt: skip


def evidence_of(content: Mapping[str, Any]) -> Evidence:
    """Return stored evidence as `decide` takes it."""
    apart, paired = np.array(content["apart"]), np.array(content["paired"])
    noise = np.array(content["noise"])
    with np.errstate(over="ignore"):
        excesses = np.mean((noise[:, None, :] / noise[None, :, :]) ** 2, axis=2) - 1.0
    scores: list[Any] = [
        StoredScore(i, loss, noise[i], apart, paired, excesses)
        for i, loss in enumerate(content["loss"])
    ]
    beside = tuple(content.get("beside", ()))
    scores[0] = replace(scores[0], besides=beside)
    for i, share in enumerate(content.get("foretold", ())):
        scores[i] = replace(scores[i], foretold=share)
    count, each = len(content["laws"]), content.get("recordings") or []
    for i, sums in enumerate(each):
        scores[i] = replace(scores[i], out=_out_of(sums))
    fit = _fit_of(len(each[0])) if each else None
    laws = [_scored(x, s, fit) for x, s in zip(content["laws"], scores[1:], strict=False)]
    kinds = [
        KindScore(element, kind, s, np.zeros(0))
        for (element, kind), s in zip(content["kinds"], scores[count + 1 :], strict=True)
    ]
    known = dict(zip(content["elements"], content["classes"], strict=False))
    classes: Any = SimpleNamespace(class_of=lambda x: known.get(x, [x])) if known else None
    return Evidence(
        scores[0], tuple(laws), tuple(kinds), _remaining(content["before"]), content["nominal"],
        content["trained"], classes, tuple(content["named"]),
        tuple((effect, place) for effect, place in content.get("untried", ())),
        tuple(content.get("located", ())), content.get("along", False),
        tuple((place, kind) for place, kind in content.get("held", ())),
        content.get("several", False),
    )  # fmt: skip


def _out_of(sums: list[float]) -> Any:
    rows = SimpleNamespace(sample=np.arange(len(sums)))
    return SimpleNamespace(rows=rows, residual=np.sqrt(sums))


def _fit_of(recordings: int) -> Any:
    """Return of a fit only where its recordings begin: one row each, as in `_out_of`."""
    data = SimpleNamespace(starts=tuple(range(1, recordings)))
    return SimpleNamespace(problem=SimpleNamespace(data=data))


def _remaining(row: list[Any]) -> Remaining:
    return replace(Remaining(*row[:5]), sure=frozenset(*row[5:]))


def _known(value: float | None) -> float:
    return math.nan if value is None else value


def _scored(law: Mapping[str, Any], score: Any, fit: Any) -> Scored:
    nothing: Any = None
    insertion = Insertion(
        law["effect"], law["family"], "", law["element"], nothing, (), (), tuple(law["simpler"]),
        (), kind=law["kind"], form=law.get("form", False),
    )  # fmt: skip
    trial: Any = SimpleNamespace(
        insertion=insertion, home=law["home"], itself=law.get("itself", True),
        train=law["train"], test=law["test"], label=law["label"], effect=law["effect"],
        element=law["element"], fit=fit, added=_known(law.get("added")),
        misstated=law.get("misstated", False),
    )  # fmt: skip
    return Scored(trial, score, _remaining(law["left"]), law.get("idle", False))
