"""What is missed by more than noise, and no better than by a constant, tells nothing."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from identification.diagnosis.evidence.answer import Decision
from identification.diagnosis.evidence.conclusion import kind_of, unforetold

SWING = 2.0


def left(x: float, v: float, floor: float = 0.5) -> Any:
    """A fit that misses the held-out samples of two readings, which swing by 2, by so much."""
    data = SimpleNamespace(
        readings=SWING * np.array([[1.0, -1.0], [-1.0, 1.0]]), floor=np.array([floor, floor])
    )
    return SimpleNamespace(
        problem=SimpleNamespace(data=data), rmse=lambda part: {"x": x, "v": v},
        chi2=lambda part: 1.0,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("missed", "floor", "told"),
    [
        ((2.5, 2.1), 0.5, "insufficient_data"),
        ((2.5, 1.9), 0.5, "explained"),
        ((2.5, 2.1), 2.0, "explained"),  # nothing but noise to foretell
        ((25.0, 2.1), 0.5, "explained"),  # that is no noise, and other rules tell it
    ],
)
def test_a_model_that_foretells_nothing_is_not_called_right(
    missed: tuple[float, float], floor: float, told: str
) -> None:
    fit = left(*missed, floor)
    quiet = Decision("explained", None, (), (), 0.0, 0.0, ())
    assert kind_of((quiet,), fit, fit) == told
    assert bool(unforetold(fit)) == (told == "insufficient_data")
    alarm = Decision("unknown_physics", None, (), (), 0.0, 0.0, ())
    assert kind_of((alarm,), fit, fit) == "unknown_physics"
