"""Several recordings of one system, taken together."""

from __future__ import annotations

import hashlib
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bondgraph import BondGraph, C, Dq, I, One, R, Se, simulate
from bondgraph.graph.parameter import Parameter
from bondgraph.laws import Polynomial
from bondgraph.signals.recording import Recording, Split
from bondgraph.support.errors import UnusableInput
from identification.diagnosis.diagnose import diagnose
from identification.diagnosis.evidence.judged import judged_on
from identification.diagnosis.report.sections import answer, before_after
from identification.diagnosis.search.candidates import DiagnosisOptions
from identification.diagnosis.verdict.document import verdict
from identification.diagnosis.verdict.reading import parse_verdict
from identification.diagnosis.verdict.said_again import retold
from identification.estimation.single_record import fit
from identification.study.data import Data, data_for
from identification.study.joined import joined, picked, split_of
from identification.study.noise_floor import noise_floor
from identification.study.problem import Problem
from identification.study.residual import evaluate, start_point
from identification.validation import judge
from tests.identification.estimation.plants import force, moved, spring
from tests.proof.published import staging
from tests.proof.real import preparing

FS, NOISE = 100.0, 1e-5


def run(name: str, level: float, seed: int, n: int = 600, cubic: float = 0.0) -> Recording:
    graph = spring()
    if cubic:
        law = Polynomial(0.0, 0.1, 2.0, (3,))
        graph = graph.with_element("k", law=law)
        graph = graph.with_values({p.name: cubic for p in law.parameters("k")})
    u = level * force(n, FS, seed)
    x = moved(u, FS, graph) + NOISE * np.random.default_rng(seed).standard_normal(n)
    return Recording.from_arrays(name, {"F[N]": u, "x[m]": x}, fs=FS)


def plain(
    name: str = "one", fs: float = 10.0, headers: tuple[str, ...] = ("F[N]", "x[m]")
) -> Recording:
    return Recording.from_arrays(name, {h: np.arange(5.0) for h in headers}, fs=fs)


def test_one_behind_the_other() -> None:
    one, two = plain("one"), plain("two")
    both, breaks = joined([one, two])
    assert (both.n, breaks, both.name) == (10, (5,), "one + two")
    assert np.array_equal(both["F"], np.concatenate([one["F"], two["F"]]))
    assert both.units == one.units
    assert np.allclose(np.diff(both.time), 0.1)
    assert joined([one]) == (one, ())


def test_a_window_has_the_commands_of_its_recording_between_the_samples() -> None:
    fast = np.arange(21.0)
    data = Data(
        "both", np.arange(20.0), {"F": np.arange(20.0)}, np.zeros((20, 1)), ("x",), np.ones(1),
        Split(slice(0, 20), slice(20, 20), "all"), breaks=(3, 9, 14), cuts=(3, 14),
        finer=((1, {}), (2, {"F": fast})),
    )  # fmt: skip
    assert data.starts == (9,)
    assert data.commanded(slice(3, 9)) == (1, {})
    steps, known = data.commanded(slice(14, 20))
    assert steps == 2
    assert known["F"].tolist() == fast[10:21].tolist()
    assert data.begun(12).starts == (9,)


def test_every_recording_keeps_the_time_between_its_own_samples() -> None:
    """One device, its own clock: 14.951 and 14.960 ms."""
    parts = [plain("one", fs=1 / 0.014951), plain("two", fs=1 / 0.014960)]
    both, breaks = joined(parts)
    data = data_for(spring(), both, split_of(parts), {"x": 1.0})
    data = replace(data, breaks=breaks)
    assert data.step(slice(0, 5)) == pytest.approx(0.014951, rel=1e-9)
    assert data.step(slice(5, 10)) == pytest.approx(0.014960, rel=1e-9)
    assert (np.diff(both.time) > 0.0149).all()


@pytest.fixture
def _too_much_to_follow(monkeypatch: pytest.MonkeyPatch) -> None:
    """No steps between the samples are simulated, however few."""
    for name in ("FINEST", "IN_ALL"):
        monkeypatch.setattr(f"identification.study.joined.{name}", 0)


@pytest.mark.usefixtures("_too_much_to_follow")
@pytest.mark.parametrize("ratio", [2.0, 3.0, 2.5, 2.714, 75.0])
def test_faster_recordings_are_brought_to_the_slowest_rate(ratio: float) -> None:
    """A sine far below the slow rate's half stays what it was."""
    fs = 100.0

    def swing(name: str, rate: float) -> Recording:
        t = np.arange(round(8 * rate)) / rate
        return Recording.from_arrays(
            name, {"F[N]": np.cos(20 * t), "x[m]": np.sin(20 * t)}, fs=rate
        )

    both, (edge,) = joined(picked([swing("slow", fs), swing("fast", ratio * fs)]))
    own = both.slice(edge, both.n)
    assert own.dt == pytest.approx(1 / fs, rel=0.02)
    t = own.time - own.time[0]
    t = t + 25 / fs  # the spoiled ends are left out
    inside = slice(40, -40)
    assert np.abs(own["x"] - np.sin(20 * t))[inside].max() < 2e-3
    assert np.abs(own["F"] - np.cos(20 * t))[inside].max() < 2e-3
    assert f"brought from {ratio * fs:.6g} to 100 Hz" in " ".join(both.notes)


