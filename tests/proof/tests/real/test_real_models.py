"""The proof on real recordings: models fixed in advance run, verdicts are judged, nothing is lost.

No diagnosis of a recording is run here: `bondsight real` does that, each once.
"""

from __future__ import annotations

import inspect
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bondgraph.graph.sensors import Sensor
from bondgraph.signals.recording import Recording
from bondgraph.signals.split import whole
from bondgraph.simulation.lure import compile_model
from bondgraph.support.errors import UnknownName, UnusableInput
from identification.datasets import FOLDER_VARIABLE, SETS, set_available
from identification.study.data import data_for
from identification.study.factors import drives
from identification.study.noise_floor import noise_floor
from tests.proof.real.case import KINDS
from tests.proof.real.judging import OUTCOMES, judge
from tests.proof.real.outcome import Outcome, counts, read_outcome, table
from tests.proof.real.preparing import (
    apart,
    boundary_split,
    in_pieces,
    joined,
    stretches_of,
    thinned,
)
from tests.proof.real.registry import REAL_CASES, chosen_cases
from tests.proof.real.running import run_cases
from tests.proof.real.steering_mirror import BAND, PERIOD, below_resonance
from tests.settled import simulate

UNSEEN = {
    "steering_mirror", "pnzt_creep", "mr_damper", "pendulum", "rack_and_pinion",
    "pneumatic_cylinder", "coupled_drives", "wiener_hammerstein", "f16", "ball_and_beam",
    "flexible_arm", "friction_damper", "motoshield", "tclab", "hobby_servo", "piezo_beam",
}  # fmt: skip
SEEN = {"piezo_actuator", "emps", "silverbox", "hair_dryer"}
NAMES = tuple(REAL_CASES)


# --- the registry ---------------------------------------------------------------------------


def test_registry_holds_every_set_with_a_documented_physics() -> None:
    by_label = {
        label: {c.dataset for c in REAL_CASES.values() if c.label == label}
        for label in ("unseen", "seen before", "simulated")
    }
    assert by_label == {"unseen": UNSEEN, "seen before": SEEN, "simulated": {"bouc_wen"}}
    assert all(n == c.name for n, c in REAL_CASES.items())
    assert [c.dataset for c in REAL_CASES.values() if c.control] == ["f16"]
    for case in REAL_CASES.values():
        entry = SETS[case.dataset]
        assert set(case.parts) <= {p.name for p in (*entry.parts, *entry.otherwise)}, case.name


@pytest.mark.parametrize("name", NAMES)
def test_truths_name_elements_of_the_model(name: str) -> None:
    case = REAL_CASES[name]
    graph = case.model()
    assert graph.check() == ()
    assert case.truth
    for truth in case.truth:
        assert truth.family
        assert truth.evidence
        assert set(truth.places) <= set(graph.elements), truth.effect
    assert case.kinds
    assert len(set(case.kinds)) == len(case.kinds)
    assert set(case.kinds) <= set(KINDS)


def test_a_wrong_case_gets_the_nearest_names() -> None:
    with pytest.raises(UnknownName, match="mr_damper"):
        chosen_cases(("mr_dampr",))


@pytest.mark.parametrize("name", NAMES)
def test_models_simulate_made_up_commands(name: str) -> None:
    graph = REAL_CASES[name].model()
    compiled = compile_model(graph)
    rng = np.random.default_rng(7)
    moving = drives(graph)
    n = 200
    commands = {s.name: rng.normal(size=n) for s in moving}
    start = None if moving else np.full(compiled.n_x, 0.1)
    made = simulate(graph, 1e-3 * np.arange(n), commands, x0=start)
    assert set(made.outputs) == {s.name for s in graph.of_type(Sensor)}
    for y in made.outputs.values():
        assert np.isfinite(y).all()
        assert np.ptp(y) > 0.0


def test_damper_without_states_is_static() -> None:
    graph = REAL_CASES["mr_damper"].model()
    v = np.sin(np.linspace(0.0, 9.0, 50))
    assert compile_model(graph).n_x == 0
    made = simulate(graph, 0.01 * np.arange(50), {"v": v}, {"c": 700.0})
    assert np.allclose(made.outputs["F"], -700.0 * v)


