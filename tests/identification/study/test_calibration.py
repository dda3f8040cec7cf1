"""Factors on readings and commands: in the equations, fitted within bounds, said at a bound."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import sympy as sp

from bondgraph.equations.derivation import equations
from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import C, I, MSe, One, R, Se
from bondgraph.graph.sensors import Df, Dq
from bondgraph.laws import Rectifier
from bondgraph.signals.recording import Recording
from bondgraph.support.errors import UnknownName, UnusableInput
from identification.estimation import Known, Nuisances, Study, Vary, estimate, guess
from identification.estimation.archive import open_fit, save_fit
from identification.uncertainty.fitted import from_estimation
from tests.settled import simulate
from tests.symbols import closed

N, DT = 3000, 1e-3


def positioner(*, gain: str | None = None, source: str | None = None) -> BondGraph:
    with BondGraph("positioner") as g:
        body = One("body")
        for name in {n for n in (gain, source) if n is not None}:
            g.parameter(name, 1.0)
        Se("F", unit="N", gain=source) >> body >> I("m", 0.5, unit="kg")
        body >> R("d", 4.0, unit="N*s/m")
        body >> C("k", stiffness=2e3, unit="N/m")
        body >> Dq("x", unit="m", gain=gain)
        body >> Df("v", unit="m/s")
    return g


def recorded(
    x: float = 1.0, force: float = 1.0, seed: int = 0, name: str = "r", n: int = N
) -> Recording:
    """Readings of x times too large by `x`; the command acts `force` times too strongly."""
    t = DT * np.arange(n)
    f = 8.0 * np.sin(2 * np.pi * (1.0 + 1.5 * t) * t)
    true = simulate(positioner(), t, {"F": force * f})
    rng = np.random.default_rng(seed)
    channels = {
        "F[N]": f,
        "x[m]": x * np.asarray(true["x"]) + 1e-5 * rng.standard_normal(n),
        "v[m/s]": np.asarray(true["v"]) + 1e-3 * rng.standard_normal(n),
    }
    return Recording.from_arrays(name, channels, fs=1.0 / DT)


def test_gains_stand_in_the_equations() -> None:
    space = closed(equations(positioner(gain="g", source="h")))
    g, h, f = (
        sp.Symbol("g", positive=True),
        sp.Symbol("h", positive=True),
        sp.Symbol("F", real=True),
    )
    force = space.rates["p_m"]
    assert sp.simplify(sp.diff(force, f) - h) == 0
    assert sp.simplify(space.y[0] - g * sp.Symbol("q_k", real=True)) == 0


def test_a_gain_multiplies_what_a_bent_reading_says() -> None:
    t = DT * np.arange(400)
    push = {"F": np.sin(30 * t)}

    def reading(gain: str | None) -> np.ndarray:
        g = positioner(gain=gain).with_element("x", law=Rectifier(0.5))
        return np.asarray(simulate(g, t, push, {gain: 1.25} if gain else {})["x"])

    assert reading("g") == pytest.approx(1.25 * reading(None), rel=1e-9, abs=1e-15)
    assert reading(None).min() > -1e-12
    assert reading(None).max() > 1e-4


def test_gains_are_fitted_beside_the_parameters() -> None:
    gains = {"x": Known(1.0, 0.03), "F": Known(1.0, 0.03)}
    study = Study(
        positioner(), [recorded(1.015, 1.01), recorded(1.015, 1.01, 1, "again")],
        ("d", "k"), nuisances=Nuisances(gains=gains),
    )  # fmt: skip
    found = estimate(study)
    assert found.gains["x"] == pytest.approx(1.015, abs=2e-3)
    assert found.gains["F"] == pytest.approx(1.01, abs=2e-3)
    assert found.values["k"] == pytest.approx(2e3, rel=2e-3)
    assert set(found.values) == {"m", "d", "k"}
    names = [e.name for e in found.nuisances]
    assert names.count("gain_x") == 1  # one sensor: one factor for all recordings
    low, high = found.estimate_of("gain_x").ci95
    assert low < 1.015 < high
    assert found.cost == pytest.approx(1.0, abs=0.1)
    shown = found.predict(recorded(1.015, 1.01, 2, "third"))
    assert np.std(shown[:, 0] - recorded(1.015, 1.01, 2)["x"]) < 2e-5


@pytest.mark.parametrize("method", ["single_shooting", "prediction_error"])
def test_a_recording_without_the_sensor_does_not_lose_its_gain(method: str) -> None:
    without = recorded(1.015)
    without = replace(without, channels={c: without[c] for c in ("F", "v")})
    study = Study(
        positioner(), [without, recorded(1.015, seed=1, name="b")], ("d", "k"),
        nuisances=Nuisances(gains={"x": Known(1.0, 0.03)}),
        validation=recorded(1.015, seed=9, name="c"),
    )  # fmt: skip
    found = estimate(study, method)
    assert found.gains["x"] == pytest.approx(1.015, abs=2e-3)
    assert found.rmse("test", 2)["x"] == pytest.approx(1e-5, rel=0.1)


def test_what_is_said_of_a_fit_agrees_with_its_intervals() -> None:
    """The calibration alone limits m, d and k: 1.5 % each."""
    study = Study(
        positioner(), recorded(force=1.01), ("m", "d", "k"),
        nuisances=Nuisances(gains={"F": Known(1.0, 0.03)}),
    )  # fmt: skip
    s = from_estimation(estimate(study)).sensitivities
    spread = np.sqrt(np.diag(np.linalg.inv(s.jacobian.T @ s.jacobian)))
    assert spread == pytest.approx(0.0148, rel=0.1)


def test_a_guess_fits_the_gains_beside() -> None:
    study = Study(
        positioner(), recorded(1.4), (Vary("d", start=2.0), Vary("k", start=500.0)),
        nuisances=Nuisances(gains={"x": Known(1.0, 0.5)}),
    )  # fmt: skip
    assert guess(study).starts["k"] == pytest.approx(2e3, rel=0.05)


def test_a_width_below_rounding_is_none() -> None:
    study = Study(
        positioner(), recorded(), ("d", "k"), nuisances=Nuisances(gains={"x": Known(1.0, 1e-17)})
    )
    assert estimate(study).gains == {"x": 1.0}


def test_a_gain_of_a_modulated_source_is_refused() -> None:
    with BondGraph("falling") as g:
        g.parameter("g", 3.0)
        body = One("body")
        MSe("G", value=-9.81, gain="g") >> body >> I("m", 0.5)
    assert any("write g into its value" in line for line in g.check())


def test_a_gain_with_a_unit_is_no_wrong_domain() -> None:
    with BondGraph("volts") as g:
        g.parameter("newton_per_volt", 2.0, "N/V")
        g.parameter("volt_per_metre", 50.0, "V/m")
        body = One("body")
        Se("F", unit="V", gain="newton_per_volt") >> body >> I("m", 0.5, unit="kg")
        body >> C("k", stiffness=2e3, unit="N/m")
        body >> Dq("x", unit="V", gain="volt_per_metre")
    assert g.check() == ()


def test_nuisances_stay_a_value() -> None:
    given = {"x": Known(1.0, 0.1)}
    nuisances = Nuisances(gains=given)
    given["F"] = Known(1.0, 0.1)
    assert set(nuisances.gains) == {"x"}
    assert hash(nuisances) == hash(Nuisances(gains={"x": Known(1.0, 0.1)}))
    with pytest.raises(UnusableInput, match="by channel"):
        Nuisances(gains=[("x", Known())])  # type: ignore[arg-type]


def test_a_gain_beside_what_imitates_it_keeps_to_its_bounds() -> None:
    """With m, d and k free nothing determines the factor on the only command."""
    study = Study(
        positioner(), recorded(force=1.01), ("m", "d", "k"),
        nuisances=Nuisances(gains={"F": Known(1.0, 0.03)}),
    )  # fmt: skip
    found = estimate(study)
    assert 0.97 <= found.gains["F"] <= 1.03
    low, high = found.estimate_of("m").ci95
    assert low < 0.5 < high
    assert 0.02 < (high - low) / 0.5 < 0.08  # as uncertain as the calibration


def test_a_gain_of_zero_width_is_exact() -> None:
    study = Study(
        positioner(), recorded(1.02), ("k",), {"m": 0.5, "d": 4.0},
        nuisances=Nuisances(gains={"x": Known(1.02, 0.0)}),
    )  # fmt: skip
    found = estimate(study)
    assert found.gains == {"x": 1.02}
    assert "gain_x" not in {e.name for e in found.nuisances}
    assert found.cost == pytest.approx(1.0, abs=0.1)


def test_a_gain_at_its_bound_is_said() -> None:
    study = Study(
        positioner(), recorded(1.05), ("d", "k"), nuisances=Nuisances(gains={"x": Known(1.0, 0.01)})
    )
    found = estimate(study)
    assert any("gain of x ends at its bound 1.01" in note for note in found.notes)
    wider = estimate(study.changed(nuisances=Nuisances(gains={"x": Known(1.0, 0.1)})))
    assert not any("ends at its bound" in note for note in wider.notes)
    assert wider.gains["x"] == pytest.approx(1.05, abs=3e-3)


@pytest.mark.parametrize("method", ["multiple_shooting", "prediction_error", "collocation"])
def test_every_method_fits_gains(method: str) -> None:
    study = Study(
        positioner(),
        recorded(1.015, n=1000),
        ("d", "k"),
        nuisances=Nuisances(gains={"x": Known(1.0, 0.03)}),
    )
    assert estimate(study, method).gains["x"] == pytest.approx(1.015, abs=2e-3)


def test_a_saved_fit_keeps_its_gains(tmp_path: object) -> None:
    study = Study(
        positioner(),
        recorded(1.015),
        ("d", "k"),
        nuisances=Nuisances(gains={"x": Known(1.0, 0.03)}),
    )
    found = estimate(study)
    save_fit(found, f"{tmp_path}/fit.npz")
    again = open_fit(f"{tmp_path}/fit.npz")
    assert again.gains == pytest.approx(found.gains)
    assert again.study.nuisances == study.nuisances


@pytest.mark.parametrize(
    ("gains", "words"),
    [
        ({"x": 1.02}, "give Known"),
        ({"x": Known(1.0, 0.02), "m": Known(1.0, 0.02)}, "channel"),
    ],
)
def test_gains_that_mean_nothing_are_refused(gains: dict[str, Known], words: str) -> None:
    with pytest.raises((UnusableInput, UnknownName), match=words):
        Study(positioner(), recorded(), ("k",), nuisances=Nuisances(gains=gains))


@pytest.mark.parametrize(
    ("value", "within", "words"),
    [(-1.0, 0.1, "positive factor"), (1.0, 1.5, "fraction"), (1.0, -0.1, "fraction"),
     (float("nan"), 0.1, "gain"), (1.0, float("nan"), "within")],
)  # fmt: skip
def test_factors_that_are_none_are_refused(value: float, within: float, words: str) -> None:
    with pytest.raises(UnusableInput, match=words):
        Known(value, within)


def test_a_model_with_a_gain_of_its_own_keeps_it() -> None:
    with pytest.raises(UnusableInput, match="parameter of the model already"):
        Study(
            positioner(gain="g"), recorded(), ("k",),
            nuisances=Nuisances(gains={"x": Known(1.0, 0.1)}),
        )  # fmt: skip
    found = estimate(Study(positioner(gain="g"), recorded(1.05), ("k", "g")))
    assert found.values["g"] == pytest.approx(1.05, abs=2e-3)