@pytest.mark.usefixtures("_too_much_to_follow")
@pytest.mark.parametrize("ratio", [10.0, 2.5])
def test_a_recording_too_short_for_the_slowest_rate_is_refused_in_one_line(ratio: float) -> None:
    short = Recording.from_arrays("short", {"F[N]": np.arange(60.0)}, fs=ratio * 100.0)
    slow = Recording.from_arrays("slow", {"F[N]": np.arange(600.0)}, fs=100.0)
    with pytest.raises(UnusableInput, match=r"short: its 60 samples are too few .* leave it out"):
        picked([slow, short])


def test_derivatives_of_recordings_with_clocks_of_their_own() -> None:
    parts = []
    for seed, fs in ((1, FS), (2, 1.013 * FS)):
        r = run("r", 1.0, seed, 300)
        parts.append(Recording.from_arrays(f"r{seed}", {"F[N]": r["F"], "x[m]": r["x"]}, fs=fs))
    both, breaks = joined(parts)
    graph = spring()
    late = graph.with_element("x", delay="late").with_parameters([Parameter("late", 0.0, "s")])
    for g, start in ((graph, {}), (late, {"late": 0.023})):
        data = replace(data_for(g, both, split_of(parts), {"x": NOISE}), breaks=breaks)
        data = replace(data, split=Split(slice(0, both.n), slice(0, 0), "all"))
        problem = Problem(g, data, starts=start)
        point = start_point(problem)
        theta = point.theta + 1e-3
        exact = evaluate(problem, replace(point, theta=theta)).jacobian
        for i in range(theta.size):
            h = np.zeros(theta.size)
            h[i] = 1e-5
            ends = [
                evaluate(problem, replace(point, theta=theta + s * h), derivatives=False).residual
                for s in (1, -1)
            ]
            column = -(ends[0] - ends[1]) / 2e-5
            assert np.linalg.norm(exact[:, i] - column) < 2e-3 * np.linalg.norm(column) + 1e-3, i


def test_each_of_joined_recordings_rests_under_its_own_first_inputs() -> None:
    parts = [
        Recording.from_arrays(n, {"F[N]": np.full(50, u), "x[m]": np.full(50, u / 200.0)}, fs=FS)
        for n, u in (("up", 5.0), ("down", -5.0))
    ]
    both, breaks = joined(parts)
    graph = spring()
    data = replace(data_for(graph, both, split_of(parts), {"x": NOISE}), breaks=breaks)
    data = replace(data, split=Split(slice(0, both.n), slice(0, 0), "all"))
    problem = Problem(graph, data, initial="rest")
    point = start_point(problem)
    np.testing.assert_allclose(evaluate(problem, point).y, data.readings, rtol=1e-9)
    i = [f.parameter.name for f in problem.free].index("k")
    theta = point.theta.copy()
    exact, ends, h = evaluate(problem, point).jacobian[:, i], [], 1e-5
    for s in (h, -h):
        theta[i] = point.theta[i] + s
        ends.append(evaluate(problem, replace(point, theta=theta), derivatives=False).residual)
    wanted = -(ends[0] - ends[1]) / (2 * h)
    np.testing.assert_allclose(exact, wanted, rtol=1e-5, atol=1e-6 * np.abs(wanted).max())


def test_a_diagnosis_of_recordings_with_clocks_of_their_own_finds_nothing() -> None:
    graph, parts = spring(), []
    for seed, fs in ((1, FS), (2, 1.012 * FS), (3, 2.5 * FS)):
        n = round(6 * fs)
        u = np.interp(np.arange(n) / fs, np.arange(700) / FS, force(700, FS, seed))
        x = moved(u, fs, graph) + NOISE * np.random.default_rng(seed).standard_normal(n)
        parts.append(Recording.from_arrays(f"r{seed}", {"F[N]": u, "x[m]": x}, fs=fs))
    d = diagnose(graph, parts, options=DiagnosisOptions(jobs=1, keep=2, more=1, effects=1))
    assert d.kind in ("explained", "parameters_only")
    assert d.nominal is not None
    # the low-pass leaves no noise at the top of the third one's spectrum, so that the floor is low
    assert d.nominal.chi2("train") < 1.7


