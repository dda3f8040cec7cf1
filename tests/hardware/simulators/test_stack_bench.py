"""What the device bench draws: independence, promised strengths, wishes, seal and judge."""

from __future__ import annotations

import ast
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hardware.simulators as simulators
from hardware.simulators.bench_server import BenchConfig, PlantConfig, stand_of
from hardware.simulators.generator.excitation import command
from hardware.simulators.generator.showing import HIDES, left_over
from hardware.simulators.judging.truths import truth_of
from hardware.simulators.plants import GeneratedPlant, conceal
from hardware.simulators.plants.stack import (
    BIAS,
    ELECTRICAL,
    P840_1,
    SHOWS,
    SPREAD,
    STEP,
    STRENGTHS,
    effects,
)

SEED = 11
PAIRS = sorted({(c.effect, c.place) for at in HIDES["stack"].values() for c in at} - {
    ("clock_skew", "clock")
})  # fmt: skip


def test_bench_imports_nothing_of_the_tool() -> None:
    """Only numpy, scipy, the standard library and the bench itself."""
    allowed = {"numpy", "scipy", "hardware", *sys.stdlib_module_names}
    folder = Path(simulators.__file__).parent
    for path in folder.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = []
            if isinstance(node, ast.Import):
                names = [a.name for a in node.names]
            elif isinstance(node, ast.ImportFrom):
                assert node.level == 0, path.name
                names = [node.module or ""]
            for name in names:
                assert name.split(".")[0] in allowed, (path.name, name)
                if name.startswith("hardware"):
                    assert name.startswith("hardware.simulators"), (path.name, name)


@pytest.mark.parametrize("seed", range(8))
def test_the_record_of_its_strength_is_one_of_a_bench(seed: int) -> None:
    """From rest at the bias, within 0 to 100 V, nearly all of it."""
    u = BIAS + command("stack", "swings", 4096, 1.0, np.random.default_rng(seed))
    assert u.min() >= 0.0
    assert u.max() <= 100.0
    assert u[0] == BIAS
    assert np.ptp(u) > 70.0


@pytest.mark.sampled(every=6)
@pytest.mark.parametrize("name", ["hysteresis", "creep", "coulomb_friction", "nonlinear_stiffness",
                                  "saturation", "sensor_drift"])  # fmt: skip
@pytest.mark.parametrize("strength", STRENGTHS)
def test_what_stands_there_moves_as_much_as_its_class_promises(name: str, strength: str) -> None:
    """The record through the plant of the bench, less its twin's, over the noise."""
    place = {"hysteresis": "k", "creep": "k", "sensor_drift": "x"}.get(name)
    drawn = conceal(SEED, name, place, strength)
    parts = 40  # steps in an interval of the record
    assert parts * STEP == pytest.approx(drawn.truth["dt"])
    u = drawn.sized_on.command
    fine = np.interp((np.arange((u.size - 1) * parts) + 0.5) / parts, np.arange(u.size), u)
    plant = GeneratedPlant(
        "stack", drawn.case.parameters, drawn.effects,
        sized_on=drawn.sized_on, step=STEP, span=u.size * drawn.truth["dt"],
    )  # fmt: skip
    x = plant.advance(fine).x[parts - 1 :: parts]
    moved = np.sqrt(np.mean((x - drawn.sized_on.base.readings[1:, 1]) ** 2)) / drawn.noise[0]
    low, high = STRENGTHS[strength]
    assert low / 1.15 < moved < 1.15 * high


@pytest.mark.sampled(every=6)
@pytest.mark.parametrize(("name", "place"), PAIRS)
def test_what_is_concealed_is_as_large_as_its_class_or_as_physics_allows(
    name: str, place: str
) -> None:
    for strength, (low, high) in STRENGTHS.items():
        drawn = conceal(SEED, name, place, strength)
        (effect,) = drawn.truth["effects"]
        (moved,) = effect["moved"].values()
        assert moved < 1.13 * high
        # a strength of 1 is the largest that the generator has
        assert moved > low / 1.13 or effect["strength"] == pytest.approx(1.0, abs=0.1)


