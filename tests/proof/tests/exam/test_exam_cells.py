"""What the exam draws and makes."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bondgraph.support.errors import UnusableInput
from hardware.simulators.generator.accepted import KINDS, kinds_of, names_of, places_of
from hardware.simulators.generator.case import DrawnCase
from hardware.simulators.generator.exam_places import (
    EXAM_FORMS,
    EXAM_OUTSIDE,
    EXAM_SINGLES,
    REWRITTEN,
)
from hardware.simulators.generator.families import FAMILY_OF
from hardware.simulators.generator.laws import LAWS
from hardware.simulators.generator.making_exam import exam_record
from hardware.simulators.generator.parameters import ALL_PLANTS
from hardware.simulators.generator.sensing import SENSOR_LAWS
from hardware.simulators.judging.truths import truth_of
from tests.proof.exam.cells import CELLS, CONTROLS, draw_exam, shares
from tests.proof.exam.truths import read_exam_truths
from tests.proof.exam.world import EXAM

TABLES = (*EXAM_SINGLES, *EXAM_FORMS, *REWRITTEN, *EXAM_OUTSIDE)


@pytest.fixture(scope="module")
def cases() -> list[DrawnCase]:
    return draw_exam(0, sum(CELLS.values()))


def test_the_usual_exam_has_every_cell_and_a_quarter_of_controls(cases: list[DrawnCase]) -> None:
    counted = Counter(c.cell for c in cases)
    assert counted == CELLS
    assert len({c.id for c in cases}) == len(cases) == 420
    assert counted["control"] >= 0.25 * len(cases)
    assert {c.control_kind for c in cases if c.cell == "control"} == set(CONTROLS)
    assert {c.plant for c in cases} == set(EXAM.plants)
    assert {e.law for c in cases if c.cell == "rewritten" for e in c.effects} == {
        law for _, law, _ in REWRITTEN
    }


def test_the_draw_is_reproducible_and_a_seed_is_another_exam() -> None:
    assert draw_exam(3, 60) == draw_exam(3, 60)
    one, two = ({c.seed for c in draw_exam(seed, 60)} for seed in (3, 4))
    assert len(one) == 60
    assert not one & two


@pytest.mark.parametrize("count", [1, 7, 30, 840])
def test_shares_scale(count: int) -> None:
    found = shares(count)
    assert sum(found.values()) == count
    assert all(abs(found[c] - n * count / 420) <= 1 for c, n in CELLS.items())


def test_every_law_is_there_and_has_true_words() -> None:
    for effect, law, places in TABLES:
        assert law in LAWS or law in SENSOR_LAWS
        names = names_of(effect, law, (0.5, 0.5, 0.5))
        assert set(names) <= set(FAMILY_OF)
        assert bool(names) == (effect != "unknown")
        assert set(kinds_of(effect, law)) <= set(KINDS)
        for plant, at in places.items():
            p = ALL_PLANTS[plant]
            known = {*p.nominal, *p.sensors, p.source[0], "clock"}
            assert {e for place in at for e in places_of(plant, law, place)} <= known


def test_words_of_laws_that_are_one_function() -> None:
    assert names_of("end_stop", "linear_stop", (0.1, 0.9, 0.1)) == (
        "end_stop", "bilinear_stiffness",
    )  # fmt: skip
    assert names_of("end_stop", "linear_stop", (0.1, 0.1, 0.1)) == ("end_stop",)
    assert places_of("chain", "dahl", "b_2") == ("b_2", "k_2")
    assert places_of("chain", "coulomb", "b_2") == ("b_2",)


def test_sizes_of_several_effects(cases: list[DrawnCase]) -> None:
    for c in cases:
        names = [e.effect for e in c.effects]
        assert len(set(names)) == len(names)
        if c.cell in ("two", "three"):
            assert len(names) == {"two": 2, "three": 3}[c.cell]
        if c.cell == "weak_further":
            assert len(names) in (2, 3)
            for e in c.effects[1:]:
                share = 10 ** ((e.strength_db - c.effects[0].strength_db) / 10)
                assert 0.0099 < share < 0.0501


@pytest.mark.long
def test_further_effects_come_out_weak(cases: list[DrawnCase]) -> None:
    shares = []
    for case in [c for c in cases if c.cell == "weak_further"][:10]:
        main, *further = (max(e["moved"].values()) for e in exam_record(case)[1]["effects"])
        shares += [level / main for level in further]
    # drawn for each alone; beside the others and at one reading it is more or less
    assert 0.08 < np.median(shares) < 0.25
    assert max(shares) < 1


def test_quiet_records_are_among_the_slow_and_broadband(cases: list[DrawnCase]) -> None:
    for cell in ("slow", "broadband"):
        quiet = sum(not c.effects for c in cases if c.cell == cell)
        assert quiet == pytest.approx(CELLS[cell] / 4, abs=1)


def first(cases: list[DrawnCase], cell: str) -> DrawnCase:
    return next(c for c in cases if c.cell == cell and c.effects)


def test_a_rare_effect_acts_in_few_stretches(cases: list[DrawnCase]) -> None:
    rare = [c for c in cases if c.cell == "rare"]
    active = [exam_record(c)[1]["active"] for c in rare[:8]]
    assert np.median(active) <= 4
    assert max(active) <= 8


def test_the_truth_says_what_was_moved_over_the_noise(cases: list[DrawnCase]) -> None:
    case = first(cases, "single")
    channels, row = exam_record(case)
    # the same recording with nothing concealed: what is left is what the effect moved
    plain, _ = exam_record(replace(case, effects=()))
    for name, level in row["moved"].items():
        difference = np.asarray(channels[name]) - np.asarray(plain[name])
        assert np.std(difference) == pytest.approx(level * row["noise_std"][name], rel=0.2)
    assert row["effects"][0]["moved"] == row["moved"]
    wanted, made = row["effects"][0]["wanted_db"], row["effects"][0]["strength_db"]
    assert made == pytest.approx(wanted, abs=3)
    truth = truth_of(row)
    assert truth.main is not None
    assert truth.shows == (max(row["moved"].values()) > 3)


def test_noise_is_counted_as_it_came_out(cases: list[DrawnCase]) -> None:
    case = next(c for c in cases if c.control_kind == "outliers")
    _, with_hits = exam_record(case)
    _, without = exam_record(replace(case, control_kind="plain"))
    for name, level in without["noise_std"].items():
        assert with_hits["noise_std"][name] > 1.05 * level


def test_a_broadband_record_begins_in_motion(cases: list[DrawnCase]) -> None:
    case = first(cases, "broadband")
    channels, _ = exam_record(case)
    assert len(np.asarray(channels["time"])) == case.samples - case.samples // 10
    (command,) = (np.asarray(channels[s]) for s in (ALL_PLANTS[case.plant].source[0],))
    parts = [np.std(p) for p in np.array_split(command, 10)]
    assert min(parts) > 0.6 * max(parts)


def test_a_missing_exam_is_said(tmp_path: Path) -> None:
    with pytest.raises(UnusableInput, match="generate first"):
        read_exam_truths(tmp_path / "truths.json")