@pytest.mark.parametrize(("count", "held"), [(2, 1), (3, 1), (6, 2)])
def test_the_last_third_is_held_out(count: int, held: int) -> None:
    split = split_of([plain()] * count)
    edge = 5 * (count - held)
    assert (split.train, split.test) == (slice(0, edge), slice(edge, 5 * count))
    assert split.rule == (
        f"the last {held} of {count} recordings are held out"
        if held > 1
        else f"the last of {count} recordings is held out"
    )


@pytest.mark.parametrize(
    ("other", "message"),
    [
        (plain("two", fs=20.0), "two is sampled every 0.05 s, one every 0.1 s"),
        (plain("two", headers=("F[N]", "x[kg]")), "x is in kg in two"),
        (plain("two", headers=("F[N]",)), "two has no channel x"),
    ],
)
def test_unequal_recordings_are_refused_in_one_line(other: Recording, message: str) -> None:
    with pytest.raises(UnusableInput, match=message) as caught:
        joined([plain("one"), other])
    assert "\n" not in str(caught.value)
    with pytest.raises(UnusableInput, match="no recording"):
        joined([])


def of_a_file(r: Recording, letter: str, **meta: object) -> Recording:
    return replace(r, source=f"{letter}.csv", sha256=64 * letter, meta={**r.meta, **meta})


def test_the_provenance_of_every_recording_is_kept(tmp_path: Path) -> None:
    """Hash, source, notes and declared converters survive; the hash is that of the hashes."""
    one = of_a_file(plain("one"), "a", notes=("resampled",), resolution={"x": 0.1})
    two = of_a_file(plain("two"), "b", notes=("resampled",), resolution={"x": 0.2, "F": 1.0})
    both, _ = joined([one, two])
    assert both.source == "a.csv + b.csv"
    assert both.sha256 == hashlib.sha256(f"{64 * 'a'}\n{64 * 'b'}".encode()).hexdigest()
    assert both.sha256 != joined([two, one])[0].sha256
    assert both.notes == ("one: resampled", "two: resampled")
    assert both.meta["resolution"] == {"x": 0.2, "F": 1.0}
    assert [p["name"] for p in both.meta["parts"]] == ["one", "two"]
    assert [p["sha256"] for p in both.meta["parts"]] == [64 * "a", 64 * "b"]
    assert [p["meta"]["resolution"] for p in both.meta["parts"]] == [
        {"x": 0.1}, {"x": 0.2, "F": 1.0}
    ]  # fmt: skip
    again = Recording.open(both.save(tmp_path / "both.npz"))
    assert (again.sha256, again.notes, again.meta) == (both.sha256, both.notes, both.meta)
    assert joined([one, plain("two")])[0].sha256 == ""
    assert joined([one, replace(two, sha256=one.sha256)])[0].sha256 == one.sha256
    assert joined([one])[0].sha256 == one.sha256


def test_records_that_are_joined_for_a_protocol_keep_theirs() -> None:
    one, two = of_a_file(plain("one"), "a", period=5), of_a_file(plain("two"), "b")
    expected = joined([one, two])[0].sha256
    real = preparing.joined("both", [one, two], "the whole record")
    assert (real.sha256, real.meta["period"]) == (expected, 5)
    assert real.notes == ("the whole record",)
    assert staging.joined(one, two).sha256 == expected


def test_a_declared_converter_of_several_recordings_is_no_missing_physics() -> None:
    step = 2e-3
    parts = []
    for seed, letter in ((1, "a"), (2, "b")):
        r = run(letter, 1.0, seed)
        coarse = replace(r, channels={**r.channels, "x": step * np.round(r["x"] / step)})
        parts.append(of_a_file(coarse, letter, resolution={"x": step}))
    d = diagnose(spring(), parts, options=DiagnosisOptions(jobs=1, keep=2, more=1, effects=1))
    assert d.kind == "explained"
    assert d.nominal is not None
    v = verdict(d)
    assert v["recording"]["sha256"] == d.recording.sha256 != ""
    assert judge(d.nominal).material.records[0].sha256 == d.recording.sha256
    assert v["recording"]["parts"] == [
        {"name": "a", "sha256": 64 * "a", "samples": 600},
        {"name": "b", "sha256": 64 * "b", "samples": 600},
    ]
    parse_verdict(json.dumps(v))
    assert f"{12 * 'a'} + {12 * 'b'}" in " ".join(retold(v).split())
    assert f"{12 * 'a'} + {12 * 'b'}" in answer(d)
    assert "parts" not in verdict(replace(d, recording=parts[0]))["recording"]
    for own in (7, "left, right", ["left", "right"], [{"name": "left"}], {"left": 1}):
        own_meta = replace(d, recording=replace(parts[0], meta={"parts": own}))
        assert "parts" not in verdict(own_meta)["recording"]
        assert 12 * "a" in answer(own_meta)


