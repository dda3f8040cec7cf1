"""The fit of the model as it is: plants that run away are judged on the whole record."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from bondgraph import TF, BondGraph, C, Df, Dq, I, One, R, Se, Zero
from bondgraph.laws import Coulomb
from bondgraph.signals.recording import Recording
from bondgraph.signals.split import interleaved
from identification.diagnosis.localisation.regions import regions
from identification.diagnosis.screening.observation import scene
from identification.diagnosis.search import nominal
from identification.diagnosis.search.asked import asked_of
from identification.diagnosis.search.hold_choice import hold_margin
from identification.diagnosis.search.material import material_of
from identification.diagnosis.search.nominal import integrates, nominal_fit
from identification.estimation.levenberg_marquardt import FitStatus
from identification.estimation.single_record import Fit, fit
from identification.study.data import Data
from tests.settled import simulate

N, DT, NOISE = 1500, 0.02, 1e-4


def cart(*, spring: bool = False, speed: bool = False) -> BondGraph:
    with BondGraph("cart") as g:
        v = One("v")
        Se("F", unit="N") >> v >> I("m", 0.8, unit="kg")
        v >> R("d", 1.1, unit="N*s/m")
        if spring:
            v >> C("k", stiffness=9.0, unit="N/m")
        v >> (Df("y", unit="m/s") if speed else Dq("y", unit="m"))
    return g


def ring() -> BondGraph:
    """Two springs side by side between the same masses, one of which stands."""
    with BondGraph("ring") as g:
        v, gap = One("v"), Zero("gap")
        Se("F", unit="N") >> v >> I("m", 0.8, unit="kg")
        v >> gap >> C("k_1", stiffness=9.0, unit="N/m")
        gap >> One("w") >> C("k_2", stiffness=5.0, unit="N/m")
        v >> R("d", 1.1, unit="N*s/m")
        v >> Dq("y", unit="m")
    return g


def test_what_integrates() -> None:
    assert integrates(cart())
    assert not integrates(cart(spring=True))
    assert not integrates(cart(speed=True))
    assert not integrates(ring())


@cache
def fitted(drift: float, begin: float = 0.0) -> Fit:
    """A cart that rolls; the force drifts by `drift` (N) over the record, unseen."""
    t = np.asarray(DT * np.arange(N), np.float64)
    u = 2 * np.sin(2 * np.pi * 0.4 * t) + np.sin(2 * np.pi * 1.3 * t + 1)
    true = u + drift * (t / t[-1]) ** 2
    y = np.asarray(simulate(cart(), t, {"F": true})["y"]) + begin
    y = (y + NOISE * np.random.default_rng(1).standard_normal(N))[:, None]
    data = Data("run", t, {"F": u}, y, ("y",), np.array([NOISE]), interleaved(0, N))
    model = cart().with_values({"m": 1.0, "d": 0.8})
    return nominal_fit(model, data, "linear")[1]


@pytest.mark.parametrize("begin", [0.0, 3.0])
def test_a_plant_that_runs_away_is_fitted_in_one_piece(begin: float) -> None:
    made = fitted(0.0, begin)
    assert made.problem.window is None
    assert made.point.states.shape[0] == 1
    assert made.chi2("train") == pytest.approx(1.0, abs=0.15)
    assert made.chi2("test") == pytest.approx(1.0, abs=0.2)
    assert made.values["m"] == pytest.approx(0.8, rel=0.01)
    assert made.values["d"] == pytest.approx(1.1, rel=0.01)


def wheels() -> BondGraph:
    """Two inertias on one stiff shaft: of their dampings only the sum is plain to see."""
    with BondGraph("wheels") as g:
        near, far, shaft, twist = One("near"), One("far"), Zero("shaft"), One("twist")
        Se("T", unit="N*m") >> near >> I("J_1", 2e-4, unit="kg*m2")
        near >> R("b_1", 2e-3, unit="N*m*s")
        near >> shaft >> far >> I("J_2", 6e-4, unit="kg*m2")
        far >> R("b_2", 3e-3, unit="N*m*s")
        shaft >> twist >> C("k", stiffness=40.0, unit="N*m/rad")
        twist >> R("b_c", 8e-3, unit="N*m*s")
        near >> Dq("a", unit="rad")
        far >> Df("w", unit="rad/s")
    return g


def test_a_bent_valley_is_followed_to_its_end() -> None:
    """The sum of two dampings is known to four digits, their difference hardly."""
    true = {"b_1": 2.4e-3, "b_2": 2.5e-3, "J_1": 1.7e-4, "J_2": 5e-4, "k": 50.0}
    t = np.asarray(1e-3 * np.arange(2500), np.float64)
    u = np.asarray(0.3 * np.sin(2 * np.pi * (1 + 10 * t) * t), np.float64)
    made = simulate(wheels().with_values(true), t, {"T": u})
    rng = np.random.default_rng(2)
    noise = [1e-4 * float(np.std(made[n])) for n in ("a", "w")]
    y = np.column_stack(
        [made[n] + s * rng.standard_normal(2500) for n, s in zip("aw", noise, strict=True)]
    )
    data = Data("run", t, {"T": u}, y, ("a", "w"), np.array(noise), interleaved(0, 2500))
    found = nominal_fit(wheels().with_values({"b_1": 3e-4, "b_2": 9e-3}), data, "linear")[1]
    assert found.status is FitStatus.CONVERGED
    assert found.chi2("train") < 1.006  # no valley where steps are only shortened ends so low
    assert found.values["b_1"] + found.values["b_2"] == pytest.approx(4.9e-3, rel=2e-3)


def test_what_happens_slowly_is_not_thrown_away() -> None:
    """Short windows, each from a state of its own, would follow it."""
    made = fitted(0.01)
    assert made.problem.window is None
    assert made.chi2("test") > 9.0


def test_a_model_that_jumps_is_simulated_finely_enough_to_be_judged() -> None:
    """A jump within a step is known to its end only: that error is no physics."""
    n = 700
    t = np.asarray(DT * np.arange(n), np.float64)
    u = 2 * np.sin(2 * np.pi * 0.4 * t) + np.sin(2 * np.pi * 1.3 * t + 1)
    rubbing = cart(spring=True).with_element("d", law=Coulomb(1.0))
    y = np.asarray(simulate(rubbing, t, {"F": u}, accuracy=1e-6)["y"])
    y = (y + NOISE * np.random.default_rng(1).standard_normal(n))[:, None]
    data = Data("run", t, {"F": u}, y, ("y",), np.array([NOISE]), interleaved(0, n))
    made = nominal_fit(rubbing, data, "linear")[1]
    assert made.problem.n_sub > 1
    assert made.chi2("train") < 2.0
    coarse = fit(replace(made.problem, n_sub=1), start=made.point, max_iterations=10)
    assert coarse.chi2("train") > 5 * made.chi2("train")


def test_regions_of_a_fit_whose_search_worked_on_thinned_samples() -> None:
    made = fitted(0.5)
    thin = replace(made.problem, data=made.problem.data.thinned(2), built=None)
    found = regions(made, scene(fit(thin, max_iterations=3)), ["d"])
    assert found
    assert found == regions(fit(thin, max_iterations=3), scene(fit(thin, max_iterations=3)), ["d"])


def stepped(noise: float) -> Fit:
    """A cart on a spring under random steps that a converter holds."""
    rng = np.random.default_rng(4)
    t = np.asarray(DT * np.arange(N), np.float64)
    u = np.repeat(rng.uniform(-2, 2, N // 10), 10)
    y = np.asarray(simulate(cart(spring=True), t, {"F": u}, hold="hold")["y"])
    y = (y + noise * rng.standard_normal(N))[:, None]
    data = Data("run", t, {"F": u}, y, ("y",), np.array([noise]), interleaved(0, N))
    return nominal_fit(cart(spring=True), data)[1]


def test_how_surely_the_commands_are_held_is_told() -> None:
    sure = stepped(1e-5)
    assert sure.problem.data.hold == "hold"
    words = hold_margin(sure, ("hold", "linear"))
    assert words.startswith("linear predicts worse by")
    assert float(words.split()[-3]) > 10
    assert hold_margin(stepped(1.0), ("hold", "linear")).endswith("next to nothing")
    assert hold_margin(sure, ("hold",)) == "as given"


def screw(c: float = 200.0, **values: float) -> BondGraph:
    """A motor turns a screw that moves a carriage through an elastic nut."""
    with BondGraph("screw") as g:
        shaft, carriage, between, nut = One("shaft"), One("carriage"), Zero("between"), One("nut")
        Se("M", unit="N*m") >> shaft >> I("J", 3e-4, unit="kg*m2")
        shaft >> R("b_J", 1e-3, unit="N*m*s/rad")
        shaft >> TF("n", ratio=0.01 / (2 * np.pi), unit="m/rad", fixed=True) >> between
        between >> carriage >> I("m", 55.0, unit="kg")
        carriage >> R("c", c, unit="N*s/m")
        between >> nut >> C("k", stiffness=3e7, unit="N/m")
        nut >> R("d", 5e3, unit="N*s/m")
        shaft >> Dq("phi", unit="rad")
        carriage >> Dq("x", unit="m")
    return g.with_values(values)


def test_a_damper_that_vanished_behind_delays_of_the_sensors_comes_back() -> None:
    """Its logarithm had run so far off that no step brought it back."""
    count, rng = 2500, np.random.default_rng(6)
    t = np.arange(count) / 2000.0
    moment = sum(
        0.3 * np.sin(2 * np.pi * f * t + rng.uniform(0, 6)) for f in rng.uniform(2, 200, 12)
    )
    truth = screw(310.0, J=3.4e-4, b_J=1.8e-3, m=62.0, k=4.2e7, d=9e3)
    seen = simulate(truth, t, {"M": moment}, hold="hold")
    phi = seen["phi"] + 2e-4 * rng.standard_normal(count)
    x = seen["x"] + 4e-7 * rng.standard_normal(count)
    run = Recording.from_arrays("run", {"M[N*m]": moment, "phi[rad]": phi, "x[m]": x}, fs=2000.0)
    asked = asked_of(screw(), run, None, "hold", {})
    data = material_of(asked).data
    made = nominal_fit(asked.graph, data, "hold", asked.problem(data))[1]
    ends = {e.name: e.ci95 for e in made.estimates}
    assert made.values["c"] > 150.0
    assert all(ends[n][0] < truth.parameters[n].value < ends[n][1] for n in ("J", "b_J", "m", "c"))


def test_a_retry_that_fails_leaves_the_fit_as_it_was(monkeypatch: pytest.MonkeyPatch) -> None:
    made = fitted(0.0)

    def broken(*_: object, **__: object) -> Fit:
        raise np.linalg.LinAlgError("derivatives are not finite where the fit ended")

    monkeypatch.setattr(nominal, "_lost", lambda result: {"d"})
    monkeypatch.setattr(nominal, "fit", broken)
    assert nominal.revived(made) is made
