"""The sealed trial's plants on the bench: the trial's records, bit by bit, and cut anywhere."""

from __future__ import annotations

import functools
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from bondgraph.support.errors import UnknownName, UnusableInput
from hardware.simulators.generator.drawing import draw
from hardware.simulators.generator.native import run
from hardware.simulators.generator.parameters import PLANTS
from hardware.simulators.generator.sizing import COARSEST, bench_of
from hardware.simulators.plant_contract import EdgeDriven, Rewindable
from hardware.simulators.rig import Rig
from tests.proof.trial.bench_plant import drawn, trial_plant, truth_of_plant

MOVING = [n for n, p in PLANTS.items() if "m" in p.sensors.values()]

LAWS = (
    "prandtl_ishlinskii", "kelvin_voigt", "bouc_wen", "dahl", "stribeck", "coulomb", "first_order",
    "polynomial_stiffness", "attached_mass", "leak", "hard_limit", "dead_band", "linear_drift",
    "linear_in_time", "sine_error",
)  # fmt: skip
"""Laws without memory outside the C code: they come out bit by bit."""

CLOSELY = {"dead_time": 2e-4, "sensor_first_order": 2e-3, "sensor_dead_time": 2e-3}
"""Those that the bench does on another grid."""


@functools.cache
def cases() -> dict[str, Any]:
    """Give one short case for every law that development draws on a plant that moves."""
    found: dict[str, Any] = {}
    for case in draw("development", 5, 700):
        if case.plant in MOVING and len(case.effects) == 1 and case.excitation != "closed_loop":
            plain = {**case.noise, "kind": "white"}
            short = replace(case, samples=500, hold="zero", noise=plain)
            found.setdefault(case.effects[0].law, short)
    return found


@pytest.mark.parametrize("name", MOVING)
def test_a_nominal_plant_is_the_trials(name: str) -> None:
    """Bit by bit, for a command that is held between samples."""
    plant = PLANTS[name]
    u = np.random.default_rng(1).uniform(-1.0, 1.0, 200)
    values = [v for v, _ in plant.nominal.values()]
    made = run(name, values, (), u, sub=COARSEST, hold="zero")
    assert made is not None
    bench = trial_plant(name)
    motion = bench.advance(np.repeat(u, COARSEST))
    column = list(plant.sensors.values()).index("m")
    assert np.array_equal(motion.x[COARSEST - 1 :: COARSEST][:-1], made.readings[1:, column])
    assert np.isnan(motion.i).all() == ("A" not in plant.sensors.values())
    assert truth_of_plant(bench) == {"effects": []}


@pytest.mark.parametrize("law", [*LAWS, *CLOSELY])
def test_a_case_is_the_trials_record(law: str) -> None:
    """With its effect at the strength of the trial."""
    if law not in cases():
        pytest.skip("not drawn")
    case = cases()[law]
    plant = trial_plant(case, displacement=_displacement(case))
    bench = bench_of(case)
    made = bench.simulate(plant.effects)
    assert made is not None
    motion = plant.advance(np.repeat(bench.command, COARSEST))
    got = motion.x[COARSEST - 1 :: COARSEST][: case.samples - 1]
    expected = made[1][1 : case.samples, plant.x]
    assert np.std(got - expected) <= CLOSELY.get(law, 1e-12) * np.std(expected)
    assert truth_of_plant(plant)["effects"][0]["law"] == law


def _displacement(case: Any) -> str | None:
    place = case.effects[0].place
    return place if PLANTS[case.plant].sensors.get(place) == "m" else None


@pytest.mark.parametrize("law", ["prandtl_ishlinskii", "dead_time", "first_order", "sine_error"])
def test_cut_anywhere_and_looked_at_it_is_the_same(law: str) -> None:
    """State, dead time and memory go on; edges may lie inside the steps."""
    if law not in cases():
        pytest.skip("not drawn")
    rigs = [Rig(trial_plant(cases()[law])) for _ in range(2)]
    step = trial_plant(cases()[law]).step
    rng = np.random.default_rng(3)
    for _ in range(150):
        pause, level = step * float(rng.uniform(0.0, 7.0)), float(rng.uniform(0.0, 1.0))
        for rig, look in zip(rigs, (True, False), strict=True):
            rig.wait(pause)
            rig.drive(level)
            if look:
                rig.seen(np.array([rig.now]))
    t = np.linspace(0.0, rigs[0].now - 3.0 * step, 500)
    a, b = (rig.seen(t).x for rig in rigs)
    assert np.ptp(a) > 0.0
    assert np.abs(a - b).max() <= 1e-9 * np.ptp(a)


def test_it_satisfies_the_contract_of_the_bench() -> None:
    """Without importing it."""
    plant = trial_plant("stack")
    assert isinstance(plant, Rewindable)
    assert isinstance(plant, EdgeDriven)
    with pytest.raises(ValueError, match="beyond bounds"):
        plant.advance(np.full(10, 1e300))


def test_a_drawn_case_is_the_same_again() -> None:
    """By its seed."""
    a, b = drawn(3), drawn(3)
    assert truth_of_plant(a) == truth_of_plant(b)
    assert len(truth_of_plant(a)["effects"]) == 1


def test_what_cannot_stand_on_a_bench_is_refused() -> None:
    """One line."""
    with pytest.raises(UnknownName):
        trial_plant("rocket")
    with pytest.raises(UnknownName):
        trial_plant("stack", displacement="y")
    with pytest.raises(UnknownName):
        trial_plant("stack", parameters={"mass": 1.0})
    with pytest.raises(UnusableInput, match="no sensor reads metres"):
        trial_plant("tanks")
    with pytest.raises(UnusableInput, match="clock"):
        trial_plant(next(c for law, c in cases().items() if law == "skew"))
