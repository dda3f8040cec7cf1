"""What a sealed trial draws, and what development may see of it."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from hardware.simulators.generator.accepted import kinds_of, names_of, places_of
from hardware.simulators.generator.case import DrawnCase
from hardware.simulators.generator.families import FAMILY_OF
from hardware.simulators.generator.laws import LAWS
from hardware.simulators.generator.laws_withheld import WITHHELD_LAWS
from hardware.simulators.generator.making_exam import exam_record
from hardware.simulators.generator.parameters import ALL_PLANTS, WITHHELD_PLANTS
from hardware.simulators.generator.sensing import SENSOR_LAWS
from hardware.simulators.judging.truths import truth_of
from tests.proof.trial.design import CELLS, COUNTS, DEVELOPMENT, SEALED, draw_trial

SALT = "a" * 64


@pytest.fixture(scope="module")
def cases() -> list[DrawnCase]:
    return draw_trial("trial", SALT)


def test_every_gate_can_be_certified(cases: list[DrawnCase]) -> None:
    counted = Counter(c.cell for c in cases)
    assert counted == CELLS
    assert len({c.id for c in cases}) == len(cases) >= 1000
    assert sum(not c.effects for c in cases) >= 250
    assert counted["outside"] + counted["withheld_outside"] >= 120
    assert {c.plant for c in cases} == set(ALL_PLANTS)
    read = [c for c in cases if c.noise["kind"] != "quantised"]
    assert {c.extra["bits"] for c in read} == {12, 14, 16}


def test_development_has_no_plant_and_no_law_that_is_kept(cases: list[DrawnCase]) -> None:
    seen = draw_trial("development", 3, 400)
    assert not {c.plant for c in seen} & set(WITHHELD_PLANTS)
    laws = {e.law for c in seen for e in c.effects}
    assert not laws & set(WITHHELD_LAWS)
    kept = {e.law for c in cases for e in c.effects}
    assert set(WITHHELD_LAWS) <= kept
    for table in (DEVELOPMENT.inside, *DEVELOPMENT.tables.values()):
        assert not {law for _, law, _ in table} & set(WITHHELD_LAWS)
        assert not {p for _, _, at in table for p in at} & set(WITHHELD_PLANTS)


def test_kinds_of_trials_never_meet() -> None:
    trial, quick = draw_trial("trial", SALT), draw_trial("quick", SALT)
    assert len(quick) == COUNTS["quick"] == 60
    assert not {c.seed for c in trial} & {c.seed for c in quick}
    assert draw_trial("quick", SALT) == quick
    assert draw_trial("quick", "b" * 64) != quick


@pytest.mark.parametrize(
    ("kind", "entropy", "count", "said"),
    [
        ("exam", 1, None, "use trial, quick, development"),
        ("trial", 1, None, "needs a salt"),
        ("quick", "ab", None, "needs a salt"),
        ("trial", SALT, 10, "fixed"),
    ],
)
def test_bad_draws(kind: str, entropy: str | int, count: int | None, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        draw_trial(kind, entropy, count)


def test_every_law_has_places_and_true_words() -> None:
    for table in SEALED.tables.values():
        for effect, law, places in table:
            assert law in LAWS or law in SENSOR_LAWS
            names = names_of(effect, law, (0.5, 0.5, 0.5))
            assert set(names) <= set(FAMILY_OF)
            assert bool(names) == (effect != "unknown")
            assert kinds_of(effect, law)
            for plant, at in places.items():
                p = ALL_PLANTS[plant]
                known = {*p.nominal, *p.sensors, p.source[0], "clock"}
                assert {e for place in at for e in places_of(plant, law, place)} <= known


def one(cases: list[DrawnCase], law: str) -> DrawnCase:
    return next(c for c in cases if any(e.law == law for e in c.effects))


def test_channels_are_exchanged_with_their_noise(cases: list[DrawnCase]) -> None:
    case = one(cases, "swapped")
    mixed, row = exam_record(case)
    plain, _ = exam_record(replace(case, effects=()))
    sensors = list(ALL_PLANTS[case.plant].sensors)
    k = sensors.index(case.effects[0].place)
    a, b = sensors[k], sensors[(k + 1) % len(sensors)]
    for one_name, other in ((a, b), (b, a)):
        got, sent = np.asarray(mixed[one_name]), np.asarray(plain[other])
        assert np.std(got - sent) < 0.2 * np.std(sent)
    truth = truth_of(row)
    assert truth.mixed_up
    assert truth.outside
    assert not truth.single


def test_a_wrong_unit_takes_the_noise_along(cases: list[DrawnCase]) -> None:
    case = one(cases, "wrong_unit")
    got, row = exam_record(case)
    plain, usual = exam_record(replace(case, effects=()))
    place = case.effects[0].place
    factor = row["effects"][0]["numbers"]["factor"]
    ratio = np.asarray(got[place]) / factor - np.asarray(plain[place])
    assert np.std(ratio) < 3 * usual["noise_std"][place]
    assert row["noise_std"][place] == pytest.approx(factor * usual["noise_std"][place], rel=0.3)


def test_a_converter_rounds_to_declared_units_and_hides_no_noise(cases: list[DrawnCase]) -> None:
    for case in [c for c in cases if c.noise["kind"] == "white"][:6]:
        channels, row = exam_record(case)
        units = np.asarray(channels["declared_resolution"])
        for name, unit in zip(case.sensors, units, strict=True):
            y = np.asarray(channels[name]) / unit
            assert np.abs(y - np.round(y)).max() < 1e-6
            assert unit <= 3.6 * row["noise_std"][name]