def test_piston_balances_pressure_and_seal() -> None:
    graph = REAL_CASES["pneumatic_cylinder_3bar"].model()
    rng = np.random.default_rng(1)
    p, v = 3e5 + 1e3 * rng.normal(size=40), 0.01 * rng.normal(size=40)
    made = simulate(graph, 0.01 * np.arange(40), {"p": p, "v": v}, {"A": 5e-4, "seal": 80.0})
    assert np.allclose(made.outputs["F"], 5e-4 * p + 80.0 * v)


def test_maxwell_damper_yields_and_springs_back() -> None:
    graph = REAL_CASES["friction_damper_70lb"].model()
    v = np.concatenate((np.full(2000, 0.05), np.zeros(2000)))
    made = simulate(graph, 1e-3 * np.arange(4000), {"v": v}, {"k": 5e6, "c": 1e5}, x0=np.zeros(1))
    force = made.outputs["F"]
    assert force[1] == pytest.approx(5e6 * 0.05 * 1e-3, rel=0.05)  # the spring takes the first way
    assert force[1999] == pytest.approx(1e5 * 0.05, rel=1e-3)  # then the dashpot yields
    assert force[2021] == pytest.approx(force[2001] / np.e, rel=0.02)  # c / k is 20 ms


def test_motor_and_servo_settle_where_textbooks_say() -> None:
    motor = REAL_CASES["dc_motor_board1"].model()
    made = simulate(motor, 1e-3 * np.arange(2000), {"u": np.full(2000, 3.0)}, x0=np.zeros(1))
    assert made.outputs["w"][-1] == pytest.approx(3.0 * 2e-3 / (2e-3**2 + 10.0 * 6e-7), rel=1e-3)
    servo = REAL_CASES["hobby_servo_small"].model()
    made = simulate(servo, 1e-3 * np.arange(2000), {"u": np.full(2000, 0.3)}, x0=np.zeros(2))
    assert made.outputs["q"][-1] == pytest.approx(0.3, rel=1e-3)


def test_heaters_balance_loss_and_exchange() -> None:
    graph = REAL_CASES["heaters_setpoints"].model()
    n = 3000
    made = simulate(
        graph, np.arange(n, dtype=float), {"Q1": np.full(n, 0.5), "Q2": np.zeros(n)}, x0=np.zeros(2)
    )
    t1, t2 = (made.outputs[k][-1] for k in ("T1", "T2"))
    assert t2 / 83.0 == pytest.approx((t1 - t2) / 200.0, rel=1e-3)
    assert (t1 + t2) / 83.0 == pytest.approx(0.5, rel=1e-3)


def test_first_mode_rings_at_20_hz() -> None:
    graph = REAL_CASES["piezo_beam"].model()
    kick = np.zeros(2000)
    kick[0] = 1.0
    made = simulate(graph, 1e-3 * np.arange(2000), {"i": kick}, x0=np.zeros(2))
    ringing = np.abs(np.fft.rfft(made.outputs["v"]))
    assert np.fft.rfftfreq(2000, 1e-3)[ringing.argmax()] == pytest.approx(20.0, abs=0.5)


def test_f16_accelerometers_read_accelerations() -> None:
    graph = REAL_CASES["f16_level1"].model()
    made = simulate(graph, 1e-4 * np.arange(200), {"F": np.full(200, 5.0)}, x0=np.zeros(4))
    assert made.outputs["a2"][0] == pytest.approx(5.0 / 100.0)  # force by the wing's mass
    assert made.outputs["a3"][0] == pytest.approx(0.0, abs=1e-12)


# --- preparing ------------------------------------------------------------------------------


def made_up(name: str = "made_up", n: int = 100, dt: float = 0.01) -> Recording:
    t = dt * np.arange(n, dtype=np.float64)
    return Recording(name, t, {"u": np.sin(t), "y": np.cos(t)}, {"u": "V", "y": "m"})


def test_parts_are_joined_thinned_and_split() -> None:
    r = made_up()
    whole = joined("whole", (r.slice(0, 60), r.slice(60, 100)), "both parts")
    assert np.array_equal(whole["y"], r["y"])
    assert np.allclose(whole.time, r.time)
    assert "both parts" in whole.notes
    kept = thinned(r, 4)
    assert np.array_equal(kept["y"], r["y"][::4])
    assert "every 4th sample is kept" in kept.notes
    assert not any("low-pass" in n for n in kept.notes)
    split = boundary_split(whole, 60, "rule", skip=5)
    assert (split.train, split.test) == (slice(5, 60), slice(65, 100))
    with pytest.raises(UnusableInput, match="no split at sample"):
        boundary_split(whole, 100, "rule")
    with pytest.raises(UnusableInput, match="differ in rate"):
        joined("whole", (r, made_up(dt=0.02)), "")