@pytest.mark.sampled(every=6)
@pytest.mark.parametrize("seed", range(18))
def test_what_is_drawn_shows(seed: int) -> None:
    """Other parameters leave at least the noise of it, and the length shows it."""
    drawn = conceal(seed)
    for effect in drawn.truth["effects"]:
        assert effect["place"] not in (*ELECTRICAL, "clock")
        assert left_over(drawn.case, drawn.truth) >= SHOWS
    assert drawn.case.sensors == ("x",)


def test_seed_decides_everything() -> None:
    """Same seed, same bench; another seed, another bench."""
    a, b = (conceal.__wrapped__(5, "quadratic_drag") for _ in range(2))
    assert a.truth == b.truth
    volts = np.full(300, 30.0)
    np.testing.assert_array_equal(a.plant().advance(volts).x, b.plant().advance(volts).x)
    assert conceal(6, "none").case.parameters != conceal(5, "none").case.parameters


def test_noise_and_parameters() -> None:
    """Sensors are 55 to 65 dB below the signal; true values within 20 % of the nominal ones."""
    drawn = conceal(3, "none")
    i, x = np.std(drawn.sized_on.base.readings[: drawn.case.samples], axis=0)
    for signal, noise in zip((x, i), drawn.noise, strict=True):
        assert 54.9 < 20 * np.log10(signal / noise) < 65.1
    assert drawn.truth["noise_std"]["x"] == pytest.approx(drawn.noise[0], rel=0.05)
    for name, value in drawn.case.parameters.items():
        assert abs(np.log(value / P840_1[name])) <= SPREAD


def test_what_stands_on_the_bench_is_told_as_the_judge_reads_it() -> None:
    stand = stand_of(BenchConfig(plant=PlantConfig(seed=4, effect="creep", place="k")))
    truth = truth_of(stand.truth)
    (effect,) = truth.effects
    assert (effect.effect, effect.places) == ("creep", frozenset({"k"}))
    assert effect.moved > 1.0
    assert truth.id == "bench-4"
    assert stand.noise_x == conceal(4, "creep", "k").noise[0]


def test_a_drift_takes_the_time_that_it_is_given() -> None:
    drawn = conceal(SEED, "sensor_drift", "x", "strong")
    (rise,) = drawn.effects[0].numbers.values()
    x = drawn.plant(span=0.2).advance(np.zeros(40_000)).x
    assert x[-1] == pytest.approx(rise, rel=1e-3)
    assert x[19_999] == pytest.approx(rise / 2, rel=1e-3)


@pytest.mark.parametrize(
    ("wish", "said"),
    [
        ({"effect": "creeep"}, "no effect 'creeep' on this bench; did you mean creep"),
        ({"effect": "creep", "place": "V"}, "no place of creep 'V'"),
        ({"effect": "hysteresis", "place": "C_nl"}, "did you mean C_a; known: C_a, k"),
        ({"place": "nowhere"}, "known: C_a, R_a"),
        ({"effect": "clock_skew"}, "no effect 'clock_skew'"),
        ({"effect": "creep", "place": "k", "strength": "huge"}, "known: medium, strong, weak"),
    ],
)
def test_impossible_wishes_are_refused(wish: Any, said: str) -> None:
    with pytest.raises(ValueError, match=said) as refused:
        conceal(1, **wish)
    assert "\n" not in str(refused.value)


def test_every_old_kind_of_effect_is_there() -> None:
    assert {
        "none", "hysteresis", "creep", "coulomb_friction", "stribeck_friction", "quadratic_drag",
        "nonlinear_stiffness", "saturation", "dead_zone", "low_pass", "delay", "sensor_drift",
        "sensor_nonlinearity",
    } <= set(effects())  # fmt: skip