def test_a_diagnosis_uses_them_all_and_holds_one_out() -> None:
    """Gentle recordings alone would not show the cubic spring."""
    options = DiagnosisOptions(jobs=1, keep=3, more=1, effects=1)
    parts = [run("gentle", 0.05, 1, cubic=30.0), run("loud", 1.0, 2, cubic=30.0)]
    parts.append(run("loud again", 0.9, 3, cubic=30.0))
    said: list[str] = []
    d = diagnose(spring(), parts, options=options, progress=lambda text, _: said.append(text))
    assert "fitting the repaired model on all training samples" in said
    assert "that of a held-out one is fitted to its samples" in " ".join(d.notes)
    held = "no part in any fit, except for the initial state of each held-out recording"
    assert held in before_after(d)
    assert d.recording.n == 1800
    assert d.data is not None
    assert d.data.breaks == (600, 1200)
    assert np.flatnonzero(d.data.mask("held-out")).tolist() == list(range(1200, 1800))
    assert d.data.split.looked_at == (slice(1200, 1560),)
    assert d.data.split.test == (slice(1560, 1800),)
    assert d.kind == "missing_physics"
    assert d.decision is not None
    assert d.decision.chosen is not None
    assert d.decision.chosen.label == "nonlinear_stiffness at k"
    assert d.repaired is not None
    assert d.repaired.point.states.shape[0] == 3
    assert d.repaired.chi2("test") == pytest.approx((NOISE / d.data.floor[0]) ** 2, rel=0.3)
    assert d.data.floor[0] == pytest.approx(NOISE, rel=0.4)


def test_a_recording_of_which_nothing_was_seen_begins_from_a_state_of_its_own() -> None:
    """As held-out ones do that were looked at; no parameter moves."""
    parts = [run(name, 1.0, seed) for seed, name in enumerate("abc", start=1)]
    parts[2] = parts[2].slice(150)  # in the middle of its motion
    both, breaks = joined(parts)
    seen = Split(slice(0, 600), slice(600, 1200), "the third is kept back")
    data = replace(data_for(spring(), both, seen, {"x": NOISE}), breaks=breaks)
    looked = fit(Problem(spring(), data))
    unseen = replace(seen, test=slice(1200, both.n))
    judged = judged_on(looked, unseen)
    assert np.array_equal(judged.point.theta, looked.point.theta)
    assert np.array_equal(judged.point.states[:2], looked.point.states[:2])
    assert judged.chi2("test") == pytest.approx(1.0, rel=0.3)
    back = judged_on(judged, seen).simulated
    np.testing.assert_allclose(back[:1200], looked.simulated[:1200], atol=0.5 * NOISE)


def test_the_jump_between_recordings_is_no_noise() -> None:
    parts = [run("gentle", 0.05, 1), run("loud", 1.0, 2)]
    both, breaks = joined(parts)
    floor = noise_floor(both, split_of(parts), ("x",), ("F",), breaks)
    assert floor["x"] == pytest.approx(NOISE, rel=0.4)
    # one jump is not taken for noise even where nobody says that there is one
    assert noise_floor(both, split_of(parts), ("x",), ("F",))["x"] == pytest.approx(NOISE, rel=0.4)


def test_a_study_rests_where_simulate_does() -> None:
    """Laws and all: a spring that hardens is not stretched as far, whatever its numbers are."""
    with BondGraph("stiff") as graph:
        body = One("body")
        Se("F", unit="N") >> body >> I("m", 1.0, unit="kg")
        body >> R("d", 5.0, unit="N*s/m")
        body >> C("k", stiffness=100.0, unit="N/m", law=Polynomial(half=0.1, orders=(3,)))
        body >> Dq("x", unit="m")
    graph = graph.with_values({"a_3_k": 10.0})
    t, f = np.arange(50) / FS, np.full(50, 10.0)
    run = simulate(graph, t, {"F": f}, x0="rest")
    assert np.ptp(run["x"]) < 1e-9
    assert run["x"][0] < 0.08
    recording = Recording.from_arrays("held", {"F[N]": f, "x[m]": run["x"]}, fs=FS)
    split = Split(slice(0, 50), slice(0, 0), "all")
    problem = Problem(graph, data_for(graph, recording, split, {"x": NOISE}), initial="rest")
    point = start_point(problem)
    np.testing.assert_allclose(evaluate(problem, point).y[:, 0], run["x"], rtol=1e-8)
    for i in range(len(problem.free)):
        theta, ends = point.theta.copy(), []
        for s in (1e-4, -1e-4):
            theta[i] = point.theta[i] + s
            ends.append(evaluate(problem, replace(point, theta=theta), derivatives=False).residual)
        wanted = (ends[1] - ends[0]) / 2e-4
        exact = evaluate(problem, point).jacobian
        near = 1e-5 * np.abs(exact).max()
        np.testing.assert_allclose(exact[:, i], wanted, rtol=1e-4, atol=near)