def test_recordings_from_own_states_are_joined_and_taken_apart() -> None:
    parts = [made_up(f"r{i}", n) for i, n in enumerate((40, 30, 20))]
    whole, split = apart("whole", 1, "the last judges", {"u": "u", "y": "y"})(*parts)
    assert whole.meta["breaks"] == (40, 70)
    assert (split.train, split.test) == (slice(0, 70), slice(70, 90))
    back = stretches_of(whole)
    assert [r.name for r in back] == ["r0", "r1", "r2"]
    assert [r.notes for r in back] == [r.notes for r in parts]  # each has its own, not those of all
    for one, was in zip(back, parts, strict=True):
        assert np.array_equal(one["y"], was["y"])
    assert stretches_of(parts[0]) == (parts[0],)


def test_a_record_in_pieces_loses_only_what_is_left_at_the_end() -> None:
    whole_one = Recording.from_arrays("run", {"x[m]": np.arange(95.0)}, fs=100.0)
    made, split = in_pieces(whole_one, 10)
    pieces = stretches_of(made)
    assert [p["x"][0] for p in pieces] == [0, 10, 30, 40, 60, 70, 20, 50, 80]
    assert all(p.n == 10 for p in pieces)
    assert (whole(split.train), whole(split.test)) == (slice(0, 60), slice(60, 90))


def test_mirror_keeps_low_lines_and_the_noise_between_lines() -> None:
    n, rate = 2 * PERIOD, 6400.0
    t = np.arange(n, dtype=np.float64) / rate
    low, high = 2.0 * np.pi * 100 / 1.28, 2.0 * np.pi * 400 / 1.28  # lines of one period
    noise = 0.1 * np.sin(2.0 * np.pi * 801 / 2.56 * t)  # between the lines, above the band
    y = np.sin(low * t) + np.sin(high * t) + noise
    made = below_resonance(Recording("mirror", t, {"y": y}, {"y": "m"}))
    assert made.fs == pytest.approx(800.0)
    assert 400 / 1.28 > BAND
    assert np.allclose(made["y"], (np.sin(low * t) + noise)[::8], atol=1e-10)


# --- judging --------------------------------------------------------------------------------


def said(effect: str, element: str, *same: str, **more: Any) -> dict[str, Any]:
    place = {"element": element, "kind": "resistor", "indistinguishable_from": list(same)}
    finding = {"effect": effect, "family": "", "location": place, "also_possible": [], **more}
    return {"verdict": "missing_physics", "findings": [finding]}


