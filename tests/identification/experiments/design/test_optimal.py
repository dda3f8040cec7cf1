"""Inputs that determine parameters best: sensitivities, spectra, candidates."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

from bondgraph import BondGraph, De, R, Sf, Zero
from bondgraph.equations.codegen import program_of
from bondgraph.equations.derivation import equations
from bondgraph.graph.elements import CField
from bondgraph.signals.drive_limits import DriveLimits
from bondgraph.simulation.dynamics import GeneralDynamics, dynamics_of
from bondgraph.simulation.lure import compile_model
from bondgraph.support.errors import BondsightError, UnknownName, UnusableInput
from identification.experiments.design import (
    Signal,
    flat_like,
    information_of_signal,
    multisine,
    optimal_multisine,
    rank_signals,
    record_information,
    reversal_curves,
    sweep,
    within,
)
from identification.experiments.design.linear_response import response_and_sensitivity
from tests.identification.experiments.design.plants import NOISE, stage
from tests.identification.study.general_plants import coupled, general, pendulum, tank
from tests.identification.study.test_dynamics import drum
from tests.spring import spring


# -- linear -----------------------------------------------------------------------------------
def test_response_and_sensitivity_by_hand() -> None:
    c = compile_model(spring())
    f = np.array([0.3, 3.0, 3.2, 20.0])
    s = 2j * np.pi * f
    g, dg = response_and_sensitivity(c, c.nominal(), "F", ["x"], f, ["m", "d", "k"])
    expected = 1 / (0.5 * s**2 + 2.0 * s + 200.0)
    assert g[:, 0] == pytest.approx(expected, rel=1e-10)
    by_hand = -(expected**2)[:, None] * np.stack([s**2, s, np.ones(4)], axis=1)
    assert dg[:, 0] == pytest.approx(by_hand, rel=1e-9)


def test_information_of_the_spectrum_is_that_of_the_record() -> None:
    c = compile_model(spring())
    names, scale = ("m", "d", "k"), np.array([0.5, 2.0, 200.0])
    u = multisine(100.0, 1000, band=(0.1, 10.0), periods=6, name="F", unit="N")
    spectral = information_of_signal(c, c.nominal(), u, NOISE, names, scale)
    # a record that begins at rest has its run-in besides
    late = record_information(c, c.nominal(), u, NOISE, names, scale, initial="rest", offsets=False)
    size = np.sqrt(np.outer(np.diag(spectral), np.diag(spectral)))
    assert np.abs(late - spectral).max() < 0.06 * size.max()
    free = record_information(c, c.nominal(), u, NOISE, names, scale)
    assert np.linalg.eigvalsh(late - free).min() > -1e-9 * np.trace(late)


@pytest.mark.parametrize("criterion", ["D", "A"])
def test_optimal_spectrum_beats_others(criterion: str) -> None:
    p = optimal_multisine(
        spring(),
        "F",
        NOISE,
        rate=50.0,
        period=1000,
        band=(0.05, 15.0),
        criterion=criterion,
        rms=2.0,
    )
    assert p.signal.rms == pytest.approx(2.0)
    assert p.flat.rms == pytest.approx(2.0)
    assert p.weights.dispersion.max() < 3 * 1.001
    assert p.weights.of_even < 0.2
    assert all(r.narrower > 1.5 for r in p.expected.rows)
    c = compile_model(spring())
    scale = np.array([0.5, 2.0, 200.0])

    def merit(s: Signal) -> float:
        m = information_of_signal(c, c.nominal(), s, NOISE, ("m", "d", "k"), scale)
        if criterion == "D":
            return float(np.linalg.slogdet(m)[1])
        return -float(np.trace(np.linalg.inv(m)))

    best = merit(p.signal)
    rng = np.random.default_rng(0)
    for _ in range(20):
        lines = rng.choice(np.arange(50, 80), 6, replace=False)
        other = multisine(50.0, 1000, lines=np.sort(lines).tolist(), rms=2.0, name="F", unit="N")
        assert merit(other) < best
    words = str(p)
    assert "kg" in words
    assert "times narrower" in words
    assert "largest dispersion" in words


def test_only_the_chosen_parameters_count() -> None:
    def of(**options: object) -> float:
        made = optimal_multisine(
            spring(), "F", NOISE, rate=50.0, period=1000, band=(0.05, 15.0), **options  # type: ignore[arg-type]
        )  # fmt: skip
        return made.expected["m"].sd

    alone, beside, together = (
        of(chosen=["m"], nuisances=[]), of(chosen=["m"]), of(chosen=["m", "d", "k"])
    )  # fmt: skip
    assert alone < beside <= together * 1.0001


@pytest.mark.long
def test_prior_envelope_corner_and_share() -> None:
    def of(**options: object) -> Signal:
        made = optimal_multisine(
            spring(), "F", NOISE, rate=50.0, period=1000, band=(0.05, 15.0), **options  # type: ignore[arg-type]
        )  # fmt: skip
        return made.signal

    plain, wide = of(), of(prior={"k": 0.2, "d": 0.3}, samples=8)
    assert np.ptp(wide.frequencies) > 1.5 * np.ptp(plain.frequencies)
    room = DriveLimits(-1.0, 1.0, slew=15.0)
    assert within(of(envelope=room), room)
    assert of(corner=1.0).frequencies.mean() < plain.frequencies.mean()
    assert len(of(flat_share=0.2).lines) == 300
    held = of(kind="random_odd")
    assert held.detection
    assert all(k % 2 == 1 for k in held.lines)


def test_bad_designs_say_what() -> None:
    def of(**options: object) -> None:
        known: dict[str, object] = {"noise": NOISE, "rate": 50.0, "period": 1000} | options
        optimal_multisine(spring(), "F", **known)  # type: ignore[arg-type]

    with pytest.raises(UnknownName, match="no parameter 'kk'"):
        of(chosen=["kk"])
    with pytest.raises(UnknownName, match="no sensor"):
        of(noise={"y": 1.0})
    with pytest.raises(UnusableInput, match="noise of x must be positive"):
        of(noise={"x": 0.0})
    with pytest.raises(UnusableInput, match="tell the parameters apart"):
        of(band=(1.0, 1.01))
    with pytest.raises(UnusableInput, match="none twice"):
        of(chosen=["m"], nuisances=["m"])
    with pytest.raises(UnusableInput, match="stiffnesses_0_k does not show"):
        optimal_multisine(stage(), "F", {"x": 1e-6}, rate=1000.0, period=1000)


# -- any model --------------------------------------------------------------------------------
def candidates() -> list[Signal]:
    tour = reversal_curves(50.0, 4, 1000.0, slew=500.0, lowest=-50.0, name="F", unit="N")
    n = tour.values.size
    low = {"name": "F", "unit": "N"}
    return [
        multisine(1000.0, n, band=(0.5, 30.0), peak=5.0, name="F", unit="N"),
        tour,
        sweep(1000.0, 0.5, 30.0, (n - 1) / 1000.0, amplitude=50.0, **low),  # type: ignore[arg-type]
    ]


def test_candidates_for_a_memory() -> None:
    found = rank_signals(stage(), candidates(), {"x": 2e-6}, initial="rest")
    assert found.best.kind == "first-order reversal curves"
    assert found.score[0] > 1.0
    # a drive below every breakaway says nothing of it
    assert found.signals[-1].rms < 3.0
    assert found.score[-1] == 0.0
    assert np.isinf(found.deviations[-1]).all()
    assert "does not determine" in str(found)
    assert found.time_shares is not None
    assert found.time_shares.shares.sum() == pytest.approx(1.0)
    assert found.time_shares.dispersion.max() < 5 * 1.001


def test_one_parameter_beside_nuisances() -> None:
    known = rank_signals(
        stage(), candidates(), {"x": 2e-6}, initial="rest", chosen=["guide"], nuisances=[]
    )
    unknown = rank_signals(stage(), candidates(), {"x": 2e-6}, initial="rest", chosen=["guide"])
    assert known.expected["guide"].sd < unknown.expected["guide"].sd
    mean = rank_signals(
        stage(), candidates()[1:], {"x": 2e-6}, initial="rest", criterion="A",
        prior={"guide": 0.2, "breakaways_0_k": 0.2}, samples=4,
    )  # fmt: skip
    assert mean.score[0] >= mean.score[1] > 0


def test_a_nuisance_that_does_not_show_takes_nothing() -> None:
    tour = reversal_curves(50.0, 4, 1000.0, slew=500.0, lowest=-50.0, name="F", unit="N")
    low = multisine(1000.0, tour.values.size, band=(0.5, 30.0), peak=1.0, name="F", unit="N")
    known, hidden, moved = (
        rank_signals(
            stage(), s, {"x": 2e-6}, initial="rest", chosen=["guide"], nuisances=n, reference=low
        )
        for s, n in (([low], []), ([low], ["breakaways_0_k"]), ([low, tour], ["breakaways_0_k"]))
    )  # fmt: skip
    assert hidden.expected["guide"].sd == pytest.approx(known.expected["guide"].sd, rel=1e-9)
    assert hidden.score == pytest.approx((1.0,))
    assert np.isfinite(moved.deviations).all()
    assert min(moved.score) > 0.0
    assert hidden.time_shares is not None


def test_a_model_of_the_general_engine_is_ranked_too() -> None:
    """A lever that its own displacement turns: no matrix exponential, the same sensitivities."""
    fast = multisine(200.0, 800, band=(0.3, 8.0), peak=30.0, name="F", unit="N")
    slow = multisine(200.0, 800, band=(0.3, 1.0), peak=1.0, name="F", unit="N")
    found = rank_signals(drum(), [slow, fast], {"x": 1e-4})
    assert found.best is fast
    assert found.score[0] > 10 * found.score[1]
    assert found.expected["c"].sd < np.inf
    names, scale = ("m", "d", "k"), np.array([0.5, 2.0, 200.0])
    exact = dynamics_of(spring())
    other = GeneralDynamics(program_of(equations(spring())), spring().parameters)
    one, two = (
        record_information(e, e.vector({}), fast, NOISE, names, scale, n_sub=8)
        for e in (exact, other)
    )
    size = np.sqrt(np.outer(np.diag(one), np.diag(one)))
    assert np.abs(one - two).max() < 0.02 * size.max()
    # no angle of the pendulum carries so much
    heavy = multisine(50.0, 500, band=(0.1, 4.0), bias=4.0, name="T", unit="N*m")
    with pytest.raises(BondsightError, match="no rest"):
        rank_signals(pendulum(), [heavy], {"phi": 1e-3}, initial="rest")
    with pytest.raises(UnknownName, match="no input 'G'"):
        record_information(exact, exact.vector({}), fast, NOISE, names, scale, others={"G": 1.0})


def test_flat_counterpart() -> None:
    tour = candidates()[1]
    flat = flat_like(tour)
    assert flat.rms == pytest.approx(tour.values.std())
    assert flat.values.size == tour.values.size
    assert flat.bias == pytest.approx(tour.values.mean())


def test_bad_candidates_say_what() -> None:
    with pytest.raises(UnusableInput, match="no candidate determines"):
        rank_signals(stage(), candidates()[:1], {"x": 2e-6})
    with pytest.raises(UnusableInput, match="give at least one signal"):
        rank_signals(stage(), [], {"x": 2e-6})
    with pytest.raises(UnknownName, match="no sensor"):
        rank_signals(stage(), candidates(), {"z": 2e-6})
    with pytest.raises(UnknownName, match="initial state"):
        rank_signals(stage(), candidates(), {"x": 2e-6}, initial="zero")


# -- any graph --------------------------------------------------------------------------------
def test_design_of_a_twin_is_that_of_the_linear_graph() -> None:
    asked = {"rate": 80.0, "period": 400, "band": (0.2, 8.0), "chosen": ("k1", "k12")}
    noise = {"x1": 1e-4, "x2": 1e-4}
    made = [
        optimal_multisine(m, "F", noise, **asked)  # type: ignore[arg-type]
        for m in (coupled(), general(coupled()))
    ]
    assert made[1].weights.shares == pytest.approx(made[0].weights.shares, abs=1e-6)
    for n in ("k1", "k12"):
        assert made[1].expected[n].sd == pytest.approx(made[0].expected[n].sd, rel=1e-6)


def test_spectrum_of_small_swings_tells_what_the_record_does() -> None:
    """About a tilted rest: the linearised information is that of the simulated record."""
    dynamics = dynamics_of(pendulum())
    p, names, scale = dynamics.vector({}), ("mgl", "J", "b"), np.array([3.0, 0.05, 0.04])
    u = multisine(50.0, 1000, band=(0.1, 4.0), periods=6, rms=0.02, bias=1.5, name="T", unit="N*m")
    spectral = information_of_signal(dynamics, p, u, {"phi": 1e-3}, names, scale)
    late = record_information(dynamics, p, u, {"phi": 1e-3}, names, scale)
    size = np.sqrt(np.outer(np.diag(spectral), np.diag(spectral)))
    # the record has its offset taken out, and begins at rest
    assert np.abs(late - spectral).max() < 0.15 * size.max()


def test_bias_keeps_the_tanks_from_running_dry() -> None:
    made = optimal_multisine(
        tank(), "Q", {"p1": 3.0, "p2": 1.0}, rate=2.0, period=1000, band=(0.002, 0.2), rms=5e-4,
        bias={"Q": 4e-3}, envelope=DriveLimits(0.0, 8e-3),
    )  # fmt: skip
    assert made.signal.bias == pytest.approx(4e-3)
    assert made.signal.values.min() > 0.0
    assert all(r.narrower > 1.0 for r in made.expected.rows)


def test_without_a_slope_another_rest_is_asked_for() -> None:
    """Half a power of the level has an endless slope at an empty tank."""
    level = sp.Symbol("q1", real=True)
    with BondGraph("funnel") as g:
        node = Zero("node")
        Sf("Q", unit="m^3/s") >> node >> CField("c", law=(1e4 * sp.sqrt(level),), ports=1)
        node >> R("r", 1e6, unit="Pa*s/m^3")
        node >> De("p", unit="Pa")
    with pytest.raises(UnusableInput, match=r"no slope at rest.*bias="):
        optimal_multisine(g, "Q", {"p": 1.0}, rate=1.0, period=100)
    made = optimal_multisine(g, "Q", {"p": 1.0}, rate=1.0, period=100, bias={"Q": 1e-3}, rms=1e-4)
    assert made.expected["r"].sd > 0.0
