"""A further name that only holds with impossible values is taken back; the first one stays."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest

from identification.diagnosis.evidence.answer import Decision
from identification.diagnosis.search.within_reason import within_reason
from tests.spring import spring

GRAPH = spring()
DECLARED = GRAPH.parameters


def named(effect: str, element: str, **ratios: float) -> Decision:
    """Return a decision whose fit ended at so many times what is declared."""
    estimates = [
        SimpleNamespace(name=n, value=p.value * ratios.get(n, 1.1), unit=p.unit)
        for n, p in DECLARED.items()
    ]
    fit = SimpleNamespace(estimates=estimates, problem=SimpleNamespace(graph=GRAPH))
    chosen: Any = SimpleNamespace(label=f"{effect} at {element}", element=element, fit=fit)
    return Decision(
        "missing_physics", chosen, (), (), 0.9, 0.96, ("it fits",), answer="exact",
        physics="restoring", places=(element,),
    )  # fmt: skip


FAR = dict.fromkeys(("m", "d", "k"), 1e-3)


def test_a_further_name_is_taken_back() -> None:
    first, second = named("coulomb_friction", "F"), named("end_stop", "F", **FAR)
    kept, doubted = within_reason((first, second), DECLARED)
    assert kept is first
    assert repr(kept) == "<Decision missing_physics exact coulomb_friction at F>"
    assert (doubted.kind, doubted.answer, doubted.places) == ("unknown_physics", "unknown", ())
    assert doubted.confidence == 0.0
    assert doubted.reasons[0] == "it fits"
    assert "end_stop at F holds only with values that are absurdly far" in doubted.reasons[1]
    assert "m 0.001, d 0.001, k 0.001" in doubted.reasons[1]


@pytest.mark.parametrize("far", [{"k": 1e-9}, {"m": 25.0, "d": 0.04, "k": 20.0}])
def test_one_value_far_off_or_several_a_little_are_no_reason(far: dict[str, float]) -> None:
    made = (named("coulomb_friction", "F"), named("end_stop", "F", **far))
    assert within_reason(made, DECLARED) == made


def test_what_a_law_has_taken_over_does_not_count() -> None:
    made = (named("coulomb_friction", "d"), named("end_stop", "k", **FAR))
    assert within_reason(made, DECLARED) == made  # d and k hold what was found


def test_the_first_name_stays_whatever_its_values_are() -> None:
    first, second = (named("coulomb_friction", "F", **FAR) for _ in range(2))
    made = (first, replace(second, kind="unknown_physics"))
    assert within_reason(made, DECLARED) == made