@pytest.mark.parametrize(
    ("verdict", "outcome"),
    [
        (said("presliding_friction", "c"), "right"),
        (said("presliding_friction", "F", "c"), "right"),
        (said("presliding_friction", "F"), "wrong place"),
        (said("saturation", "c"), "wrong name"),
        (said("quadratic_drag", "c"), "wrong name"),
        (said("unknown", "c", family="friction"), "family"),
        (said("unknown", "c", family="drive"), "wrong name"),
        (said("unknown", "c", family="outside"), "unknown"),
        (
            said(
                "unknown", "c", family="outside",
                answer="look_alikes",
                also_possible=[{"effect": "creep"}, {"effect": "coulomb_friction"}],
            ),
            "look-alike set",
        ),
        (
            said(
                "unknown", "c", family="outside",
                answer="look_alikes", kind="memory",
                also_possible=[{"effect": "hysteresis"}, {"effect": "coulomb_friction"}],
            ),
            "set of the kind",
        ),
        (
            said(
                "unknown", "c", family="outside",
                answer="look_alikes", kind="sensing",
                also_possible=[{"effect": "creep"}, {"effect": "coulomb_friction"}],
            ),
            "look-alike set",
        ),
        (
            said(
                "unknown", "c", "F", family="outside", answer="unknown",
                also_possible=[
                    {"effect": "unknown", "element": "c", "kind": "memory"},
                    {"effect": "unknown", "element": "F", "kind": "sensing"},
                ],
            ),
            "look-alike set",
        ),
        (
            said(
                "unknown", "c", family="outside", answer="unknown",
                also_possible=[
                    {"effect": "unknown", "element": "c", "kind": "memory"},
                    {"effect": "unknown", "element": "c", "kind": "dissipative"},
                ],
            ),
            "set of the kind",
        ),
        (
            said(
                "unknown", "c", family="outside", answer="look_alikes",
                also_possible=[{"effect": "presliding_friction"}, {"effect": "coulomb_friction"}],
            ),
            "set of the kind",
        ),
        (
            said(
                "unknown", "F", family="outside", answer="unknown",
                also_possible=[{"effect": "unknown", "element": "F", "kind": "memory"}],
            ),
            "unknown",
        ),
        (said("unknown", "c", answer="kind", kind="dissipative"), "right kind"),
        (said("unknown", "F", "c", answer="kind", kind="memory"), "right kind"),
        (said("unknown", "F", answer="kind", kind="dissipative"), "wrong place"),
        (said("unknown", "c", answer="kind", kind="sensing"), "wrong name"),
        (said("unknown", "F", answer="kind", kind="sensing"), "wrong name"),
        (said("unknown", "", answer="kind", kind="dissipative"), "unknown"),
        (said("unknown", "c", family="outside", kind="dissipative"), "unknown"),
        (said("presliding_friction", "c", answer="exact", kind="dissipative"), "right"),
        ({"verdict": "unknown_physics", "findings": []}, "unknown"),
        ({"verdict": "explained", "findings": []}, "no finding"),
        ({"verdict": "insufficient_data", "findings": []}, "no finding"),
    ],
)  # fmt: skip
def test_verdicts_are_judged(verdict: dict[str, Any], outcome: str) -> None:
    made = judge(REAL_CASES["mr_damper"], verdict)
    assert made.outcome == outcome
    assert outcome in OUTCOMES


def test_worst_of_several_findings_counts_and_a_control_may_be_quiet() -> None:
    two = said("presliding_friction", "c")
    two["findings"] += said("delay", "F")["findings"]
    made = judge(REAL_CASES["mr_damper"], two)
    assert made.outcome == "wrong name"
    assert made.said == "presliding_friction + delay"
    assert made.place == "c + F"
    quiet = {"verdict": "explained", "findings": []}
    assert judge(REAL_CASES["f16_level1"], quiet).outcome == "right"


def test_what_comes_nearest_is_noted_and_counts_as_no_answer() -> None:
    near = [
        {"effect": "unknown", "element": "c", "kind": "memory", "share": 0.4},
        {"effect": "creep", "element": "k", "kind": "", "share": 0.1},
    ]
    verdict = said("unknown", "", family="outside", answer="unknown", nearest=near)
    made = judge(REAL_CASES["mr_damper"], verdict)
    assert (made.outcome, made.note) == ("unknown", "nearest: memory at c 40 %, creep at k 10 %")


def test_kinds_are_judged_among_several_findings() -> None:
    case = REAL_CASES["mr_damper"]
    kind = said("unknown", "c", answer="kind", kind="memory")
    made = judge(case, kind)
    assert (made.said, made.place, made.note) == ("memory (kind)", "c", "")
    two = {**kind, "findings": kind["findings"] + said("delay", "F")["findings"]}
    assert judge(case, two).outcome == "wrong name"
    two["findings"] = kind["findings"] + said("unknown", "F")["findings"]
    assert judge(case, two).outcome == "right kind"
    other = judge(case, said("unknown", "c", answer="kind", kind="time"))
    assert other.note == "right kinds are dissipative, memory"
    assert judge(case, said("unknown", "F", answer="kind", kind="memory")).note.endswith(" at c")


# --- running --------------------------------------------------------------------------------


def write_damper(folder: Path) -> None:
    """Write a made-up record under the name of the real one."""
    t = np.arange(3499) / 200.0
    v = np.sin(5.0 * t)
    rows = np.stack([t, v, -7.0 * v], axis=1)
    (folder / "mr-damper").mkdir(parents=True)
    np.savetxt(
        folder / "mr-damper" / "mr_damper.csv", rows, "%.6f", ",",
        header="t_s,velocity_cm_per_s,force_N", comments="",
    )  # fmt: skip


