"""When laws are fitted once more from declared values."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from identification.diagnosis.screening.carried import bent
from tests.spring import spring


def fitted(at_bound: bool = False, **factors: float) -> Any:
    declared = spring().parameters
    estimates = [
        SimpleNamespace(name=n, value=declared[n].value * f, at_bound=at_bound)
        for n, f in factors.items()
    ]
    return SimpleNamespace(estimates=estimates, problem=SimpleNamespace(graph=spring()))


@pytest.mark.parametrize("factor", [3.1, 0.3])
def test_a_value_carried_threefold_is_doing_the_work_of_something_else(factor: float) -> None:
    assert bent(fitted(m=1.1, k=factor))


def test_so_is_one_at_its_bound_and_nothing_nearer() -> None:
    assert bent(fitted(at_bound=True, m=1.2))
    assert not bent(fitted(m=2.9, k=0.35))
