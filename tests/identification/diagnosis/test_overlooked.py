"""Laws that the screening passed over are fitted where the evidence asks for them."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np

from bondgraph import R
from identification.diagnosis.catalogue import CATALOGUE, UNNAMED, by_name
from identification.diagnosis.evidence.answer import Decision
from identification.diagnosis.evidence.hypotheses import Thresholds
from identification.diagnosis.evidence.kind_score import KindScore
from identification.diagnosis.localisation.structural_classes import Isolability
from identification.diagnosis.screening.score_test import Screened
from identification.diagnosis.search.one_step import LITTLE, unexplained
from identification.diagnosis.search.passed_over import by_merit, elsewhere, overlooked
from tests.spring import spring

SPRING = spring()
COSTLY = next(e.name for e in CATALOGUE if e.costly)


def screened(*labels: str) -> list[Screened]:
    made = []
    for text in labels:
        effect, element = text.split("@")
        found = UNNAMED if effect == "unknown" else by_name(effect)
        made.append(Screened(found, SPRING[element], True, 0.5, 1, 5.0, None))
    return made


def decision(
    answer: str, law: str = "", simpler: tuple[str, ...] = (), confused: tuple[str, ...] = ()
) -> Decision:
    chosen: Any = None
    if law:
        effect, element = law.split("@")
        insertion = SimpleNamespace(simpler=simpler, confused_with=confused, family="")
        chosen = SimpleNamespace(effect=effect, element=element, insertion=insertion)
    kind = "missing_physics" if answer == "exact" else "unknown_physics"
    return Decision(kind, chosen, (), (), 0.0, 0.0, (), answer=answer)


def asked(
    d: Decision,
    kinds: list[tuple[str, str]],
    tried: list[str],
    *ranked: str,
    classes: Isolability | None = None,
) -> list[str]:
    nothing: Any = None
    at = [KindScore(element, kind, nothing, np.zeros(0)) for kind, element in kinds]
    trials: list[Any] = []
    for text in tried:
        effect, element = text.split("@")
        trials.append(SimpleNamespace(effect=effect, element=element))
    found = overlooked(d, at, trials, screened(*ranked), classes)
    return [f"{s.effect.name}@{s.element.name}" for s in found]


def test_simpler_forms_of_the_best_law() -> None:
    d = decision("exact", "presliding_friction@d", ("coulomb_friction",))
    ranked = ("coulomb_friction@d", "stribeck_friction@d", "hysteresis@k")
    looks_like_it = ["stribeck_friction@d"]
    assert asked(d, [], ["presliding_friction@d"], *ranked) == [
        "coulomb_friction@d",
        *looks_like_it,
    ]
    assert asked(d, [], ["coulomb_friction@d"], *ranked) == looks_like_it
    assert asked(d, [], ["coulomb_friction@d", *looks_like_it], *ranked) == []


def test_what_the_laws_in_question_are_confused_with() -> None:
    ranked = ("nonlinear_resistance@d", "square_root_flow@d", "square_root_flow@k", "unknown@d")
    told = decision("family", "nonlinear_resistance@d")  # square root flow says so of itself
    assert asked(told, [], ["nonlinear_resistance@d"], *ranked) == ["square_root_flow@d"]
    told = decision("family", "hysteresis@k", confused=("backlash",))
    assert asked(told, [], ["hysteresis@k"], "backlash@k", "backlash@d") == ["backlash@k"]


def test_the_named_law_at_other_places_whose_forms_do_as_well() -> None:
    """Drag at the second axle was named at the first one: at the second it had not been fitted."""
    ranked = ("nonlinear_stiffness@d", "nonlinear_stiffness@m", "end_stop@d")

    def asked_for(told: Decision, *fitted: str, kind: str = "restoring") -> list[str]:
        nothing: Any = None
        kinds = [KindScore(p, k, nothing, np.zeros(0)) for p, k in (("k", kind), ("d", kind))]
        laws = [
            SimpleNamespace(element=place, trial=SimpleNamespace(effect="nonlinear_stiffness"))
            for place in fitted
        ]
        evidence: Any = SimpleNamespace(laws=laws)
        found = elsewhere(told, kinds, evidence, screened(*ranked))
        return [f"{s.effect.name}@{s.element.name}" for s in found]

    named = decision("exact", "nonlinear_stiffness@k")
    assert asked_for(named, "k") == ["nonlinear_stiffness@d"]
    assert asked_for(named, "k", "d") == []
    assert asked_for(named, "k", kind="memory") == []
    assert asked_for(decision("unknown", "nonlinear_stiffness@k"), "k") == []


def test_laws_of_the_kinds_in_question_in_their_order() -> None:
    ranked = ("hysteresis@k", "quadratic_drag@d", "end_stop@k", "backlash@k", "unknown@k")
    kinds = [("restoring", "k"), ("dissipative", "d")]
    found = asked(decision("kind"), kinds, ["backlash@k"], *ranked)
    assert found == ["end_stop@k", "quadratic_drag@d"]
    assert asked(decision("unknown"), kinds[1:], [], *ranked) == ["quadratic_drag@d"]
    # a curve of one variable is a surface, too
    assert asked(decision("kind"), [("surface", "d")], [], *ranked) == ["quadratic_drag@d"]


def test_then_laws_at_places_that_cannot_be_told_from_these() -> None:
    ranked = ("hysteresis@k", "end_stop@k", "quadratic_drag@d", "saturation@F", "unknown@k")
    kinds = [("dissipative", "d")]
    classes = Isolability((("k", "d"), ("F",)))
    found = asked(decision("kind"), kinds, ["end_stop@k"], *ranked, classes=classes)
    assert found == ["quadratic_drag@d", "hysteresis@k"]
    assert asked(decision("exact"), kinds, [], *ranked, classes=classes) == []


def test_a_name_asks_for_nothing_else() -> None:
    d = decision("exact", "hysteresis@k")
    assert asked(d, [("restoring", "k")], ["hysteresis@k"], "end_stop@k") == []
    assert isinstance(SPRING["d"], R)


def test_where_all_that_was_fitted_explains_little_the_search_goes_on() -> None:
    def so(d: Decision, *left: float) -> bool:
        laws = [SimpleNamespace(trial=SimpleNamespace(train=t)) for t in left]
        evidence: Any = SimpleNamespace(laws=laws, trained=100.0)
        return unexplained(d, evidence)

    unknown = decision("unknown")
    assert so(unknown)
    assert so(unknown, 99.0, 100.0 * LITTLE + 1)
    assert not so(unknown, 99.0, 100.0 * LITTLE - 1)
    assert not so(decision("exact", "coulomb_friction@d"), 99.0)


def test_it_goes_on_with_what_the_screening_is_surest_of() -> None:
    nothing: Any = object()
    sure = {"creep@k": 4.0, "end_stop@k": 9.0, "backlash@k": 2.0, "quadratic_drag@d": 6.0}
    ranked = [
        replace(s, z=z, hint=nothing) for s, z in zip(screened(*sure), sure.values(), strict=True)
    ]
    # one has no name, one no hint, and one takes too long
    free, plain, long = screened("unknown@k", "coulomb_friction@d", f"{COSTLY}@d")
    ranked += [replace(s, z=20.0, hint=nothing) for s in (free, long)] + [replace(plain, z=20.0)]
    tried: Any = [SimpleNamespace(effect="quadratic_drag", element="d")]
    found = by_merit(tried, ranked, ranked[:0], Thresholds())
    assert [s.effect.name for s in found] == ["end_stop", "creep"]
    assert by_merit(tried, ranked, found, Thresholds()) == []
