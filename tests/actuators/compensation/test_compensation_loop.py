"""Open and closed loop on the virtual actuator and on the bench; the command."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from actuators.compensation import (
    AdaptiveInverse,
    AnalyticMotion,
    ControlLoop,
    DriveLimits,
    ProportionalIntegral,
    SlidingMode,
    actuator_like,
    deviating,
    feedforward,
    linear_operator,
    model_voltages,
    run_loop,
    strategies,
    thesis_reference,
    tracking,
)
from actuators.compensation.study import compensation_study
from bondgraph.hysteresis import AlJanaideh, Ang
from bondgraph.support.errors import UnusableInput
from bondsight.cli.compensate import bench_response
from bondsight.cli.main import main

MODEL, OTHER = AlJanaideh.stack_2hz(), Ang.stack_2hz()
RATE = 20_000.0
NOMINAL = actuator_like(MODEL)
GAINS = ProportionalIntegral(0.0037, 1058.0)


def reference(frequency: float) -> tuple[AnalyticMotion, AnalyticMotion]:
    time = np.arange(round(2.0 * RATE / frequency) + 1) / RATE
    return thesis_reference(time, frequency), thesis_reference(time + 0.5 / RATE, frequency)


@pytest.fixture(scope="module")
def table() -> dict[tuple[str, str], Any]:
    """Tracking at 20 Hz of every strategy on every actuator."""
    wanted, ahead = reference(20.0)
    noise = 2e-9 * np.random.default_rng(1).standard_normal(wanted.x.size)
    gain = float(wanted.x.max() / feedforward(MODEL, wanted.x).max())
    loops = strategies(MODEL, OTHER, gain, GAINS)
    return {
        (name, scenario): tracking(
            wanted.x, run_loop(loop, actuator, wanted.x, noise, preview=ahead.x).x
        )
        for name, loop in loops.items()
        for scenario, actuator in deviating(NOMINAL).items()
    }


def test_the_right_inverse_leaves_the_dynamics_only(table: Any) -> None:
    assert table["linear feedforward", "as modelled"].rms > 300e-9
    assert table["Al Janaideh inverse", "as modelled"].rms < 10e-9
    assert 40e-9 < table["Ang inverse", "as modelled"].rms < 70e-9


@pytest.mark.parametrize(
    ("scenario", "loop"),
    # a loop that grows with the rate is what an inverse without rate cannot take away
    [("+-10 %", 0.35), ("creep", 0.35), ("amplifier", 0.35), ("rate", 0.4), ("all", 0.4)],
)
def test_robustness(table: Any, scenario: str, loop: float) -> None:
    """The inverse straightens the loop of an actuator it does not fit; feedback does the rest."""
    linear, inverse = (table[n, scenario] for n in ("linear feedforward", "Al Janaideh inverse"))
    assert inverse.rms < 0.5 * linear.rms
    assert inverse.thickness < loop * linear.thickness
    both = table["PI + inverse", scenario]
    assert both.rms < 0.5 * table["PI + linear", scenario].rms
    assert both.rms < 0.1 * table["PI alone", scenario].rms
    assert both.rms < 0.25 * max(inverse.rms, 20e-9)
    assert table["sliding + inverse", scenario].rms < 1.1 * both.rms
    for learning in ("adaptive inverse", "PI + adaptive"):
        assert table[learning, scenario].rms < 0.25 * max(inverse.rms, 20e-9)


def test_dynamics_in_the_inverse() -> None:
    """The whole model's inverse takes the lag away that the operator's leaves."""
    wanted, ahead = reference(100.0)
    voltages = model_voltages(MODEL, NOMINAL, ahead)
    whole = tracking(wanted.x, NOMINAL.run(voltages["bond graph inverse"], RATE))
    plain = tracking(wanted.x, NOMINAL.run(feedforward(MODEL, ahead.x), RATE))
    assert plain.rms > 15e-9
    assert whole.rms < 0.05 * plain.rms
    # a Maxwell model identified on another record is worse, yet better than none
    other = tracking(wanted.x, NOMINAL.run(voltages["lumped inverse"], RATE))
    assert 40e-9 < other.rms < 120e-9


def test_the_bench_says_the_same() -> None:
    """Independent equations and integrator: the improvement is not an artefact of the actuator."""
    wanted, _ = reference(100.0)
    gain = float(wanted.x.max() / feedforward(MODEL, wanted.x).max())
    aged = NOMINAL.aged(1, 0.1)
    errors = {}
    for name, operator in (("linear", linear_operator(gain)), ("inverse", MODEL)):
        voltage = feedforward(operator, wanted.x)
        x = bench_response(aged, voltage, RATE)
        errors[name] = tracking(wanted.x, x)
        # held from sample to sample lags the bench's straight lines by half a sample
        held = aged.run(voltage, RATE)
        middle = np.interp(wanted.time - 0.5 / RATE, wanted.time, x)
        assert np.abs(held - middle)[5:].max() < 5e-9
    assert errors["inverse"].rms < 0.4 * errors["linear"].rms
    assert errors["inverse"].thickness < 0.35 * errors["linear"].thickness


def test_open_loop_is_the_feedforward() -> None:
    wanted, ahead = reference(50.0)
    run = run_loop(ControlLoop(MODEL), NOMINAL, wanted.x, preview=ahead.x)
    voltage = feedforward(MODEL, ahead.x)
    assert not run.clipped.any()
    assert np.abs(run.voltage - voltage).max() < 1e-10
    assert np.abs(run.x - NOMINAL.run(voltage, RATE)).max() < 1e-18


def test_limits_in_the_loop() -> None:
    """Held at 60 V for a while, flagged, and back on the reference afterwards."""
    wanted, ahead = reference(5.0)
    for actuator in (NOMINAL, NOMINAL.aged(1, 0.1)):
        loop = ControlLoop(MODEL, GAINS, envelope=DriveLimits(0.0, 60.0))
        run = run_loop(loop, actuator, wanted.x, preview=ahead.x)
        assert run.voltage.max() == 60.0
        assert 0.2 < run.clipped.mean() < 0.8
        after = np.flatnonzero(run.clipped)[-1] + 200  # 10 ms later
        error = np.abs(wanted.x - run.x)
        assert error[run.clipped].max() > 500e-9
        assert error[after:].max() < 20e-9


def test_a_wrong_loop_is_learnt_and_kept() -> None:
    """Weights that start far off follow the actuator; the error of the second period shows it."""
    wanted, ahead = reference(20.0)
    off = AlJanaideh(0.8 * MODEL.q, MODEL.c, MODEL.sigma, 1.3 * MODEL.alpha, MODEL.beta, 10)
    half = wanted.x.size // 2
    errors = {}
    for name, model in (("held", off), ("learnt", AdaptiveInverse(off, spread=0.1))):
        run = run_loop(ControlLoop(model), NOMINAL, wanted.x, preview=ahead.x)
        errors[name] = np.abs(wanted.x - run.x)[half:].max()
    assert errors["held"] > 100e-9
    assert errors["learnt"] < 0.1 * errors["held"]


def test_sliding_mode_runs_at_its_rate_and_no_faster() -> None:
    law = SlidingMode(rate=1e-3, layer=1e-7, surface=50.0)
    state = np.zeros(2)
    for k in range(1, 6):
        added, state = law.decide(1e-5, state, 1e-3)
        assert float(added) == pytest.approx(k * 1e-6)
    inside, _ = law.decide(1e-9, np.zeros(2), 1e-3)
    assert float(inside) == pytest.approx(1e-3 * 1e-3 * (1e-9 + 50.0 * 1e-12) / 1e-7)
    with pytest.raises(UnusableInput, match="layer"):
        SlidingMode(1.0, 0.0, 1.0)
    with pytest.raises(UnusableInput, match="spread"):
        AdaptiveInverse(MODEL, spread=0.0)


def test_bad_records() -> None:
    x = np.zeros(10)
    with pytest.raises(UnusableInput, match="one length"):
        run_loop(ControlLoop(MODEL), NOMINAL, x, np.zeros(9))
    with pytest.raises(UnusableInput, match="finite"):
        run_loop(ControlLoop(MODEL), NOMINAL, np.full(10, np.nan))


def test_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    figure = tmp_path / "compensation.svg"
    assert main(["compensate", "--frequency", "100", "--out", str(figure)]) == 0
    text = capsys.readouterr().out
    rows = {line[:20].strip(): line[20:].split() for line in text.splitlines() if "/" in line[20:]}
    best, worst = (
        [float(cell.split("/")[0]) for cell in rows[n]] for n in ("PI + inverse", "PI + linear")
    )
    assert len(best) == 6
    assert all(0.0 < b < 0.7 * w for b, w in zip(best, worst, strict=True))
    assert "gain margin" in text
    assert figure.read_text(encoding="utf-8").count("<path") > 10
    assert main(["compensate", "--out", str(tmp_path / "x.gif")]) == 2
    assert "compensate" in capsys.readouterr().err
    bad: tuple[dict[str, Any], ...] = ({"frequencies": (5000.0,)}, {"spread": 0.9})
    for options in bad:
        with pytest.raises(UnusableInput, match="compensate"):
            compensation_study(**options)
