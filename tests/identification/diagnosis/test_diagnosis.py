"""Small synthetic recordings: what is missing is named, and nothing else is."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.signal import lfilter

from bondgraph import BondGraph
from bondgraph.laws import Coulomb, Law, Polynomial, QuadraticDrag
from bondgraph.signals.recording import Recording
from bondgraph.signals.split import interleaved, kept_back
from identification.diagnosis.catalogue import CATALOGUE
from identification.diagnosis.diagnose import Diagnosis, diagnose
from identification.diagnosis.explanation.advice import advice
from identification.diagnosis.search.candidates import DiagnosisOptions
from identification.diagnosis.verdict import verdict
from tests.settled import simulate
from tests.spring import spring

pytestmark = pytest.mark.slow

N, DT, NOISE = 1500, 0.01, 3e-5
OPTIONS = DiagnosisOptions(jobs=1, keep=4, more=2, effects=2)
BESIDE = (
    "coulomb_friction", "nonlinear_stiffness", "hysteresis", "end_stop", "quadratic_drag",
    "asymmetric_damping", "backlash", "external_disturbance", "sensor_nonlinearity",
)  # fmt: skip
"""Rivals of friction and a cubic spring together; each alone is held against the catalogue."""


def multisine(seed: int, n: int = N) -> np.ndarray:
    t = DT * np.arange(n)
    rng = np.random.default_rng([seed, 8])
    tones = [
        np.sin(2 * np.pi * (f * t + rng.random())) for f in (0.31, 0.53, 0.97, 1.7, 2.3, 3.1, 4.7)
    ]
    return np.asarray(2.0 * np.sum(tones, axis=0))


def recorded(
    truth: BondGraph,
    seed: int,
    extra: np.ndarray | float,
    parameters: dict[str, float],
    n: int = N,
) -> Recording:
    t = np.asarray(DT * np.arange(n), np.float64)
    u = multisine(seed, n)
    x = np.asarray(simulate(truth, t, {"F": u + extra}, parameters, accuracy=1e-6)["x"])
    x = x + NOISE * np.random.default_rng(seed).standard_normal(n)
    return Recording("run", t, {"F": u, "x": x}, {"F": "N", "x": "m"})


def judged(
    truth: BondGraph, model: BondGraph, seed: int = 1, extra: np.ndarray | float = 0.0,
    parameters: dict[str, float] | None = None, n: int = N,
) -> Diagnosis:  # fmt: skip
    run = recorded(truth, seed, extra, parameters or {}, n)
    return diagnose(model, run, options=OPTIONS, seed=seed)


@cache
def rubbing() -> Diagnosis:
    """Dry friction that the model does not have."""
    return judged(spring().with_element("d", law=Coulomb(1.0)), spring(), n=1000)


@pytest.mark.parametrize(
    ("law", "effect", "place"),
    [
        (Coulomb(1.0), "coulomb_friction", "d"),
        pytest.param(
            *(Polynomial(0.0, 0.1, 2.0, orders=(3,)), "nonlinear_stiffness", "k"),
            marks=pytest.mark.long,
        ),
    ],
    ids=["coulomb", "cubic"],
)
@pytest.mark.long
def test_a_missing_law_is_named(law: Law, effect: str, place: str) -> None:
    if isinstance(law, Polynomial):
        (cubic,) = law.parameters(place)
        truth = spring().with_element(place, law=law)
        v = verdict(judged(truth, spring(), parameters={cubic.name: 2.0}, n=1000))
    else:
        v = verdict(rubbing())
    assert v["verdict"] == "missing_physics", v
    (finding,) = v["findings"]
    assert finding["effect"] == effect
    assert finding["location"]["element"] == place
    assert v["fit"]["repaired"]["test_rmse"]["x"] < 1.5 * NOISE  # friction: sub-steps differ
    assert v["fit"]["nominal"]["test_rmse"]["x"] > 3 * NOISE


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_noise_alone_is_explained(seed: int) -> None:
    d = judged(spring(), spring(), seed)
    assert d.kind == "explained"
    assert verdict(d)["findings"] == []
    assert d.nominal is not None
    assert d.nominal.chi2("test") == pytest.approx(1.0, abs=0.2)


def test_wrong_parameters_are_not_missing_physics() -> None:
    d = judged(spring(), spring(m=0.6, d=1.4, k=230.0))
    assert d.kind == "parameters_only"
    assert verdict(d)["findings"] == []
    values = {e["name"]: e["value"] for e in verdict(d)["parameters"]}
    assert values["m"] == pytest.approx(0.5, rel=0.02)
    assert values["k"] == pytest.approx(200.0, rel=0.02)


def test_a_law_that_the_catalogue_does_not_have_gets_no_exact_name() -> None:
    t = DT * np.arange(1000)
    disturbance = 1.5 * np.sign(np.sin(2 * np.pi * 0.77 * t))  # a force of its own from outside
    run = recorded(spring(), 1, disturbance, {}, t.size)
    v = verdict(diagnose(spring(), run, options=OPTIONS, seed=1))
    assert v["verdict"] in ("unknown_physics", "missing_physics")
    for f in v["findings"]:
        # it is a force from outside, but no tone: the name may be given, its law is not exact
        assert f["effect"] in ("unknown", "external_disturbance")
        assert f["answer"] != "exact"
    assert v["remaining"]["x"]["over_noise"] > 10


@pytest.mark.sampled(every=3)
@pytest.mark.parametrize("size", [0.01, 0.1, 1.0])
def test_a_force_from_outside_is_never_called_explained(size: float) -> None:
    """It leaves two, eighteen and a hundred and eighty times the noise that is known."""
    drift = lfilter([1.0], [1.0, -0.98], np.random.default_rng(5).standard_normal(N))
    run = recorded(spring(), 1, size * drift / drift.std(), {})
    options = DiagnosisOptions(jobs=1, keep=4, more=2, effects=1)
    d = diagnose(spring(), run, options=options, noise={"x": NOISE})
    assert d.left is not None
    assert d.kind == "unknown_physics"
    assert d.left.most > 1.9
    (finding,) = verdict(d)["findings"]
    assert finding["effect"] == "unknown"


def test_what_is_gained_shows_on_samples_that_no_choice_has_seen() -> None:
    d = rubbing()
    assert d.nominal is not None
    assert d.repaired is not None
    assert d.data is not None
    shown = d.repaired.problem.data.mask("test")
    np.testing.assert_array_equal(shown, d.nominal.problem.data.mask("test"))
    others = [t.fit.problem.data.mask("test") for t in d.trials if t.fit is not d.repaired]
    assert others
    assert all(not (shown & seen).any() for seen in others)
    assert not (shown & d.nominal.problem.data.mask("train")).any()
    np.testing.assert_array_equal(shown, d.data.mask("test"))
    np.testing.assert_array_equal(shown | others[0], d.data.mask("held-out"))
    assert d.repaired.chi2("test") < 0.1 * d.nominal.chi2("test")


def test_what_remains_above_the_noise_is_not_left_without_advice() -> None:
    d = rubbing()
    assert d.left is not None
    usual, limit = advice(d, np.array([1.0])), d.limits.noise
    assert not any("not complete" in a for a in usual)
    more = replace(d.left, over_noise={"x": 2.0 * limit}, measured=True)
    assert "leaves 3 times the noise" in advice(replace(d, left=more), np.array([1.0]))[-1]


def test_what_shows_where_no_choice_looks_is_no_explanation() -> None:
    """A shock within one of the stretches that are kept back."""
    split = interleaved(0, N)
    kept = kept_back(split)[1].test
    assert isinstance(kept, tuple)
    shock = np.zeros(N)
    shock[kept[0].start + 5] = 400.0
    run = recorded(spring(), 1, shock, {})
    channels = {n: np.array(v) for n, v in run.channels.items()}
    rest = recorded(spring(), 1, 0.0, {}).channels
    inside = np.zeros(N, bool)
    inside[kept[0]] = True
    channels["x"] = np.where(inside, channels["x"], rest["x"])
    run = replace(run, channels=channels)
    options = DiagnosisOptions(jobs=1, keep=4, more=2, effects=1)
    d = diagnose(spring(), run, split, options=options)
    assert d.kind == "unknown_physics"
    assert d.left is not None
    assert not d.left.is_noise(d.limits.noise)
    (finding,) = verdict(d)["findings"]
    assert finding["effect"] == "unknown"
    assert "nothing showed in what choices may look at" in " ".join(d.steps[0].reasons)


@pytest.mark.parametrize(
    ("damper", "effect", "values", "n", "rivals"),
    [
        (QuadraticDrag(), "quadratic_drag", {"c_2_d": 3.0}, 600, BESIDE),
        # friction jumps: every fit of it takes several times as long
        pytest.param(*(Coulomb(1.0), "coulomb_friction", {}, 1000, BESIDE), marks=pytest.mark.long),
        pytest.param(*(Coulomb(1.0), "coulomb_friction", {}, N, ()), marks=pytest.mark.long),
    ],
)
def test_two_laws_that_are_missing_are_both_named(
    damper: Law, effect: str, values: dict[str, float], n: int, rivals: tuple[str, ...]
) -> None:
    """Held against the whole catalogue with the proofs."""
    cubic = Polynomial(0.0, 0.1, 2.0, orders=(3,))
    truth = spring().with_element("d", law=damper).with_element("k", law=cubic)
    strong = {p.name: 2.0 for p in cubic.parameters("k")} | values
    others = tuple(e.name for e in CATALOGUE if rivals and e.name not in rivals)
    options = replace(OPTIONS, without=others)
    d = diagnose(spring(), recorded(truth, 1, 0.0, strong, n), options=options)
    assert d.kind == "missing_physics"
    named = {(f["effect"], f["location"]["element"]) for f in verdict(d)["findings"]}
    assert named == {(effect, "d"), ("nonlinear_stiffness", "k")}
    assert d.left is not None
    assert d.left.most < 1.5
