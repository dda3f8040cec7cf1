"""A study is diagnosed as it stands: what it knows, fixes, adds and holds out."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from bondgraph import BondGraph, C, Da, Df, Dq, I, One, R, Sf, Zero
from bondgraph.graph.parameter import Parameter
from bondgraph.laws import Polynomial
from bondgraph.signals.recording import Recording, Split
from bondgraph.support.errors import UnusableInput
from identification.diagnosis.catalogue import CATALOGUE
from identification.diagnosis.diagnose import Diagnosis, diagnose
from identification.diagnosis.search.asked import asked_of
from identification.diagnosis.search.candidates import DiagnosisOptions
from identification.diagnosis.search.material import material_of
from identification.diagnosis.search.nominal import nominal_fit
from identification.estimation.estimate import estimate
from identification.estimation.single_record import fit
from identification.study.calibration import Known
from identification.study.priors import LogNormal
from identification.study.residual import windows
from identification.study.specification import Nuisances, Vary
from identification.study.study import ESTIMATED, Study
from tests.settled import simulate
from tests.spring import spring

N, DT, NOISE = 750, 0.01, 2e-6
OPTIONS = DiagnosisOptions(jobs=1, keep=3, more=1, effects=1)
KEPT = ("nonlinear_stiffness", "end_stop", "coulomb_friction", "quadratic_drag")
FEW = replace(OPTIONS, without=tuple(e.name for e in CATALOGUE if e.name not in KEPT))
"""Where it is not the question which law is missing."""


def record(name: str = "run", seed: int = 3, cubic: float = 4e4, gain: float = 1.0) -> Recording:
    t = np.asarray(DT * np.arange(N), np.float64)
    rng = np.random.default_rng(seed)
    phases = rng.uniform(0, 2 * np.pi, 3)
    waves = np.sin(2 * np.pi * np.outer(t, (0.7, 1.9, 4.1)) + phases)
    force = np.asarray(waves @ np.array([2.0, 1.0, 0.5]), float)
    truth = spring().with_element("k", law=Polynomial(orders=(3,), size=1.0))
    x = gain * np.asarray(simulate(truth, t, {"F": force}, {"a_3_k": cubic})["x"])
    x = np.asarray(x + NOISE * rng.standard_normal(N), np.float64)
    return Recording(name, t, {"F": force, "x": x}, {"F": "N", "x": "m"})


def study(**more: object) -> Study:
    given: dict[str, object] = {"fixed": {"m": 0.5}, "hold": "linear", "noise": {"x": NOISE}}
    return Study(spring(m=0.7), record(), **(given | more))  # type: ignore[arg-type]


def straight(**more: object) -> Study:
    """The study of a recording in which nothing is missing: there is nothing to search for."""
    return study(**more).changed(recordings=(record(cubic=0.0),))


@lru_cache
def found() -> Diagnosis:
    gains = Nuisances(gains={"x": Known(1.0, 0.02)})
    free = ("d", Vary("k", start=150.0, prior=LogNormal(200.0, 1.05)))
    return diagnose(study(free=free, nuisances=gains), options=FEW)


def test_what_a_study_fixes_and_knows_holds_in_every_fit() -> None:
    d = found()
    assert d.kind == "missing_physics"
    assert d.repaired is not None
    assert d.findings[0].chosen is not None
    assert d.findings[0].chosen.element == "k"
    for made in (d.declared, d.nominal, d.repaired):
        assert made is not None
        assert made.values["m"] == 0.5
        assert made.problem.data.hold == "linear"
        assert made.problem.data.floor == pytest.approx([NOISE])
    assert {e.name for e in d.repaired.estimates} >= {"d", "k"}
    assert "m" not in {e.name for e in d.repaired.estimates}
    assert "gain_x" in {e.name for e in d.repaired.nuisances}
    assert d.declared is not None
    assert d.declared.values["k"] == 150.0


def test_a_prior_keeps_its_centre_wherever_a_fit_begins() -> None:
    d = found()
    assert d.repaired is not None
    assert d.nominal is not None
    for made in (d.nominal, d.repaired):
        (i,) = (i for i, f in enumerate(made.problem.free) if f.parameter.name == "k")
        centre, weight = made.problem.scaled_priors["k"]
        assert made.problem.free[i].value(centre) == pytest.approx(200.0)
        assert weight == pytest.approx(1.0 / np.log(1.05))


def test_the_same_study_with_the_repaired_model_is_fitted_on() -> None:
    d = found()
    again = d.study
    assert again.fixed == {"m": 0.5}
    assert set(again.free_names) >= {"d", "k"}
    assert len(again.free_names) > 2
    made = estimate(again)
    assert made.rmse("train")["x"] == pytest.approx(NOISE, rel=0.1)
    assert {e.name: e.value for e in made.estimates}["k"] == pytest.approx(200.0, rel=0.02)


def test_a_study_of_a_fit_ends_where_the_fit_ended() -> None:
    """At a spread around a declared value, and at a bound: neither moves with the value."""
    known = (
        Parameter("k_0", 150.0, "N/m", spread=1.2),
        Parameter("d_0", 1.5, "N*s/m", upper=1.9),
    )
    graph = spring().with_parameters(known)
    graph = graph.with_element("k", stiffness="k_0").with_element("d", value="d_0")
    split = Split(slice(0, 450), slice(450, N), "the last 300")
    asked = asked_of(graph, record(cubic=0.0), split, "linear", {})
    made = fit(asked.problem(material_of(asked).data))
    assert (made.values["k_0"], made.values["d_0"]) == pytest.approx((180.0, 1.9))
    again = asked.again(made)
    assert again.noise == pytest.approx({"x": made.problem.data.floor[0]})
    assert (again.hold, again.splits) == ("linear", (split,))
    assert again.starts == pytest.approx(made.values)
    assert estimate(again).values == pytest.approx(made.values, rel=1e-3)


def test_recordings_to_judge_are_held_out() -> None:
    asked = study(validation=(record("other", 5),))
    d = diagnose(asked, options=FEW)
    assert d.data is not None
    assert d.data.mask("train").sum() == N
    assert not d.data.mask("train")[N:].any()
    assert "to judge" in d.data.split.rule
    assert d.kind == "missing_physics"


def test_a_split_of_a_study_is_taken() -> None:
    split = Split(slice(0, 450), slice(450, N), "the last 300")
    d = diagnose(straight(splits=split), options=OPTIONS)
    assert d.data is not None
    assert not d.data.mask("train")[450:].any()
    assert not d.data.mask("test")[:450].any()


@pytest.mark.parametrize("initial", ["rest", {"q_k": 0.0}])
def test_known_initial_states_reach_every_fit(initial: object) -> None:
    # the recording begins in the rest under its first force, a displacement of its own
    r = record(cubic=0.0)
    start = float(r["F"][0]) / 200.0
    given = {"q_k": start} if isinstance(initial, dict) else initial
    d = diagnose(Study(spring(), r, initial=given, hold="linear"), options=OPTIONS)  # type: ignore[arg-type]
    assert d.nominal is not None
    at = d.nominal.problem.dynamics.state_names.index("q_k")
    assert d.nominal.point.states[0, at] == pytest.approx(start, rel=1e-3)
    assert d.kind in ("explained", "parameters_only")
    assert d.nominal.problem.free_states.size == (1 if isinstance(initial, dict) else 0)


def test_a_study_that_leaves_the_hold_open_chooses_it() -> None:
    assert diagnose(straight(hold=ESTIMATED, splits=None), options=OPTIONS).data is not None


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"window": 100, "initial": "rest"}, "leave window out, or initial free"),
        ({"window": 100, "process_noise": ("m",)}, "leave out window"),
        ({"noise": {"x": (1e-6, 2e-6)}, "recordings": 2}, "one for all"),
        ({"free": ("d", Vary("k", own=True)), "recordings": 2}, "k would have a value in every"),
    ],
)
def test_what_a_diagnosis_cannot_take_is_one_line(change: dict[str, object], says: str) -> None:
    change = dict(change)
    several = change.pop("recordings", 1)
    asked = study()
    if several == 2:
        asked = asked.changed(recordings=(record(), record("other", 5)), splits=None)
    with pytest.raises(UnusableInput, match=says):
        diagnose(asked.changed(**change), options=OPTIONS)


def test_windows_of_a_study_are_those_of_the_diagnosis() -> None:
    asked = study(window=150)
    d = diagnose(asked, options=FEW)
    assert d.nominal is not None
    problem = d.nominal.problem
    ours = [w.start for w in windows(asked.problem(0, asked.first_setting))]
    assert [w.start for w in windows(problem)] == ours
    assert d.nominal.point.states.shape[0] == len(ours) == 5
    assert not problem.lags
    assert d.kind == "missing_physics"
    assert d.findings[0].chosen is not None
    assert d.findings[0].chosen.element == "k"
    assert not any("each recording" in n for n in d.notes)  # it is one recording


def test_windows_of_several_recordings_lie_in_their_recordings() -> None:
    two = study().changed(recordings=(record(), record("other", 5)), splits=None, window=150)
    given = asked_of(two, None, None, None, {})
    problem = given.problem(material_of(given).data)
    assert problem.data.starts == problem.data.thinned(1).starts == (N,)
    assert problem.data.thinned(2).starts == (N // 2,)
    assert len(windows(problem)) == 10
    for w in windows(problem):
        assert len(problem.fine_inputs(w)) == w.stop - w.start - 1
    one = asked_of(study(window=150), None, None, None, {})
    assert material_of(one).data.breaks
    assert not material_of(one).data.starts


def test_sub_steps_of_a_study_are_where_the_diagnosis_begins() -> None:
    given = asked_of(study(n_sub=4), None, None, None, {})
    problem = given.problem(material_of(given).data)
    assert problem.n_sub == 4
    for hold in ("linear", "hold"):
        made = nominal_fit(given.graph, problem.data, hold, problem)[1]
        assert made.problem.n_sub >= 4
        finer = replace(made, problem=replace(made.problem, n_sub=8))
        assert given.about(finer).n_sub == 8
    assert asked_of(study(), None, None, None, {}).about(finer).n_sub is None


def test_coloured_noise_is_not_dropped_in_silence() -> None:
    d = diagnose(study(noise="coloured"), options=FEW)
    assert d.kind == "missing_physics"
    assert sum("coloured noise" in n for n in d.notes) == 1
    assert not any("coloured" in n for n in found().notes)


def test_a_recording_that_lacks_a_sensor_is_named_with_it() -> None:
    graph = spring().with_branch("v", [Df("w", unit="m/s")])
    whole = record("run", 5)
    both = replace(
        whole,
        channels={**whole.channels, "w": np.gradient(whole["x"], DT)},
        units={**whole.units, "w": "m/s"},
    )
    for asked in ((graph, (both, record("run"))), (Study(graph, (both, record("run"))), None)):
        with pytest.raises(UnusableInput, match=r"^run#2 has no channel w for the sensor"):
            diagnose(*asked)
    # what the model does not read may be there or not
    assert len(asked_of(spring(), (both, record("run")), None, None, {}).recordings) == 2


def test_a_sensor_that_no_recording_holds_is_one_line() -> None:
    graph = spring().with_branch("v", [Df("w", unit="m/s")])
    for asked in ((graph, record()), (Study(graph, record()), None)):
        with pytest.raises(UnusableInput, match=r"sensor 'w' in run.*select.*remove\('w'\)"):
            diagnose(*asked)


def test_samples_that_a_state_is_found_by_are_not_judged() -> None:
    asked = straight(validation=(record("other", 5, cubic=0.0),), init=50)
    d = diagnose(asked, options=OPTIONS)
    assert d.data is not None
    assert not d.data.mask("held-out")[: N + 50].any()


@pytest.mark.parametrize("level", [np.float32(NOISE), np.array(NOISE), [NOISE]])
def test_a_known_noise_may_be_any_number(level: object) -> None:
    assert asked_of(study(noise={"x": level}), None, None, None, {}).noise["x"] == pytest.approx(
        NOISE
    )


@pytest.mark.parametrize(
    ("asked", "recording", "says"),
    [
        (None, None, "BondGraph or a Study"),
        (spring(), 3, "no recording"),
        (spring(), [3], "no rec"),
    ],
)
def test_what_is_no_question_is_one_line(asked: object, recording: object, says: str) -> None:
    with pytest.raises(UnusableInput, match=says):
        diagnose(asked, recording)  # type: ignore[arg-type]


def test_a_model_that_needs_the_rate_of_its_input_never_holds_it() -> None:
    with BondGraph("shaken") as g:
        base, s, body = Sf("b", unit="m", given="integral"), Zero("s"), One("body")
        base >> s >> body >> I("m", 0.3, unit="kg")
        gap = One("gap")
        s >> gap >> C("k", stiffness=200.0, unit="N/m")
        gap >> R("d", 0.8, unit="N*s/m")
        body >> Da("a", unit="m/s^2")
        body >> Dq("x", unit="m")
    t = np.asarray(DT * np.arange(N), np.float64)
    b = np.asarray(0.01 * (1 - np.cos(9 * t)) * np.sin(3 * t), np.float64)
    run = simulate(g, t, {"b": b})
    rng = np.random.default_rng(0)
    read = {
        n: np.asarray(
            np.asarray(run[n]) + 1e-3 * np.std(run[n]) * rng.standard_normal(N), np.float64
        )
        for n in ("a", "x")
    }
    r = Recording("run", t, {"b": b, **read}, {"b": "m", "a": "m/s^2", "x": "m"})
    made = estimate(Study(g, r, fixed={"m": 0.3}, hold=ESTIMATED))
    assert made.setting.hold != "hold"
    assert diagnose(g, r, options=OPTIONS).kind in ("explained", "parameters_only")


def test_recordings_beside_a_study_and_none_beside_a_graph() -> None:
    with pytest.raises(UnusableInput, match="a study, which has its own"):
        diagnose(study(), record())
    with pytest.raises(UnusableInput, match="no recording to diagnose"):
        diagnose(spring())


def test_recordings_that_train_and_are_held_out_keep_one_state_each() -> None:
    """The states of both were fitted to the held-out parts, and what trains looked wrong."""
    parts = [Split(slice(0, 500), slice(500, N), "its end")] * 2
    records = [record(name, seed, cubic=0.0) for name, seed in (("a", 3), ("b", 4))]
    asked = Study(spring(m=0.7), records, splits=parts, hold="linear", noise={"x": NOISE})
    d = diagnose(asked, options=OPTIONS)
    assert d.kind in ("explained", "parameters_only")
    assert d.nominal is not None
    assert d.nominal.chi2("train") == pytest.approx(d.nominal.cost, rel=1e-6)


def test_a_missing_channel_is_asked_for_as_a_diagnosis_takes_it() -> None:
    """A study may be told that an input is silent; a diagnosis of a graph may not."""
    other = Recording.from_arrays("run", {"volts[V]": np.ones(9), "x[m]": np.ones(9)}, fs=10.0)
    with pytest.raises(UnusableInput, match=r"map=\{'F'") as said:
        diagnose(spring(), other)
    assert "silent" not in str(said.value)
