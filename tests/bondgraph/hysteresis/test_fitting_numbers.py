"""Al Janaideh's and Ang's operators from records: all numbers, sizes, creep and delay."""

from __future__ import annotations

import numpy as np
import pytest

from bondgraph.hysteresis import (
    AlJanaideh,
    Ang,
    DeadZones,
    KelvinVoigtCreep,
    Operator,
    PrandtlIshlinskii,
)
from bondgraph.hysteresis.errors import BadInput, BadParameter
from bondgraph.hysteresis.fitting.al_janaideh import fit_al_janaideh
from bondgraph.hysteresis.fitting.ang import fit_ang
from bondgraph.hysteresis.fitting.creep_behind import forward_creep, without_creep
from bondgraph.hysteresis.fitting.held_out import choose_operator
from bondgraph.hysteresis.fitting.loop_records import LoopRecords
from bondgraph.hysteresis.fitting.numbered import NumberedFit, NumberedPoint, intervals

NOISE = 2e-9
RATE = 1000.0
ALJ, ANG = AlJanaideh.stack_2hz(), Ang.stack_2hz()
TIME = np.arange(2500) / RATE


def loops(low: float = 0.4) -> np.ndarray:
    """Strokes of 2 Hz from 0 V, of falling height."""
    return np.asarray(
        50.0 * (1.0 - np.cos(4.0 * np.pi * TIME)) * np.interp(TIME, [0.0, 0.5, 2.5], [1, 1, low])
    )


def noisy(operator: Operator, u: np.ndarray, seed: int = 0) -> np.ndarray:
    return operator.run(u)[0] + NOISE * np.random.default_rng(seed).standard_normal(u.size)


def number(fit: NumberedFit[Ang] | NumberedFit[AlJanaideh], name: str) -> tuple[float, float]:
    """Value and standard error."""
    found = next(n for n in fit.numbers if n.name == name)
    assert found.ci95 is not None
    return found.value, (found.ci95[1] - found.ci95[0]) / (2 * 1.96)


def test_ang_with_the_right_thresholds_reaches_the_noise_and_with_wrong_ones_does_not() -> None:
    """The reference says 1.99 nm with the right d', 2.3 to 3.1 nm with wrong ones."""
    u = 50.0 * (1.0 - np.cos(4.0 * np.pi * np.arange(6250) / 3125.0))
    records = LoopRecords.of([(u, noisy(ANG, u))])
    fit = fit_ang(records, 12)
    assert fit.rms == pytest.approx(1.99e-9, abs=0.04e-9)
    # w_s0 = 1 is the gauge: stages trade the printed 1.47
    d, error = number(fit, "d_1")
    assert abs(d - 1.47 * 342.58e-9) < 3.5 * error
    bend, error = number(fit, "ws_1")
    assert abs(bend - 0.21 / 1.47) < 3.5 * error
    for i, w in enumerate(ANG.play.weights[:11]):
        value, error = number(fit, f"wf_{i}")
        assert abs(value - 1.47 * w) < 4.0 * error, i
    assert fit_ang(records, 10).rms > 2.3e-9
    assert fit_ang(records, 12, 0).rms > 2.3e-9


def test_two_dead_zones_have_a_spacing() -> None:
    zones = DeadZones((0.0, 0.5e-6, 2.0e-6, 3.5e-6), (1.0, 0.2, -0.3, 0.25))
    truth = Ang(
        PrandtlIshlinskii(tuple(50.0 * i / 6 for i in range(7)), (3e-8, *[4e-9] * 6)), zones
    )
    u = loops()
    fit = fit_ang(LoopRecords.of([(u, noisy(truth, u))]), 6, 3, reach=50.0)
    assert fit.rms < 1.1 * NOISE
    for name, value in {"d_1": 0.5e-6, "sigma_d": 1.5e-6, "ws_2": -0.3}.items():
        found, error = number(fit, name)
        assert abs(found - value) < 4.0 * error, name


