"""Values that a fit carries absurdly far from what is declared, told in one sentence."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from bondgraph.graph.elements import Parameter
from identification.diagnosis.screening.mixups import moved
from tests.spring import spring

DECLARED = spring().parameters


def fitted(**factors: float) -> Any:
    declared = {**DECLARED, "c_d": Parameter("c_d", 1.0, unit="N")}
    estimates = [
        SimpleNamespace(name=n, value=declared[n].value * f, unit=declared[n].unit)
        for n, f in factors.items()
    ]
    data = SimpleNamespace(commands={"F": None}, names=("x",))
    return SimpleNamespace(estimates=estimates, problem=SimpleNamespace(data=data))


def test_one_value_far_off_is_told_with_its_numbers() -> None:
    (said,) = moved(fitted(m=1e3, d=1.1, k=0.9), DECLARED)
    assert said.startswith("m is declared as")


def test_several_values_far_off_tell_of_a_unit_and_name_the_channels() -> None:
    (said,) = moved(fitted(m=1e3, d=1e3, k=1e-3), DECLARED)
    assert said.startswith("check the units of F, x first: 3 parameters")
    assert "m 1e+03, d 1e+03, k 0.001" in said


def test_values_near_what_is_declared_are_no_word_worth() -> None:
    assert moved(fitted(m=1.3, d=5.0, k=0.7), DECLARED) == ()


def test_what_a_law_is_sized_by_was_declared_by_nobody() -> None:
    assert moved(fitted(m=1.3, c_d=1e6), DECLARED) == ()