def test_each_case_is_run_once_and_failures_are_kept(tmp_path: Path) -> None:
    from identification.diagnosis.diagnose import Diagnosis

    write_damper(tmp_path / "recordings")
    calls = []

    def too_little(graph: Any, recording: Recording, split: Any, **more: Any) -> Diagnosis:
        calls.append(more["model"])
        assert split.train == slice(0, 2000)
        return Diagnosis("insufficient_data", more["model"], recording, graph, notes=("made up",))

    def broken(*given: Any, **more: Any) -> Diagnosis:
        raise ZeroDivisionError("made | up")

    place = str(tmp_path / "recordings")
    for _ in range(2):
        (made,) = run_cases(tmp_path / "out", ("mr_damper",), recordings=place, diagnose=too_little)
        assert made.outcome == "no finding"
        assert made.samples == 3499
    assert calls == ["mr_damper"]
    kept = tmp_path / "out" / "mr_damper"
    assert json.loads((kept / "verdict.json").read_text())["verdict"] == "insufficient_data"
    assert (kept / "report.html").stat().st_size > 0
    assert read_outcome(kept) == made
    for _ in range(2):
        (made,) = run_cases(tmp_path / "bad", ("mr_damper",), recordings=place, diagnose=broken)
        assert (made.outcome, made.failure) == ("failed", "ZeroDivisionError: made | up")
    assert "Traceback" in (tmp_path / "bad" / "mr_damper" / "failure.txt").read_text()
    assert "ZeroDivisionError" in (tmp_path / "bad" / "real.md").read_text()
    (made,) = run_cases(tmp_path / "bad", ("emps",), recordings=place, diagnose=broken)
    assert made.outcome == "absent"
    assert read_outcome(tmp_path / "bad" / "emps") is None
    (kept / "outcome.json").write_text("{}")
    with pytest.raises(UnusableInput, match="remove the folder"):
        read_outcome(kept)


def write_servo(folder: Path) -> None:
    rows = [
        f"{i},4,{j / 50},{np.sin(j + i):.5f},{np.sin(j + i - 1):.5f}\n"
        for i in range(96) for j in range(60)
    ]  # fmt: skip
    (folder / "hobby-servo-arm").mkdir(parents=True)
    head = "rollout,kind,t_s,command_rad,angle_rad\n"
    (folder / "hobby-servo-arm" / "rollouts.csv").write_text(head + "".join(rows))


def test_rollouts_are_diagnosed_as_recordings_of_their_own(tmp_path: Path) -> None:
    from identification.diagnosis.diagnose import Diagnosis

    write_servo(tmp_path)
    given: list[Any] = []

    def looked(graph: Any, recording: Any, split: Any, **more: Any) -> Diagnosis:
        given.append((recording, split))
        return Diagnosis("insufficient_data", more["model"], recording[0], graph)

    place = str(tmp_path)
    (made,) = run_cases(tmp_path / "out", ("hobby_servo_large",), recordings=place, diagnose=looked)
    ((stretches, split),) = given
    assert made.outcome == "no finding"
    assert made.samples == 12 * 60
    assert [r.n for r in stretches] == [60] * 12
    assert [r.name.rpartition("/")[2] for r in stretches[-4:]] == [
        f"rollout_{i}" for i in (42, 45, 48, 51)
    ]
    assert (split.train, split.test) == (slice(0, 480), slice(480, 720))


def test_diagnosis_takes_what_it_is_called_with() -> None:
    from identification.diagnosis.diagnose import diagnose
    from identification.diagnosis.search.candidates import DiagnosisOptions

    names = inspect.signature(diagnose).parameters
    assert {"model", "options", "progress"} <= set(names)
    assert DiagnosisOptions(jobs=1).jobs == 1


def test_table_shows_values_with_units() -> None:
    o = Outcome(
        "case", "unseen", "right", "creep", "C", verdict="missing_physics", before={"x": 2e-6},
        after={"x": 1e-7}, floor={"x": 9e-8}, units={"x": "m"}, seconds=3.2, published="1 um | me",
        kind="slow", official={"arrow": {"x": 3e-7}},
    )  # fmt: skip
    row = table((o,)).splitlines()[2]
    assert "| missing_physics | slow | creep | C | 2e-06 m" in row
    assert "2e-06 m | 1e-07 m | 9e-08 m | arrow 3e-07 m | 1 um / me | 3 | right" in row
    assert "1 unseen: 1 right name, 0 right kind," in table((o,))


def ended(outcome: str, place: str = "C", **more: Any) -> Outcome:
    return Outcome("case", more.pop("label", "unseen"), outcome, place=place, **more)


