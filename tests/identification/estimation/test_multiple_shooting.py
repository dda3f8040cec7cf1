"""Multiple shooting: the same answer where the free run works, and answers where it does not."""

from __future__ import annotations

import numpy as np
import pytest

from bondgraph.graph.drives import Drive
from bondgraph.graph.parameter import Parameter
from bondgraph.signals.recording import Recording
from bondgraph.support.errors import UnusableInput
from identification.estimation import NO_NUISANCES, FitStatus, Nuisances, Study, Vary, estimate
from tests.identification.estimation.plants import (
    NOISE,
    TRUTH,
    caught,
    falling,
    force,
    misses,
    record,
    spring,
    study,
)
from tests.settled import simulate


def test_same_answer_as_single_shooting() -> None:
    made = study(record(900), record(600, 60.0, 3, name="slow"))
    one, many = estimate(made), estimate(made, "multiple_shooting")
    assert many.status is FitStatus.CONVERGED
    assert many.cost == pytest.approx(one.cost, rel=1e-4)
    for e in one.estimates:
        width = np.diff(e.ci95)[0] / (2 * 1.96)
        other = many.estimate_of(e.name)
        assert abs(other.value - e.value) < 0.02 * width
        assert np.diff(other.ci95)[0] / (2 * 1.96) == pytest.approx(width, rel=0.02)


@pytest.mark.parametrize("options", [{"initial": "rest"}, {"noise": "coloured"}])
@pytest.mark.sampled(every=2)
def test_same_answer_with_other_options(options: dict[str, object]) -> None:
    many = estimate(study(record(500), **options), "multiple_shooting")
    one = estimate(study(record(500), **options))
    for n, t in TRUTH.items():
        assert many.values[n] == pytest.approx(one.values[n], rel=1e-3)
        assert many.values[n] == pytest.approx(t, rel=0.02)


def test_known_initial_states_hold() -> None:
    """All states known and far from rest: the windows must begin there, not at rest."""
    known = {"p_m": 0.0, "q_k": 0.05}
    u = force(500, 100.0, 5)
    run = simulate(spring(), np.arange(500) / 100.0, {"F": u}, x0=np.array(list(known.values())))
    x = run["x"] + NOISE * np.random.default_rng(1).standard_normal(500)
    r = Recording.from_arrays("let go", {"F[N]": u, "x[m]": x}, fs=100.0)
    many = estimate(study(r, initial=known), "multiple_shooting")
    assert many.values == pytest.approx(estimate(study(r, initial=known)).values, rel=1e-6)
    assert max(misses(many, TRUTH).values()) < 4


@pytest.mark.parametrize("seed", [3, 4])
def test_unstable_plant_is_found(seed: int) -> None:
    """The mass falls away within half a second; the record lasts three."""
    found = estimate(
        Study(falling(-15.0), caught(300, seed=seed), hold="hold", nuisances=NO_NUISANCES),
        "multiple_shooting",
    )
    assert found.status is FitStatus.CONVERGED
    truth = {"m": 0.5, "d": 1.0, "t_0_k": 20.0, "t_1_k": 0.0, "t_2_k": -20.0}
    assert max(misses(found, truth).values()) < 3.3
    assert found.rmse()["x"] == pytest.approx(2e-4, rel=0.1)
    assert found.values["t_0_k"] == pytest.approx(20.0, rel=0.01)


def test_single_shooting_is_lost_on_the_unstable_plant() -> None:
    made = Study(falling(-12.0), caught(600), hold="hold", nuisances=NO_NUISANCES)
    found = estimate(made)
    assert found.rmse()["x"] > 10 * 2e-4
    assert any("coloured" in n for n in found.notes)


@pytest.mark.long
def test_long_record_of_an_unstable_plant_keeps_to_its_windows() -> None:
    """Over ten seconds the free run leaves no digit; the windows show the readings instead."""
    made = Study(falling(-15.0), caught(1500), hold="hold", nuisances=NO_NUISANCES)
    found = estimate(made, "multiple_shooting", max_iterations=20)
    assert any("free run diverges" in n for n in found.notes)
    assert found.rmse()["x"] == pytest.approx(2e-4, rel=0.1)
    assert found.values["m"] == pytest.approx(0.5, rel=0.01)
    assert found.values["t_2_k"] == pytest.approx(-20.0, rel=0.02)
    lost = {n for n, s in misses(found, {"m": 0.5, "d": 1.0}).items() if not s < 4.0}
    assert not lost


def test_far_start_is_found() -> None:
    """Three times the frequency: the free run has lost count of the periods."""
    far = ("m", Vary("d", start=0.3), Vary("k", start=2200.0))
    made = study(record(900), free=far)
    found = estimate(made, "multiple_shooting")
    assert max(misses(found, TRUTH).values()) < 3.3
    assert found.cost == pytest.approx(1.0, abs=0.1)


@pytest.mark.long
def test_clock_and_lag_reach_over_the_windows() -> None:
    made = study(record(600, lag=0.15), nuisances=Nuisances(clock=2e-4))
    one, many = estimate(made), estimate(made, "multiple_shooting")
    for name in ("delay x", "clock x", "k"):
        e = one.estimate_of(name)
        width = np.diff(e.ci95)[0]
        assert abs(many.estimate_of(name).value - e.value) < 0.02 * width


def test_what_it_cannot_do_is_refused_with_another_method() -> None:
    with pytest.raises(UnusableInput, match="joins windows of its own"):
        estimate(study(record(100), window=20), "multiple_shooting")
    tau = Parameter("tau", 0.01, "s", lower=0.0)
    late = spring().with_parameters([tau]).with_element("F", drive=Drive(delay="tau"))
    with pytest.raises(UnusableInput, match="single_shooting"):
        estimate(Study(late, record(100)), "multiple_shooting")
    with pytest.raises(UnusableInput, match="runs with gauss_newton"):
        estimate(study(record(100)), "multiple_shooting", optimiser="ipopt")
