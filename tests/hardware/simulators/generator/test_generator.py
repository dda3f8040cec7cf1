"""Draws, sizes and recordings of the sealed trial."""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from hardware.simulators.generator import (
    COUNTS,
    PLANTS,
    DrawnCase,
    draw,
    generate,
    load_case,
    load_truths,
    seal,
)
from hardware.simulators.generator.drawing import stream
from hardware.simulators.generator.laws import LAWS
from hardware.simulators.generator.making import record
from hardware.simulators.generator.sensing import SENSOR_LAWS, sense
from hardware.simulators.generator.sizing import bench_of
from hardware.simulators.generator.vocabulary import FORMS, OUTSIDE, SINGLES

SALT = "0" * 64


@cache
def many() -> list[DrawnCase]:
    return draw("development", 33, 752)


def test_a_trial_has_what_the_design_asks() -> None:
    cases = draw("trial", SALT)
    cells = Counter(c.cell for c in cases)
    assert len(cases) >= 710
    assert cells == COUNTS["trial"]
    assert cells["control"] >= 150
    assert cells["single"] >= 240
    assert cells["outside"] >= 120
    assert cells["form"] >= 90
    assert cells["pair"] >= 70
    pairs = Counter((c.pair_id, c.decisive) for c in cases if c.cell == "lookalike")
    assert len(pairs) == 24
    assert set(pairs.values()) == {2}
    assert {c.plant for c in cases} == set(PLANTS)
    assert min(c.samples for c in cases) >= 2000
    assert max(c.samples for c in cases) <= 20000
    singles = {(e.effect, e.place) for c in cases if c.cell == "single" for e in c.effects}
    assert len({effect for effect, _ in singles}) >= 24
    some = sum(len(c.sensors) < len(PLANTS[c.plant].sensors) for c in cases)
    assert 0.1 < some / len(cases) < 0.4
    assert len({c.id for c in cases}) == len(cases)


def test_every_law_of_the_tables_exists() -> None:
    for _, law, places in (*SINGLES, *FORMS, *OUTSIDE):
        assert law in LAWS or law in SENSOR_LAWS
        for plant, at in places.items():
            known = {*PLANTS[plant].nominal, *PLANTS[plant].sensors, PLANTS[plant].source[0]}
            assert set(at) <= known | {"clock"}
    assert len({law for _, law, _ in FORMS}) >= 12
    assert len({law for _, law, _ in OUTSIDE}) >= 10


def test_draws_repeat_and_kinds_do_not_meet() -> None:
    assert draw("development", 5, 40) == draw("development", 5, 40)
    assert len(draw("development", 5, 40)) == 40
    one = {c.seed for c in draw("trial", SALT)}
    other = {c.seed for c in draw("development", SALT, 752)}
    assert not one & other
    assert stream("trial", 1, 2).random() != stream("development", 1, 2).random()


@pytest.mark.parametrize(("kind", "entropy"), [("final", 1), ("trial", 1), ("trial", "short")])
def test_refuses(kind: str, entropy: int | str) -> None:
    with pytest.raises(ValueError, match="draw:"):
        draw(kind, entropy)


def test_generate_resumes_seals_and_hides(tmp_path: Path) -> None:
    cases = sorted(draw("reduced", 4), key=lambda c: c.samples)[:4]
    first = generate(cases[:2], tmp_path)
    stamp = (tmp_path / "records" / f"{cases[0].id}.npz").stat().st_mtime_ns
    done: list[str] = []
    truths = generate(cases, tmp_path, progress=done.append)
    assert truths[:2] == first
    assert (tmp_path / "records" / f"{cases[0].id}.npz").stat().st_mtime_ns == stamp
    assert done == [c.id for c in cases]
    assert seal(truths, "a") == seal(load_truths(tmp_path), "a")
    assert seal(truths, "a") != seal(truths, "b")
    changed = json.loads(json.dumps(truths))
    changed[0]["samples"] += 1
    assert seal(changed, "a") != seal(truths, "a")
    seen = load_case(tmp_path, cases[0].id)
    plant = PLANTS[cases[0].plant]
    declared = {"plant", "hold", "declared_delay", "declared_resolution"}
    assert set(seen) == {"time", plant.source[0], *cases[0].sensors, *declared}
    assert not list(tmp_path.rglob(".*"))


def test_effects_reach_the_wanted_difference() -> None:
    cases = [c for c in draw("development", 21, 150) if c.cell in ("single", "outside", "form")]
    short = sorted(cases, key=lambda c: c.samples)[:8]
    misses = []
    for case in short:
        _, truth = record(case)
        (effect,) = truth["effects"]
        if effect["numbers"]:
            misses.append(abs(effect["strength_db"] - effect["wanted_db"]))
    assert np.median(misses) < 1.0
    assert np.mean(np.array(misses) < 2.5) > 0.75


@pytest.mark.parametrize("law", ["coulomb", "bristles", "linear_stop", "bouc_wen", "kelvin_voigt"])
def test_halving_the_step_changes_less_than_the_finest_noise(law: str) -> None:
    case = next(c for c in many() if c.cell != "pair" and [e.law for e in c.effects] == [law])
    bench = bench_of(replace(case, samples=2000))
    sized = [bench.sized(case.effects[0], 0.2)]
    coarse, fine = bench.simulate(sized), bench.simulate(sized, refine=2)
    assert coarse is not None
    assert fine is not None
    error = np.sqrt(np.mean((coarse[1] - fine[1]) ** 2, axis=0))
    assert np.all(error < 1e-3 * np.std(fine[1], axis=0))


def test_sensor_laws_do_what_they_say() -> None:
    h, over = 0.01, 8
    t = h / over * np.arange(800)
    y = np.sin(7 * t)
    late = sense("sensor_dead_time", {"time": 0.03}, y, over, h)
    assert late[20:] == pytest.approx(np.sin(7 * (t[::over][20:] - 0.03)), abs=1e-5)
    lagged = sense("sensor_first_order", {"time": 0.02}, y, over, h)
    gain = 1 / (1 + 7j * 0.02)
    assert lagged[40:] == pytest.approx(np.imag(gain * np.exp(7j * t[::over]))[40:], abs=1e-4)
    skewed = sense("skew", {"ratio": -0.01}, y, over, h)
    assert skewed == pytest.approx(np.sin(7 * 0.99 * t[::over]), abs=1e-4)
    assert set(np.round(sense("rounding", {"unit": 0.5}, y, over, h), 9)) <= {-1, -0.5, 0, 0.5, 1}