def test_al_janaideh_with_all_its_numbers() -> None:
    u = loops()
    fit = fit_al_janaideh(LoopRecords.of([(u, noisy(ALJ, u))]), 10)
    assert fit.rms == pytest.approx(NOISE, rel=0.05)
    # c = 1 is the gauge
    truth = {"q": ALJ.q * ALJ.c, "sigma_r": ALJ.sigma / ALJ.c}
    truth |= {"alpha": ALJ.alpha * ALJ.c, "beta": ALJ.beta * ALJ.c}
    for name, value in truth.items():
        found, error = number(fit, name)
        assert abs(found - value) < 3.5 * error, name
        assert found == pytest.approx(value, rel=0.01), name


@pytest.mark.parametrize("operator", [ALJ, ANG], ids=["al_janaideh", "ang"])
def test_memory_is_carried_from_record_to_record(operator: Ang | AlJanaideh) -> None:
    first, second = np.append(loops(), 0.0), loops(0.7)
    whole = noisy(operator, np.concatenate((first, second)))
    later = whole[first.size :]
    pairs = [(first, whole[: first.size]), (second, later - later[:5].mean())]
    errors = {}
    for carried in (True, False):
        records = LoopRecords.of(pairs, carried=carried)
        fit = fit_ang(records, 12) if operator is ANG else fit_al_janaideh(records, 10)
        assert records.misfit(fit.operator) == pytest.approx(fit.rms)
        errors[carried] = fit.rms
    assert errors[True] < 1.1 * NOISE < 0.5 * errors[False]


