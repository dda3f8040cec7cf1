"""The verdict as data: what was found, how sure, and what is left."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from identification.diagnosis.diagnose import Diagnosis
from identification.diagnosis.evidence.answer import Decision
from identification.diagnosis.evidence.remaining import Remaining
from identification.diagnosis.localisation.recording.region import Region
from identification.diagnosis.screening.flexible_forms import KINDS
from identification.diagnosis.verdict import verdict, write_verdict
from identification.diagnosis.verdict.reading import parse_verdict
from identification.diagnosis.verdict.said_again import retold
from identification.diagnosis.verdict.text import in_words, sentence
from identification.report.numbers import quantity
from identification.report.numbers import told as told_value
from tests.identification.diagnosis.rubbing_spring import diagnosed


@pytest.fixture
def dry() -> Diagnosis:
    """Dry friction that is missing in the model."""
    return diagnosed()


def decided(d: Diagnosis, kind: str, **more: Any) -> Diagnosis:
    """The diagnosis with its only decision changed."""
    return replace(d, kind=kind, steps=(replace(d.steps[0], kind=kind, **more),))


def as_data(d: Diagnosis) -> dict[str, Any]:
    """The verdict as it comes back from its file: strict JSON that the reader accepts."""
    text = json.dumps(verdict(d), allow_nan=False)
    found = parse_verdict(text)
    assert json.loads(text) == found
    assert retold(found).strip()
    return found


def test_dry_friction_is_found_with_kind_fit_and_probability(dry: Diagnosis) -> None:
    v = as_data(dry)
    assert v["verdict"] == "missing_physics"
    (f,) = v["findings"]
    assert f["answer"] in ("exact", "approximate", "family")
    assert f["family"] == "friction"
    assert f["kind"] in ("dissipative", "memory")
    assert f["location"]["element"] == "d"
    assert 0.9 < f["law_fit"] <= 1.0
    assert 0.5 < f["probability"] <= 0.99
    assert f["confidence"] == f["probability"]


def test_what_is_left_is_said_of_every_reading(dry: Diagnosis) -> None:
    assert dry.left is not None
    (left,) = as_data(dry)["remaining"].items()
    name, found = left
    assert name == "x"
    assert set(found) == {"over_noise", "place", "kind", "regions"}
    assert found["over_noise"] == pytest.approx(dry.left.over_noise["x"], abs=1e-4)


def test_what_is_left_has_place_kind_and_regions_only_above_the_noise(dry: Diagnosis) -> None:
    unknown = decided(
        dry, "unknown_physics", answer="kind", physics="memory", places=("k", "d"), chosen=None
    )
    where = tuple(Region("time", 1.0, 2.0, 0.5, 3.0, "s", channel=c) for c in ("x", "v"))
    for size, known in ((1.1, False), (7.0, True)):
        left = Remaining({"x": size}, True, 0.0)
        found = as_data(replace(unknown, left=left, regions_left=where))["remaining"]["x"]
        assert found["over_noise"] == size
        assert found["place"] == (["k", "d"] if known else [])
        assert found["kind"] == ("memory" if known else "")
        assert found["regions"] == ([str(where[0])] if known else [])


def test_a_reading_that_could_not_be_measured_is_null_not_nan(dry: Diagnosis) -> None:
    left = Remaining({"x": float("nan")}, True, 0.0)
    assert as_data(replace(dry, left=left))["remaining"]["x"]["over_noise"] is None
    assert as_data(replace(dry, left=None))["remaining"] == {}


def test_a_kind_is_told_without_a_name(dry: Diagnosis) -> None:
    d = decided(
        dry, "unknown_physics", answer="kind", physics="dissipative", places=("d",), rivals=(),
        law_fit=0.6, confidence=0.7,
    )  # fmt: skip
    (f,) = as_data(d)["findings"]
    assert (f["answer"], f["effect"], f["law"], f["kind"]) == (
        "kind", "unknown", "none", "dissipative",
    )  # fmt: skip
    assert f["kind"] in KINDS
    assert f["family"] == "outside"
    assert f["location"]["element"] == "d"
    assert f["law_fit"] == 0.6
    assert f["probability"] == 0.7
    assert f["confidence"] == 0.0
    assert f["parameters"] == []


def test_unknown_has_neither_kind_nor_law_fit(dry: Diagnosis) -> None:
    d = decided(
        dry, "unknown_physics", answer="unknown", physics="memory", chosen=None, places=(),
        law_fit=float("nan"), confidence=0.0, rivals=(),
    )  # fmt: skip
    (f,) = as_data(d)["findings"]
    assert (f["answer"], f["effect"], f["kind"], f["law_fit"]) == ("unknown", "unknown", "", None)
    assert f["probability"] == 0.0


def test_kinds_that_look_alike_stand_behind_the_closest_laws(dry: Diagnosis) -> None:
    (kind, *_) = (k for k in dry.steps[0].kinds)
    other = replace(kind, element="m", kind="mode")
    d = decided(
        dry, "unknown_physics", answer="unknown", places=("d", "m"), rivals=(), richer=(),
        kinds=(replace(kind, element="d", kind="dissipative"), other),
    )  # fmt: skip
    (f,) = as_data(d)["findings"]
    assert [(r["effect"], r.get("kind", "")) for r in f["also_possible"]] == [
        ("coulomb_friction", ""), ("unknown", "dissipative"), ("unknown", "mode"),
    ]  # fmt: skip
    said = (
        ". It is a loss that depends on the velocity at d or a resonance at m, which look alike "
        "here. Closest is "
    )
    assert said in sentence(d)


@pytest.mark.parametrize("answer", ["unknown", "kind"])
def test_what_explains_nothing_is_not_called_closest(dry: Diagnosis, answer: str) -> None:
    chosen = dry.steps[0].chosen
    assert chosen is not None
    for share, near in ((0.02, False), (0.4, True)):
        d = decided(
            dry, "unknown_physics", answer=answer, physics="restoring", places=("k",), rivals=(),
            share=share, law_fit=share, kinds=(),
        )  # fmt: skip
        assert ("coulomb friction" in sentence(d).lower()) is near
        (f,) = as_data(d)["findings"]
        assert [p["effect"] for p in f["also_possible"]] == ["coulomb_friction"] * near


@pytest.mark.parametrize("answer", ["family", "look_alikes"])
def test_no_single_effect_is_named_where_several_are_as_good(dry: Diagnosis, answer: str) -> None:
    kind = "missing_physics" if answer == "family" else "unknown_physics"
    chosen = dry.steps[0].chosen
    assert chosen is not None
    d = decided(dry, kind, answer=answer, rivals=(chosen,), richer=())
    (f,) = as_data(d)["findings"]
    assert (f["answer"], f["effect"]) == (answer, "unknown")
    assert chosen.effect in [r["effect"] for r in f["also_possible"]]


def test_look_alikes_are_told_with_their_sizes(dry: Diagnosis) -> None:
    chosen = dry.steps[0].chosen
    assert chosen is not None
    other = replace(chosen, insertion=replace(chosen.insertion, effect="stribeck_friction"))
    d = decided(dry, "unknown_physics", answer="look_alikes", chosen=other, rivals=(chosen,))
    size = quantity(chosen.fit.values["F_c_d"], "N")
    assert f"either: coulomb friction at d with F_c_d = {size} leaves" in in_words(d)
    own = next(e for e in chosen.fit.estimates if e.name == "m")
    assert f"\n  then m = {told_value(own.value, *own.ci95, own.unit)}" in in_words(d)
    (f,) = as_data(d)["findings"]
    told = {r["effect"]: r["evidence"] for r in f["also_possible"]}
    assert told["coulomb_friction"].endswith(f"with F_c_d = {size}")


def test_nothing_found_is_an_empty_list(dry: Diagnosis) -> None:
    quiet = Decision("explained", None, (), (), 0.0, 0.0, ())
    for kind in ("explained", "parameters_only"):
        assert as_data(replace(dry, kind=kind, steps=(quiet,)))["findings"] == []


def test_the_file_holds_the_same(dry: Diagnosis, tmp_path: Path) -> None:
    written = json.loads(write_verdict(dry, tmp_path).read_text(encoding="utf-8"))
    assert written == json.loads(json.dumps(verdict(dry)))
