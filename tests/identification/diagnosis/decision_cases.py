"""Hand-made scores to decide upon.

Every hypothesis predicts all but the noise and a misfit of its own, given in units of the noise;
misfits of different hypotheses have nothing in common. One that lies `z` standard errors behind a
perfect one has the misfit ``lag(z)``.
"""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np

from bondgraph.signals.recording import Split
from identification.diagnosis.catalogue import by_name
from identification.diagnosis.catalogue.effect import Insertion
from identification.diagnosis.evidence.answer import Decision
from identification.diagnosis.evidence.block_score import BlockScore
from identification.diagnosis.evidence.decision import decide
from identification.diagnosis.evidence.hypotheses import Evidence, Hypothesis, Scored, Thresholds
from identification.diagnosis.evidence.kind_score import KindScore
from identification.diagnosis.evidence.leave_out import LeftOut, Rows
from identification.diagnosis.evidence.remaining import Remaining, remaining
from identification.diagnosis.search.candidates import Candidate
from identification.study.data import Data

N, BLOCKS = 4000, 40
ROWS = Rows(np.arange(N), np.zeros(N, int), np.arange(N) * BLOCKS // N)
BASIS = np.linalg.qr(np.random.default_rng(0).standard_normal((N, 24)))[0] * np.sqrt(N)
NOISE = BASIS[:, 0]
QUIET = Remaining({"x": 1.02}, True, 0.0)
LOUD = Remaining({"x": 5.0}, True, 0.0)


def lag(z: float) -> float:
    """Misfit of a hypothesis that lies `z` standard errors behind one without any."""
    return 2.0 * z / float(np.sqrt(N))


ONCE = np.where(ROWS.block == 17, np.sqrt(BLOCKS), 0.0)
"""Puts a misfit into one stretch."""


def scored(misfit: float, direction: int, where: np.ndarray | float = 1.0) -> BlockScore:
    residual = NOISE + misfit * where * BASIS[:, direction]
    return BlockScore(LeftOut(ROWS, residual, residual, np.zeros(BLOCKS)))


def times(score: BlockScore, scale: float) -> BlockScore:
    """The same score over a floor that was read too low."""
    out = score.out
    return BlockScore(replace(out, residual=scale * out.residual, fitted=scale * out.fitted))


def left_by(misfit: float) -> Any:
    """What a decision reads of a fit: the misfit that it leaves on held-out samples."""
    moved = np.sin(np.arange(N) / 7.0)[:, None]
    noise = (NOISE + misfit * BASIS[:, 23])[:, None]
    split = Split(slice(0, N // 2), slice(N // 2, N), "first half")
    data = Data(
        "run", np.arange(float(N)), {}, moved + noise, ("x",), np.ones(1), split,
        floor_measured=True,
    )  # fmt: skip
    return SimpleNamespace(
        values={"s": 1.0}, problem=SimpleNamespace(data=data, gains=()), simulated=moved,
        residuals=lambda part: noise[N // 2 :],
    )  # fmt: skip


def trial(
    label: str,
    misfit: float,
    test: float,
    *,
    home: bool = True,
    most: float = np.inf,
    added: float = np.inf,
) -> Candidate:
    effect, element = label.split(" at ")
    e = by_name(effect)
    nothing: Any = None  # the decision does not look at graphs
    insertion = Insertion(
        effect, e.family, e.law, element, nothing, ({},), ("s",), e.simpler, e.confused_with,
        e.sentence, e.kind, (("s", 0.0, most),), plain=e.plain,
    )  # fmt: skip
    made = Candidate(insertion, home, left_by(misfit), 1 + misfit**2, test, np.full(BLOCKS, test))
    vars(made)["added"] = added  # else it would be fitted to both parts
    return made


class Case:
    """A record that the plain model misses by `plain`, and what was tried on it."""

    def __init__(
        self, plain: float, before: Remaining = LOUD, where: np.ndarray | float = 1.0, **more: Any
    ) -> None:
        self.plain, self.before, self.where, self.more = plain, before, where, more
        self.laws: list[Scored] = []
        self.kinds: list[KindScore] = []
        self.used = 1

    def _direction(self) -> int:
        self.used += 1
        return self.used

    def law(self, label: str, misfit: float, *, test: float = 0.0, **more: Any) -> Case:
        made = trial(label, misfit, test or 1 + misfit**2, **more)
        self.laws.append(
            Scored(made, scored(misfit, self._direction(), self.where), remaining(made.fit))
        )
        return self

    def kind(self, kind: str, element: str, misfit: float) -> Case:
        score = scored(misfit, self._direction(), self.where)
        self.kinds.append(KindScore(element, kind, score, np.zeros(3)))
        return self

    def decided(self, limits: Thresholds | None = None) -> Decision:
        return decide(self.evidence(), limits)

    def evidence(self) -> Evidence:
        square = 1 + self.plain**2

        def by_loss(h: Hypothesis) -> float:
            return h.score.loss

        return Evidence(
            scored(self.plain, 1, self.where), tuple(sorted(self.laws, key=by_loss)),
            tuple(sorted(self.kinds, key=by_loss)), self.before, square, square, **self.more,
        )  # fmt: skip


def label(d: Decision) -> str:
    return "" if d.chosen is None else d.chosen.label


def named(d: Decision) -> list[str]:
    """Return everything that the answer names at all."""
    return [t.effect for t in d.possible]