def test_plays_and_their_derivatives() -> None:
    u = loops()
    records = LoopRecords.of([(u, ALJ.run(u)[0])])
    r, h = np.array([3.0, 20.0, 60.0]), 1e-6
    at, ahead, behind = (records.plays(r + d)[0] for d in (0.0, h, -h))
    numeric = (ahead.columns - behind.columns)[:, 1:] / (2 * h)
    # at a corner the two sides differ
    assert np.mean(np.abs(numeric - at.sides[:, 1:]) > 1e-3) < 0.02
    thin = records.thinned(100)
    assert thin.size <= 110
    assert np.allclose(thin.plays(r)[0].columns, at.columns[:: records.size // 100])


def test_size_is_chosen_by_held_out_error() -> None:
    u = loops()
    choice = choose_operator(
        LoopRecords.of([(u, noisy(ANG, u)), (loops(0.7), noisy(ANG, loops(0.7), 1))]),
        counts=(4, 12, 16), zones=(0, 1),
    )  # fmt: skip
    assert isinstance(choice.fit.operator, Ang)
    chosen = choice.best("ang")
    assert (chosen.plays, chosen.zones) == (12, 1)
    assert choice.fit.held_out < 1.2 * NOISE
    assert choice.best("al_janaideh").held_out > 5 * NOISE
    least = {t.plays: t.rms for t in choice.tried if t.kind == "al_janaideh"}
    assert least[4] > least[12]


def test_creep_and_delay_are_taken_out_or_left_alone() -> None:
    rng = np.random.default_rng(3)
    u = np.concatenate((np.zeros(200), loops(), np.zeros(500), loops(0.6), np.zeros(800)))
    creep = KelvinVoigtCreep(1.0, (0.03, 0.02), (0.06, 0.6))
    late = np.interp(np.arange(u.size) - 1.3, np.arange(u.size), u)
    h = ALJ.run(late)[0]
    y = creep.run(h, creep.initial_memory(0.0), step=1 / RATE)[0]
    y = y + NOISE * rng.standard_normal(y.size)
    found = without_creep(LoopRecords.of([(u, y)]), 1 / RATE)
    assert found.creep is not None
    assert found.delay == pytest.approx(1.3, abs=0.35)
    # what matters is the creep as a whole: the answer to a step
    step = np.append(np.zeros(2), np.ones(1500))
    answers = [c.run(step, c.initial_memory(0.0), step=1 / RATE)[0] for c in (creep, found.creep)]
    assert np.abs(answers[0] - answers[1])[100:].max() < 0.004
    assert np.sqrt(np.mean((found.records.outputs[0] - h) ** 2)) < 8e-9
    plain = ALJ.run(u)[0] + NOISE * rng.standard_normal(u.size)
    assert without_creep(LoopRecords.of([(u, plain)]), 1 / RATE).creep is None
    # what mostly comes late is a lag, not creep
    lag = KelvinVoigtCreep(0.3, (0.9,), (0.3,))
    late = lag.run(ALJ.run(u)[0], lag.initial_memory(0.0), step=1 / RATE)[0]
    assert without_creep(LoopRecords.of([(u, late)]), 1 / RATE).creep is None


def test_the_inverse_of_creep_is_creep() -> None:
    """``C (1 - sum c' L') = 1`` at any frequency."""
    weights, times = np.array([0.02, 0.0, 0.05]), np.array([0.05, 0.4, 5.0])
    creep = forward_creep(weights, times)
    assert len(creep.times) == 2
    for s in (0.01j, 1.0j, 30.0j):
        backward = 1.0 - np.sum(weights / (1.0 + times * s))
        forward = 1.0 + np.sum(np.array(creep.weights) / (1.0 + np.array(creep.times) * s))
        assert forward * backward == pytest.approx(1.0)


def test_numbers_that_the_record_does_not_determine_have_no_interval() -> None:
    """A play wider than the record goes never moves; its weight was told with an interval of 0."""
    x = 5.0 * np.sin(np.linspace(0.0, 9.0, 200))
    y = PrandtlIshlinskii((0.0, 2.5), (1.0, 0.5)).run(x)[0]
    y = y + 1e-2 * np.random.default_rng(0).standard_normal(x.size)
    fit = fit_ang(LoopRecords.of([(x, y)]), 2, 0, reach=8.0)
    wide = {n.name: n for n in fit.numbers}["wf_2"]
    assert wide.ci95 is None
    assert wide.reason == "no sample of the record depends on it"
    assert all(n.ci95 and n.ci95[0] < n.ci95[1] and not n.reason for n in fit.numbers if n != wide)


def test_numbers_that_trade_with_each_other_have_no_interval() -> None:
    columns = np.random.default_rng(1).standard_normal((50, 3))
    columns = np.column_stack((columns, columns[:, 0] - 2.0 * columns[:, 2]))
    residual = 0.1 * np.random.default_rng(2).standard_normal(50)
    point = NumberedPoint(np.ones(4), residual, 1e-9 * columns, 0.1)
    found = intervals(point, ("a", "b", "c", "d"))
    assert [n.ci95 is None for n in found] == [True, False, True, True]
    assert found[0].reason == "the record tells only combinations of it with c, d"
    alone = intervals(NumberedPoint(np.ones(3), residual, 1e-9 * columns[:, :3], 0.1), tuple("abc"))
    assert found[1].ci95 == pytest.approx(alone[1].ci95, rel=0.02)


def test_dead_zones_of_an_output_below_zero_are_refused() -> None:
    x = -2.0 + 2.0 * np.cos(np.linspace(0.0, 9.0, 200))
    records = LoopRecords.of([(x, PrandtlIshlinskii((0.0, 1.0), (1.0, 0.5)).run(x)[0])])
    with pytest.raises(BadInput, match="never lies above 0"):
        fit_ang(records, 2, 1)
    assert choose_operator(records, ("ang",), counts=(2,)).fit.rms < 1e-4


def test_what_cannot_be_fitted_says_so() -> None:
    u = loops()
    records = LoopRecords.of([(u, ALJ.run(u)[0])])
    with pytest.raises(BadInput, match="no records"):
        LoopRecords.of([])
    with pytest.raises(BadInput, match="falls where"):
        LoopRecords.of([(u, -u)])
    with pytest.raises(BadParameter, match="at least one play"):
        fit_al_janaideh(records, 0)
    with pytest.raises(BadParameter, match="zones = -1"):
        fit_ang(records, 4, -1)
    with pytest.raises(BadParameter, match="reach"):
        fit_ang(records, 4, reach=0.0)
