"""A stack identified from recordings whose truth is known: constants, elements, file, bad input."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from actuators.compensation import UNIPOLAR
from actuators.compensation.identified_tracking import compensation
from actuators.stack.conversions import Lumped, Polarised
from actuators.stack.excitation import join, loading_ramp, sine
from actuators.stack.identification import (
    Identification,
    fit_ramps,
    identify_stack,
    ramp_table,
)
from actuators.stack.identified import IdentifiedStack
from actuators.stack.inner_curves import charge_curve, dipole_curve, fit_capacitor
from actuators.stack.loading_curve import Interval
from actuators.stack.lumped import stack_lumped
from actuators.stack.ramps import (
    fit_ramp,
    from_rest,
    mean_of,
    stiffness_from_load,
    stiffness_from_weight,
)
from actuators.stack.step_response import fit_step
from actuators.stack.validation import rms, validate
from bondgraph.hysteresis import AlJanaideh, KelvinVoigtCreep, MaxwellResistiveCapacitor
from bondgraph.hysteresis.errors import NotInvertible
from bondgraph.hysteresis.fitting.loop_records import LoopRecords
from bondgraph.hysteresis.fitting.numbered import FittedNumber
from bondgraph.laws import Hysteretic
from bondgraph.signals.drive_limits import VoltageLimit
from bondgraph.signals.recording import Recording
from bondgraph.support.errors import UnusableInput
from tests.settled import simulate

RATE, NOISE = 1000.0, 2e-9
CONSTANTS = Lumped(1.2e-6, 4.1, 58e6)
_PRINTED = MaxwellResistiveCapacitor.stack_2hz()
ELEMENTS = MaxwellResistiveCapacitor(
    tuple(1.5 * k for k in _PRINTED.stiffnesses), tuple(0.9 * v for v in _PRINTED.breakaways)
)
"""Other constants, all slips reached at 100 V: k dx/dV is T there."""
REST = np.zeros(200)


def stack() -> Any:
    c = CONSTANTS
    return stack_lumped(
        Hysteretic(ELEMENTS), capacitance=c.capacitance, transducer=c.transducer,
        stiffness=c.stiffness,
    )  # fmt: skip


def session() -> tuple[np.ndarray, np.ndarray]:
    """Ramp up and down, then sines, with rests."""
    up = loading_ramp(0.0, 100.0, 3.0, RATE)
    down = loading_ramp(100.0, 0.0, 3.0, RATE)
    ramp = np.concatenate((REST, join(up, down).volt, REST))
    loops = [sine(f, d, high=h, rate=RATE).volt for f, d, h in ((1, 1, 100), (2, 1, 70))]
    return ramp, np.concatenate((REST, *loops, REST))


def recording(name: str, volt: np.ndarray, x: np.ndarray) -> Recording:
    time = np.arange(volt.size) / RATE
    return Recording(name, time, {"V": volt, "x": x}, {"V": "V", "x": "m"})


@pytest.fixture(scope="module")
def records() -> tuple[Recording, Recording]:
    ramp, loops = session()
    volt = np.concatenate((ramp, loops))
    x = simulate(stack(), np.arange(volt.size) / RATE, {"V_in": volt})["x"]
    x = x + NOISE * np.random.default_rng(1).standard_normal(volt.size)
    n = ramp.size
    # the interferometer is set to zero before each record, and its zero is off
    return recording("ramp", ramp, x[:n] + 3e-8), recording("loops", loops, x[n:] - x[n])


@pytest.fixture(scope="module")
def identified(records: tuple[Recording, Recording]) -> Identification:
    k = Interval.of(CONSTANTS.stiffness, 0.0)
    return identify_stack(records, k, capacitance=CONSTANTS.capacitance, counts=(16,))


def test_ramp(records: tuple[Recording, Recording]) -> None:
    ramp = from_rest(records[0])
    assert ramp.resting >= REST.size
    assert ramp.noise == pytest.approx(NOISE, rel=0.2)
    found = fit_ramp(ramp, Interval.of(CONSTANTS.stiffness, 0.0))
    assert found.transducer.value == pytest.approx(CONSTANTS.transducer, rel=0.02)
    assert abs(found.bend) < 0.005
    short = np.append(REST, np.linspace(0.0, 35.0, 2000))
    rising = from_rest(recording("short", short, AlJanaideh.stack_2hz().run(short)[0]))
    assert fit_ramp(rising, Interval.of(65e6, 0.0)).bend > 0.01
    assert found.remanence is not None
    left = float(np.asarray(records[0]["x"])[-100:].mean()) - 3e-8
    assert found.remanence.value == pytest.approx(left, abs=1.5e-9)
    wider = fit_ramp(ramp, Interval.of(CONSTANTS.stiffness, 2e6))
    assert wider.transducer.error > 0.9 * 2e6 / CONSTANTS.stiffness * CONSTANTS.transducer
    both = mean_of([found.transducer, Interval.of(found.transducer.value + 0.2, 0.001)])
    assert both.error > 0.09
    only_up = recording(
        "up", np.asarray(records[0]["V"])[:3200], np.asarray(records[0]["x"])[:3200]
    )
    assert from_rest(only_up).remanence() is None


def test_everything_differs_and_is_found(identified: Identification) -> None:
    s = identified.stack
    stroke = s.stroke()
    assert s.transducer.value == pytest.approx(CONSTANTS.transducer, rel=0.02)
    assert s.rms < 2.0 * NOISE
    assert s.held_out < 2.5 * NOISE < 1e-3 * stroke
    assert s.creep is None
    assert {c.way for c in identified.capacitors} == {"loading curve", "first record"}
    assert identified.choice.best("al_janaideh").held_out > s.held_out
    text = str(identified)
    assert "28.63" in text
    assert "inverse r'" in text


def test_complete_model_on_a_validation_record(identified: Identification) -> None:
    time = np.arange(2500) / RATE
    volt = 45.0 * (1.0 - np.cos(2 * np.pi * 1.5 * time)) * np.interp(time, [0, 2.5], [1.0, 0.5])
    x, model = (simulate(g, time, {"V_in": volt})["x"] for g in (stack(), identified.stack.graph()))
    assert np.sqrt(np.mean((x - model) ** 2)) < 0.002 * np.ptp(x)
    creeping = replace(identified.stack, creep=KelvinVoigtCreep(1.0, (0.03,), (0.2,)), lag=0.0)
    crept = simulate(creeping.graph(), time, {"V_in": volt})["x"]
    assert np.abs(crept - creeping.response(volt, RATE)).max() < 0.002 * np.ptp(x)
    assert np.abs(crept - model).max() > 0.01 * np.ptp(x)
    with pytest.raises(UnusableInput, match="--capacitance"):
        replace(identified.stack, capacitance=None).graph()


def test_validation_knows_what_the_stack_has_seen(
    records: tuple[Recording, Recording], identified: Identification
) -> None:
    ramp, loops = session()
    time = np.arange(1500) / RATE
    beats = 35.0 * (1.0 - np.cos(2 * np.pi * 2 * time)) * (1.0 - 0.3 * time)
    volt = np.concatenate((ramp, loops, REST, beats))
    x = simulate(stack(), np.arange(volt.size) / RATE, {"V_in": volt})["x"]
    seen = ramp.size + loops.size
    noisy = x[seen:] + NOISE * np.random.default_rng(2).standard_normal(volt.size - seen)
    fresh = recording("fresh", volt[seen:], noisy)
    found = validate(identified.stack, fresh, records)
    assert 100 * NOISE < found.span
    for name, error in found.errors.items():
        assert rms(error) < (4 if "Maxwell" not in name else 20) * NOISE, name
        assert error.size == noisy.size - from_rest(fresh).resting
    complete = "complete model: lumped + operator"
    assert complete in str(found)
    assert "crept" not in str(found)
    virgin = validate(identified.stack, fresh)
    assert rms(virgin.errors[complete]) > 3 * rms(found.errors[complete])
    drifting = recording(
        "fresh", volt[seen:], noisy + 40 * NOISE * np.exp(-np.arange(noisy.size) / 90)
    )
    assert "crept" in str(validate(identified.stack, drifting, records))
    with pytest.raises(UnusableInput, match="--capacitance"):
        validate(replace(identified.stack, capacitance=None), fresh)


def test_creep_is_taken_out_of_ramps_or_told() -> None:
    ramp, _ = session()
    loops = np.concatenate((REST, sine(2, 2, high=100.0, rate=RATE).volt))
    volt = np.concatenate((ramp, loops))
    still = AlJanaideh.stack_2hz().run(volt)[0]
    creep = KelvinVoigtCreep(1.0, (0.02, 0.02, 0.02), (0.05, 0.5, 5.0))
    x, _ = creep.run(still, creep.initial_memory(0.0), step=1.0 / RATE)
    x = x + NOISE * np.random.default_rng(4).standard_normal(volt.size)
    n, k = ramp.size, Interval.of(65e6, 0.0)
    truth = fit_ramp(from_rest(recording("still", ramp, still[:n])), k).transducer.value
    crept = [recording("ramp", ramp, x[:n]), recording("loops", loops, x[n:])]
    records = [from_rest(r) for r in crept]
    (alone,) = fit_ramps(records[:1], k)
    assert alone.transducer.value > 1.03 * truth
    assert alone.constant.ci95[0] < truth < alone.constant.ci95[1]
    assert "T is less by what there is of it" in ramp_table([alone])
    both = fit_ramps(records, k)
    assert both[0].transducer.value == pytest.approx(truth, rel=0.006)
    assert both[0].constant == both[0].transducer
    said = ramp_table(both)
    assert "told from hysteresis" not in said
    # a sine slows down where the slope is read: no direction is known
    assert not both[1].steady
    assert "loops: the voltage slows down" in said
    # what identify makes of the ramp alone is no better, and is told
    found = identify_stack(crept[:1], k, counts=(4,))
    low, high = found.stack.transducer.ci95
    assert low < truth < high
    assert "one record" in str(found)


def test_which_way_a_bent_loading_curve_errs() -> None:
    rise = np.append(REST, np.linspace(0.0, 35.0, 2000))
    bent = fit_ramp(
        from_rest(recording("bent", rise, AlJanaideh.stack_2hz().run(rise)[0])),
        Interval.of(65e6, 0.0),
    )
    assert bent.steady
    assert "T is more than this" in ramp_table([bent])


def test_a_held_out_error_of_many_times_the_fit_is_told(identified: Identification) -> None:
    assert "which is held out, is missed" not in str(identified)
    stack = replace(
        identified.stack, held_out=40.0 * identified.choice.best(identified.stack.operator.kind).rms
    )
    assert "loops, which is held out, is missed by 40 times" in str(
        replace(identified, stack=stack)
    )


def test_inner_curves_are_those_of_the_models() -> None:
    """Slowly, the charge drives the elements to the voltage that is left: eq. (6.6) and (5.1)."""
    volt, _ = session()
    x = simulate(stack(), np.arange(volt.size) / RATE, {"V_in": volt}, accuracy=1e-6)["x"]
    q, v = charge_curve(volt, x, CONSTANTS)
    assert np.abs(ELEMENTS.run(q)[0] - v).max() < 0.02
    p, field = dipole_curve(volt, x, Polarised(0.03, 0.02))
    assert np.allclose(p, 0.02 / 0.03 * x)
    assert np.allclose(field, volt / 0.02)


def test_capacitor_from_voltage_and_displacement(records: tuple[Recording, Recording]) -> None:
    pairs = [(r.volt, r.x) for r in map(from_rest, records)]
    fits = fit_capacitor(LoopRecords.of(pairs, carried=True), CONSTANTS)
    best = min(fits, key=lambda f: f.held_out)
    assert best.held_out < 30e-9
    total = sum(best.capacitor.breakaways)
    assert total == pytest.approx(sum(ELEMENTS.breakaways), rel=0.05)
    with pytest.raises(UnusableInput):
        fit_capacitor(LoopRecords.of(pairs, carried=True), replace(CONSTANTS, transducer=1.5))


def test_stiffness_and_damping() -> None:
    time = np.arange(2000) / RATE
    force = 50.0 * np.sin(2 * np.pi * time)
    x = force / 62e6 + NOISE * np.random.default_rng(0).standard_normal(time.size)
    units = {"F_e": "N", "x": "m", "V": "V"}
    load = Recording("load", time, {"F_e": force, "x": x, "V": 0.0 * time}, units)
    k = stiffness_from_load(load)
    assert abs(k.value - 62e6) < 3.0 * k.error < 0.01 * 62e6
    with pytest.raises(UnusableInput, match="hold the voltage"):
        stiffness_from_load(Recording("both", time, {"F_e": force, "x": x, "V": force}, units))
    with pytest.raises(UnusableInput, match="turn the sign"):
        stiffness_from_load(Recording("down", time, {"F_e": -force, "x": x, "V": 0 * x}, units))

    gauge = Recording(
        "gauge", time, {"F": -force, "x": x + 1e-8 * time, "V": 0.0 * time},
        {"F": "N", "x": "m", "V": "V"},
    )  # fmt: skip
    assert stiffness_from_load(gauge).value == pytest.approx(62e6, rel=0.01)

    put_on = np.interp(time, [0.9, 1.0], [0.0, -0.5 * 9.80665 / 62e6]) + x - force / 62e6
    upright = Recording("upright", time, {"x": put_on, "V": 0.0 * time}, {"x": "m", "V": "V"})
    k = stiffness_from_weight(upright, 0.5)
    assert abs(k.value - 62e6) < 4.0 * k.error < 0.02 * 62e6
    nothing = Recording("still", time, {"x": x - force / 62e6, "V": 0 * x}, {"x": "m", "V": "V"})
    with pytest.raises(UnusableInput, match="no step of x stands out"):
        stiffness_from_weight(nothing, 0.5)
    with pytest.raises(UnusableInput, match="--weight -1"):
        stiffness_from_weight(upright, -1.0)

    fast = np.arange(6000) / 400e3
    step = np.where(fast < 1e-3, 0.0, 5.0)
    mass, damping = 5.3e-3, 120.0
    graph = stack_lumped(None, stiffness=62e6, mass=mass, damping=damping)
    ringing = simulate(graph, fast, {"V_in": step})["x"]
    ringing = ringing + 1e-10 * np.random.default_rng(0).standard_normal(fast.size)
    found = fit_step(Recording("step", fast, {"V": step, "x": ringing}, {"V": "V", "x": "m"}))
    assert found.stiffness(mass).value == pytest.approx(62e6, rel=0.01)
    assert found.damping(mass).value == pytest.approx(damping, rel=0.02)


def test_file(identified: Identification, tmp_path: Path) -> None:
    path = tmp_path / "stack.json"
    identified.stack.save(path)
    assert IdentifiedStack.open(path) == identified.stack
    data = json.loads(path.read_text(encoding="utf-8"))
    bad = (
        ({"format": "x"}, "no identified stack"),
        ({"transducer": {"value": -1.0, "ci95": [0, 1]}}, "must be positive"),
        ({"operator": {"kind": "bouc_wenn"}}, "bouc_wenn"),
        ({"operator": {"kind": "dahl"}}, "dahl"),
        ({"high": -5.0}, "no range"),
        ({"colour": 1}, "colour"),
        ({"rms": None}, "rms"),
        ({"capacitance": 0.0}, "above 0"),
    )
    for change, said in bad:
        with pytest.raises(UnusableInput, match=said) as error:
            IdentifiedStack.from_dict({**data, **change})
        assert "\n" not in str(error.value)
    data.pop("noise")
    with pytest.raises(UnusableInput, match="'noise'"):
        IdentifiedStack.from_dict(data)


def test_the_voltage_makes_the_target(identified: Identification) -> None:
    s = identified.stack
    rate, history = 2000.0, s.trained
    time = np.arange(4000) / rate
    target = 1.5e-6 * (1.0 - np.cos(2 * np.pi * time)) * (1.0 - 0.2 * time)
    made = compensation(s, target, rate, UNIPOLAR)
    # independent of the operator: the true stack behind the same stroke, with the lag given back
    before = np.interp(np.arange(0, 1, 1 / rate), [0.0, 0.5, 1.0], history)
    volt = np.concatenate((before, made.inverse))
    x = simulate(stack(), np.arange(volt.size) / rate, {"V_in": volt})["x"][before.size :]
    error = x - x[0] - target
    assert np.sqrt(np.mean(error**2)) < 0.003 * np.ptp(target)
    with pytest.raises(VoltageLimit, match=r"um at sample \d+ needs .* this stack goes from 0 to"):
        compensation(s, 3.0 * target, rate, UNIPOLAR)
    with pytest.raises(UnusableInput, match="begin at 0"):
        compensation(s, target + 1e-6, rate, UNIPOLAR)
    dead = AlJanaideh(q=1e-8, c=1.0, sigma=5.0, alpha=-9e-9, beta=0.0, count=3)
    with pytest.raises(NotInvertible, match="no inverse"):
        compensation(replace(s, operator=dead), target, rate, UNIPOLAR)


@pytest.mark.parametrize(
    ("volt", "said"),
    [
        (np.linspace(0, 100, 500), "rest before the voltage moves.*--rest"),
        (np.append(np.full(50, 50.0), np.linspace(50, 100, 500)), "from 0 V on"),
        (np.append(np.zeros(50), np.linspace(0, -20, 500)), "record the loading upwards"),
        (np.zeros(500), "constant"),
    ],
)
def test_records_that_cannot_be_used(volt: np.ndarray, said: str) -> None:
    made = recording("take", volt, 5e-8 * volt)
    with pytest.raises(UnusableInput, match=said) as error:
        identify_stack([made], Interval.of(65e6, 0.0))
    assert "\n" not in str(error.value)
    with pytest.raises(UnusableInput, match="at least one recording"):
        identify_stack([], Interval.of(65e6, 0.0))


def test_numbers_without_an_interval_are_told_and_saved(
    identified: Identification, tmp_path: Path
) -> None:
    loose = FittedNumber("wf_1", 2e-9, None, "no sample of the record depends on it")
    stack = replace(identified.stack, numbers=(loose, *identified.stack.numbers[1:]))
    assert "wf_1     2e-09 [not determined: no sample" in str(replace(identified, stack=stack))
    stack.save(tmp_path / "stack.json")
    assert IdentifiedStack.open(tmp_path / "stack.json").numbers == stack.numbers
    # a file in which all is determined is as it was
    assert all("reason" not in n for n in identified.stack.to_dict()["numbers"])


def test_recordings_at_two_rates_are_refused(records: tuple[Recording, Recording]) -> None:
    ramp, loops = records
    slow = Recording(
        "slow loops", loops.time[::2], {c: loops[c][::2] for c in loops.channels}, loops.units
    )
    with pytest.raises(UnusableInput, match="slow loops: is sampled at 500 Hz, ramp at 1000") as e:
        identify_stack([ramp, slow], Interval.of(65e6, 0.0), counts=(4,))
    assert "\n" not in str(e.value)
