"""Bad input is said before and after the fit, and good input is not."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from bondgraph import BondGraph, C, Dq, I, One, R, Se
from bondgraph.signals.recording import Recording
from identification.estimation import Study, Vary, estimate
from identification.estimation.estimates import Estimate
from identification.uncertainty.finding import Finding
from identification.uncertainty.postflight import _landed, postflight
from identification.uncertainty.preflight import preflight, thousand
from tests.identification.uncertainty.plants import NOISE, recorded, signals, spring
from tests.spring import spring as shared_spring

T, U, X = signals(n=1200)


def before(x: np.ndarray = X, u: np.ndarray = U, t: np.ndarray = T) -> dict[str, Finding]:
    return {f.kind: f for f in preflight(Study(spring(), recorded(t, u, x)))}


def test_good_input_raises_nothing() -> None:
    assert before() == {}


def test_constant_reading_and_command() -> None:
    assert set(before(x=0 * X + 1.0)) >= {"constant reading"}
    assert "constant command" in before(u=0 * U + 1.0)


@pytest.mark.parametrize(("factor", "text"), [(1e3, "1000"), (1e-3, "0.001"), (1e6, "1e+06")])
def test_units_off_by_a_thousand(factor: float, text: str) -> None:
    found = before(x=X * factor)
    assert set(found) == {"unit"}
    assert text in found["unit"].why


def test_unit_is_said_after_the_fit_too() -> None:
    # free initial states may explain a reading so far off by a slow swing
    e = estimate(Study(spring(), recorded(T, U, X * 1e3), initial="rest"))
    units = [f for f in postflight(e) if f.kind == "unit"]
    assert {f.where.split(", ")[1] for f in units} == {"m", "d", "k"}


def test_a_gain_that_is_no_unit() -> None:
    assert set(before(x=X * 60.0)) >= {"start far off"}
    assert thousand(60.0) is None
    assert thousand(1.2) is None
    assert thousand(1400.0) == 1
    assert thousand(7e-7) == -2
    assert thousand(float("nan")) is None


def test_stuck_reading_and_drift() -> None:
    x = X.copy()
    x[500:620] = x[500]
    assert "stays at" in before(x=x)["stuck reading"].what
    drift = before(x=X + 0.05 * T / T[-1])["drift"]
    assert "slow physics that the model lacks" in drift.why
    assert "remove the trend" not in drift.do  # a trend may be what is looked for


def test_quantised_readings_are_not_stuck() -> None:
    step = 2e-3
    assert "stuck reading" not in before(x=step * np.round(X / step))


def test_unexcited_parameters() -> None:
    noise = NOISE * np.random.default_rng(3).standard_normal(X.size)
    found = before(u=1e-5 * U, x=noise)
    assert "unexcited parameter" in found


def test_slow_samples_and_short_records() -> None:
    assert "slow samples" in before(x=X[::50], u=U[::50], t=T[::50])
    g = shared_spring(100.0, 0.5, 1e-4)
    kinds = {f.kind for f in preflight(Study(g, recorded(T, U, X)))}
    assert "short record" in kinds


def test_unstable_start() -> None:
    with BondGraph("buckled") as g:
        body = One("v")
        g.parameter("k_n", 200.0, "N/m", positive=False)
        Se("F", unit="N") >> body >> I("m", 0.5, unit="kg")
        body >> R("d", 2.0, unit="N*s/m")
        body >> C("k", stiffness="k_n", unit="N/m")
        body >> Dq("x", unit="m")
    study = Study(g, recorded(T, U, X), ("m", "d", Vary("k_n", start=-200.0)))
    kinds = {f.kind: f for f in preflight(study)}
    assert "unstable start" in kinds
    assert "exp(18.1 t)" in kinds["unstable start"].what
    fast = study.starting({"k_n": -2e6})
    assert {f.kind for f in preflight(fast)} & {"start not finite", "unstable start"}


def test_findings_read_as_one_line() -> None:
    f = before(x=0 * X)["constant reading"]
    assert "\n" not in str(f)
    assert "run, x" in f.where
    assert f.do


def test_several_recordings_are_named() -> None:
    bad = Recording("second", T, {"F": U, "x": X * 1e3}, {"F": "N", "x": "m"})
    found = preflight(Study(spring(), (recorded(T, U, X), bad)))
    assert [f.where for f in found if f.kind == "unit"] == ["second, x"]


def test_a_value_whose_interval_holds_what_is_declared_is_no_wrong_unit() -> None:
    study = Study(spring(), recorded(T, U, X))
    known = study.graph.parameters["d"].value
    ends = {"known": (9e2 * known, 1.1e3 * known), "open": (0.5 * known, 1e6 * known)}
    kinds = {}
    for name, ci95 in ends.items():
        e = SimpleNamespace(study=study, estimates=(Estimate("d", 1e3 * known, "N*s/m", ci95),))
        kinds[name] = [f.kind for f in _landed(e)]  # type: ignore[arg-type]
    assert kinds == {"known": ["unit"], "open": []}