def silent(verdict: str, error: float, **more: Any) -> Outcome:
    errors = {"a": 1.0, "b": error}
    return ended(
        more.pop("outcome", "no finding"), "", said="nothing", verdict=verdict, before=errors,
        floor={"a": 1.0, "b": 1.0}, **more,
    )  # fmt: skip


def test_summary_counts_every_outcome_and_what_was_answered() -> None:
    found = [
        ended("right"), ended("right kind"), ended("right kind"), ended("family"),
        ended("family", ""), ended("look-alike set"), ended("set of the kind"), ended("unknown"),
        silent("explained", 3.1), silent("parameters_only", 2.9),
        silent("insufficient_data", 9.0), ended("wrong name"), ended("wrong place"),
        ended("failed", ""), ended("absent", ""), ended("right", label="seen before"),
    ]  # fmt: skip
    unseen, seen = counts(found).split("\n\n")
    assert unseen == (
        "15 unseen: 1 right name, 2 right kind, 1 look-alikes of the right kind, 2 family, 1 other "
        "look-alikes, 1 unknown, 3 no finding (1 of these false reassurance), 1 wrong name, 1 "
        "wrong place, 1 failed, 1 absent. "
        "Answered (right name, family, or kind at the right place): 5 of 14."
    )
    assert seen.startswith("1 seen before: 1 right name, 0 right kind")
    assert seen.endswith("1 of 1.")
    assert counts(()) == "nothing was run."


def test_false_reassurance_needs_a_quiet_verdict_and_one_loud_reading() -> None:
    assert silent("explained", 3.1).false_reassurance
    assert not silent("explained", 3.0).false_reassurance
    assert not silent("unknown_physics", 3.1).false_reassurance
    repaired = Outcome(
        "case",
        "unseen",
        "right",
        verdict="parameters_only",
        before={"y": 9.0},
        after={"y": 1.0},
        floor={"y": 1.0},
    )
    assert not repaired.false_reassurance
    control = silent("explained", 3.1, outcome="right")
    assert "0 right name" in counts([control])
    assert "1 rightly nothing (1 of these false reassurance)" in counts([control])
    assert counts([control]).endswith("0 of 1.")


def test_command_lists_the_cases(capsys: pytest.CaptureFixture[str]) -> None:
    import argparse

    from tests.proof.real.command import add_real_command

    parser = argparse.ArgumentParser()
    add_real_command(parser.add_subparsers())
    options = parser.parse_args(["real", "--list"])
    assert options.run(options) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == len(NAMES)
    assert (
        "hair_dryer (seen before): delay, low_pass, sensor_lag, added_mode (kind: command"
        in (lines[-1])
    )


# --- the recordings: channels, units, and a plain fit ---------------------------------------


@pytest.mark.recordings
@pytest.mark.parametrize("name", [n for n in NAMES if n != "steering_mirror_100mV"])
def test_recordings_match_the_models(name: str) -> None:
    case = REAL_CASES[name]
    if not set_available(case.dataset):
        pytest.skip(f"{case.dataset}: set {FOLDER_VARIABLE} to the folder of the recordings")
    recording, split = case.load(None)
    graph = case.model()
    data = data_for(graph, recording, split, {s.name: 1.0 for s in graph.of_type(Sensor)})
    assert 400 < recording.n <= 20_000
    assert whole(split.train).stop <= whole(split.test).start
    assert split.rule
    assert min(data.mask("train").sum(), data.mask("test").sum()) >= 100


@pytest.mark.recordings
@pytest.mark.parametrize(
    ("name", "least", "most"), [("mr_damper", 0.5, 0.7), ("rack_and_pinion", 0.1, 0.6)]
)
def test_textbook_models_leave_the_documented_error(name: str, least: float, most: float) -> None:
    from identification.diagnosis.search.nominal import nominal_fit

    case = REAL_CASES[name]
    if not set_available(case.dataset):
        pytest.skip(f"{case.dataset}: set {FOLDER_VARIABLE} to the folder of the recordings")
    recording, split = case.load(None)
    graph = case.model()
    sensors = tuple(s.name for s in graph.of_type(Sensor))
    data = data_for(graph, recording, split, noise_floor(recording, split, sensors))
    _, fitted = nominal_fit(graph, data)
    (error,) = fitted.rmse("test").values()
    left = error / float(data.readings[data.mask("test")].std())
    assert least < left < most
