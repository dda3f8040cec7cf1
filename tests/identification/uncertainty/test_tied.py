"""What a recording tells only together is said so, and no part of it has an interval of its own."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from bondgraph import TF, BondGraph, C, Dq, I, One, R, Se
from bondgraph.graph.parameter import Parameter, symbol
from bondgraph.signals.recording import Recording
from identification.diagnosis.diagnose import Diagnosis, diagnose
from identification.diagnosis.report.evidence import parameters
from identification.diagnosis.search.candidates import DiagnosisOptions
from identification.diagnosis.verdict import in_words, parse_verdict, retold, verdict
from identification.estimation import Estimation, Study, estimate
from identification.estimation.values import write_values
from identification.uncertainty.fitted import from_estimation
from identification.uncertainty.postflight import postflight
from identification.uncertainty.tied import Told, tied
from identification.validation import judge
from tests.settled import simulate

T = np.asarray(0.01 * np.arange(900), np.float64)
FORCE = 4 * np.sin(2 * np.pi * 0.7 * T) + 3 * np.sin(2 * np.pi * 2.3 * T)
SUM = "b_m and b_f only as their sum: b_m + b_f ="


def rubbed_twice(upper: float | None = None) -> BondGraph:
    """A mass between two dampers; its spring is so stiff as its material and its length are."""
    with BondGraph("carriage") as g:
        v = One("v")
        Se("F", unit="N") >> v >> I("m", 0.5, unit="kg")
        v >> R("damper_m", value=symbol("b_m", positive=True), unit="N*s/m")
        v >> R("damper_f", value=symbol("b_f", positive=True), unit="N*s/m")
        modulus, length = (symbol(n, positive=True) for n in ("E", "a"))
        v >> C("k", stiffness=modulus * length, unit="N/m")
        v >> Dq("x", unit="m")
    return g.with_parameters(
        [
            Parameter("b_m", 0.6, "N*s/m", upper=upper), Parameter("b_f", 1.4, "N*s/m"),
            Parameter("E", 100.0, "Pa"), Parameter("a", 2.0, "m"),
        ]
    )  # fmt: skip


def recorded() -> Recording:
    truth = rubbed_twice().with_values({"b_m": 1.2, "b_f": 1.0})
    x = np.asarray(simulate(truth, T, {"F": FORCE})["x"])
    x = x + 1e-4 * np.random.default_rng(2).standard_normal(T.size)
    return Recording.from_arrays("run", {"t[s]": T, "F[N]": FORCE, "x[m]": x})


@pytest.fixture(scope="module")
def fit() -> Estimation:
    return estimate(Study(rubbed_twice(), recorded()))


@pytest.fixture(scope="module")
def found() -> Diagnosis:
    return diagnose(rubbed_twice(), recorded(), options=DiagnosisOptions(jobs=1, keep=2, more=0))


def test_a_sum_and_a_product_with_their_units(fit: Estimation) -> None:
    by = {t.only: t for t in tied(from_estimation(fit))}
    assert set(by) == {"b_m + b_f", "E*a"}
    assert by["E*a"].form == "their product"
    for text, true, unit in (("b_m + b_f", 2.2, "N*s/m"), ("E*a", 200.0, "Pa*m")):
        (told,) = by[text].told
        assert told.unit == unit
        low, high = told.ci95
        assert low < true < high < 1.1 * true
        assert low > 0.9 * true


def test_a_bound_lets_nothing_seem_determined() -> None:
    held = estimate(Study(rubbed_twice(upper=0.7), recorded()))
    assert any(t.only == "b_m + b_f" for t in tied(from_estimation(held)))


def test_a_fit_says_it_once_and_gives_no_interval_of_its_own(
    fit: Estimation, tmp_path: Path
) -> None:
    judgement = judge(fit).with_findings(postflight(fit))
    text = str(judgement)
    assert text.count(SUM) == 1
    assert "flat direction" not in text
    assert "does not determine b_m" not in text
    assert "b_m and b_f trade off" not in text
    (row,) = (line for line in text.splitlines() if line.startswith("b_m  "))
    assert "…" not in row
    assert "only b_m + b_f is determined" in row
    write_values(fit, tmp_path / "fit.json", judgement.material.tied)
    document = json.loads((tmp_path / "fit.json").read_text())
    known = {p["name"]: p for p in document["parameters"]}
    assert known["b_m"]["ci95"] == [None, None]
    assert None not in known["m"]["ci95"]
    assert {"b_m + b_f", "E*a"} == {t["told"][0]["text"] for t in document["together"]}


def test_a_verdict_says_it_in_text_page_and_file(found: Diagnosis) -> None:
    assert found.kind == "parameters_only"
    assert f"the recording tells {SUM}" in in_words(found)
    page = parameters(found)
    assert "only b_m + b_f is determined" in page
    assert "of b_m and b_f only this" in page
    document = parse_verdict(json.dumps(verdict(found)))
    known = {p["name"]: p for p in document["parameters"]}
    assert known["b_f"]["ci95"] == [None, None]
    assert known["b_f"]["remark"] == "only b_m + b_f is determined"
    assert None not in known["m"]["ci95"]
    assert f"The recording tells {SUM}" in " ".join(retold(document).split())


def screw(b: float, lead_known: bool, d_g: float = 1.5e-5) -> BondGraph:
    """A slide that turns a motor: both are damped, and the readings tell one damping."""
    with BondGraph("screw") as g:
        v = One("slide")
        Se("F", unit="N") >> v >> I("m", 2.0, unit="kg")
        v >> R("b", b, unit="N*s/m")
        v >> C("k", stiffness=4000.0, unit="N/m")
        v >> Dq("x", unit="m")
        w = One("motor")
        v >> TF("pitch", 1000.0, unit="rad/m", fixed=lead_known) >> w
        w >> R("d_g", d_g, unit="N*m*s/rad")
    return g


@pytest.mark.parametrize("lead_known", [False, True])
@pytest.mark.parametrize("b", [30.0, 1e-7, 1e-13])  # a part of nothing hides that it is one
@pytest.mark.sampled(every=3)
def test_a_sum_in_which_each_counts_by_a_factor(b: float, lead_known: bool) -> None:
    t = np.asarray(0.005 * np.arange(2000), np.float64)
    push = sum(np.sin(2 * np.pi * f * t + 3.0 * f * f) for f in np.arange(0.5, 9.0, 0.61))
    x = np.asarray(simulate(screw(20.0, lead_known, 1e-5), t, {"F": push})["x"])
    x = x + 1e-5 * np.random.default_rng(2).standard_normal(t.size)
    run = Recording.from_arrays("run", {"t[s]": t, "F[N]": push, "x[m]": x})
    near = screw(b, lead_known)
    found = diagnose(near, run, options=DiagnosisOptions(jobs=1, effects=1, keep=2, more=0))
    fitted = tied(from_estimation(estimate(Study(near, run))))
    for (t_,) in (fitted, found.tied):
        assert set(t_.names) == ({"b", "d_g"} if lead_known else {"b", "d_g", "pitch"})
        (told,) = t_.told
        assert told.text == ("b + d_g*pitch^2" if lead_known else "b + pitch^2*d_g")
        assert (told.unit, t_.form) == ("N*s/m", "a weighted sum")
        assert told.ci95[0] < 30.0 < told.ci95[1]
        assert told.ci95[1] - told.ci95[0] < 1.0
    assert "d_g only as a weighted sum: b + " in in_words(found)
    known = {p["name"]: p for p in verdict(found)["parameters"]}
    assert known["d_g"]["ci95"] == [None, None]


def test_a_combination_of_any_size_is_told_as_not_determined() -> None:
    assert str(Told("d/m", 3e-7, "1/s", (3e-311, 3e297))) == "d/m, which is not determined either"
    assert str(Told("k/m", 2.0, "1/s2", (1.0, 4.0))).startswith("k/m = 2")
