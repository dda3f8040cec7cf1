"""The steps in which a reading counts are no error of it, within the noise that they make."""

from __future__ import annotations

import numpy as np
import pytest

from bondgraph.signals.split import interleaved
from identification.diagnosis.evidence.answer import Decision
from identification.diagnosis.evidence.remaining import Remaining
from identification.diagnosis.search.own_steps import without_own_steps
from identification.study.data import Data

STEP = 5e-6
FLOOR = STEP / np.sqrt(12.0)


def data(floor: float = FLOOR, step: float = STEP) -> Data:
    t = np.asarray(1e-3 * np.arange(600), np.float64)
    x = np.round(3e-4 * np.sin(7.0 * t) / step) * step
    return Data(
        "run", t, {"F": t}, x[:, None], ("x",), np.array([floor]), interleaved(0, t.size)
    )  # fmt: skip


def told(answer: str = "kind", physics: str = "sensing", place: str = "x") -> Decision:
    return Decision(
        "unknown_physics", None, (), (), 0.4, 0.8, ("a form does better",), answer=answer,
        physics=physics, places=(place,),
    )  # fmt: skip


def judged(decision: Decision, given: Data, left: float = 0.99) -> Decision:
    return without_own_steps(decision, Remaining({"x": left}, True, 0.0), given, 1.5, {"x": "m"})


def test_what_is_left_within_the_steps_of_a_reading_is_nothing_missing() -> None:
    made = judged(told(), data())
    assert (made.kind, made.places, made.physics) == ("explained", (), "")
    assert made.reasons == (
        "the reading x counts in steps of 5 µm: what is left of it is within what they make",
    )


@pytest.mark.parametrize(
    ("decision", "given", "left"),
    [
        (told(), data(), 1.6),  # more than noise is left
        (told(), data(floor=2 * FLOOR), 0.99),  # other noise is larger than what steps make
        (told(physics="restoring"), data(), 0.99),
        (told(answer="look_alikes"), data(), 0.99),
        (told(place="k"), data(), 0.99),
    ],
)
def test_all_else_stays(decision: Decision, given: Data, left: float) -> None:
    assert judged(decision, given, left) is decision
