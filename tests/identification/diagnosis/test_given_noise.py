"""A noise that the user knows: it is what the answer rests on, and it is checked."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from bondgraph import BondGraph
from bondgraph.laws import Coulomb
from bondgraph.signals.recording import Recording
from bondgraph.support.errors import UnusableInput
from bondsight.cli.diagnose import noise_of
from bondsight.cli.main import main
from identification.diagnosis.diagnose import Diagnosis, diagnose
from identification.diagnosis.evidence.remaining import remaining
from identification.diagnosis.explanation.colour import COLOURED
from identification.diagnosis.explanation.notes import _noise_notes
from identification.diagnosis.search.asked import asked_of
from identification.diagnosis.search.candidates import DiagnosisOptions
from identification.diagnosis.search.material import given_noise, material_of
from identification.diagnosis.verdict import verdict
from identification.estimation.single_record import fit
from tests.settled import simulate
from tests.spring import spring

N, NOISE = 900, 2e-5


def run(truth: BondGraph) -> Recording:
    t = np.asarray(np.arange(N) * 0.01, np.float64)
    u = 4 * np.sin(2 * np.pi * 0.7 * t) + 2 * np.sin(2 * np.pi * 2.3 * t)
    x = simulate(truth, t, {"F": u})["x"] + NOISE * np.random.default_rng(1).standard_normal(N)
    return Recording("run", t, {"F": u, "x": x}, {"F": "N", "x": "m"})


@cache
def judged(noise: float | None = None, dry: float = 0.0) -> Diagnosis:
    """Diagnose a spring, or one that rubs, with a noise that is given."""
    options = DiagnosisOptions(jobs=1, keep=2, more=0, effects=1)
    truth = spring().with_element("d", law=Coulomb(dry)) if dry else spring()
    return diagnose(
        spring(), run(truth), options=options, noise=None if noise is None else {"x": noise}
    )


def slowly(seed: int, dry: float = 0.0) -> Diagnosis:
    """Diagnose a spring beside white noise and twice as much 1/f noise, all of it given."""
    n = 3000
    t, rng = np.asarray(np.arange(n) * 0.01, np.float64), np.random.default_rng(seed)
    u = 4 * np.sin(2 * np.pi * 0.7 * t) + 2 * np.sin(2 * np.pi * 2.3 * t)
    u[:200] = 0.0
    f = np.fft.rfftfreq(n)
    slow = np.fft.irfft(np.fft.rfft(rng.standard_normal(n)) / np.sqrt(np.maximum(f, f[1])), n)
    noise = NOISE * (rng.standard_normal(n) + 2.0 * slow / slow.std())
    truth = spring().with_element("d", law=Coulomb(dry)) if dry else spring()
    r = Recording(
        "run", t, {"F": u, "x": simulate(truth, t, {"F": u})["x"] + noise}, {"F": "N", "x": "m"}
    )
    options = DiagnosisOptions(jobs=1, keep=2, more=0, effects=1)
    return diagnose(spring(), r, options=options, noise={"x": NOISE * np.sqrt(5.0)})


@pytest.mark.parametrize("seed", [4, 6])
def test_slow_noise_that_is_given_is_no_finding(seed: int) -> None:
    """Forms with a memory follow 1/f noise; its own past foretells as much."""
    d = slowly(seed)
    assert d.kind == "explained"
    assert any("more than noise with a memory lets it" in r for r in d.steps[0].reasons)
    (note,) = [n for n in d.notes if n.startswith(COLOURED)]
    assert "within the noise you gave" in note
    assert "still missing" not in note


def test_beside_slow_noise_friction_is_found() -> None:
    d = slowly(4, dry=0.02)
    assert d.kind == "missing_physics"
    assert d.findings[0].chosen is not None
    assert (d.findings[0].chosen.element, d.findings[0].physics) == ("d", "dissipative")


def test_what_is_given_is_used_and_counts_as_measured() -> None:
    told, read = judged(1.1 * NOISE), judged()
    assert told.data is not None
    assert read.data is not None
    assert told.data.floor.tolist() == [1.1 * NOISE]
    assert told.data.floor_measured
    assert verdict(told)["fit"]["noise_floor"] == {"x": 1.1 * NOISE}
    assert told.kind == read.kind == "explained"
    assert not read.data.floor_measured
    assert any("noise={SENSOR: VALUE}" in n for n in read.notes)
    assert not any("noise" in n for n in told.notes)


def test_a_noise_that_is_given_of_one_reading_is_known_of_that_one() -> None:
    graph, silent = spring(speed="w"), run(spring())
    moved = simulate(graph, silent.time, {"F": silent["F"]})
    drawn = np.random.default_rng(2).standard_normal((2, N))
    channels = {"F": silent["F"], "x": moved["x"] + 5e-5 * drawn[0], "w": moved["w"] + drawn[1]}
    both = Recording("both", silent.time, channels, {"F": "N", "x": "m", "w": "m/s"})
    asked = asked_of(graph, both, None, None, {"x": 1e-5})
    data = material_of(asked).data
    assert not data.floor_measured
    assert dict(zip(data.names, data.sure, strict=True)) == {"x": True, "w": False}
    left = remaining(fit(asked.problem(data), max_iterations=4))
    assert left.over_noise["x"] == pytest.approx(5.0, rel=0.3)
    assert not left.is_noise(1.5)
    floor = dict(zip(data.names, map(float, data.floor), strict=True))
    (note,) = _noise_notes(floor, floor, ("x",), ("w",))
    assert note.startswith("the noise of w could only be estimated")
    (note,) = _noise_notes(floor, floor, (), ("x", "w"))
    assert note.startswith("the noise could only be estimated")


@pytest.mark.parametrize(("left", "doubted"), [(0.98, False), (0.06, True), (9.0, True)])
def test_a_noise_that_is_given_is_doubted_only_where_the_model_does_not_bear_it_out(
    left: float, doubted: bool
) -> None:
    """The recording looked fifty times as loud: a command with steps was in the reading."""
    notes = _noise_notes({"i": 0.0875}, {"i": 0.0017}, ("i",), (), None, {"i": left})
    assert any("check it" in n for n in notes) is doubted


def test_what_the_recording_declares_is_used_unless_the_user_says_otherwise() -> None:
    declared = replace(run(spring()), meta={"noise": {"x": 1.1 * NOISE, "other": 1.0}})
    options = DiagnosisOptions(jobs=1, keep=2, more=0, effects=1)
    for given, level in ((None, 1.1 * NOISE), ({"x": 0.9 * NOISE}, 0.9 * NOISE)):
        d = diagnose(spring(), declared, options=options, noise=given)
        assert d.data is not None
        assert d.data.floor.tolist() == [level]
        assert d.data.floor_measured


@pytest.mark.parametrize("factor", [0.1, 10.0])
def test_a_noise_unlike_that_of_the_recording_is_told(factor: float) -> None:
    d = judged(factor * NOISE)
    (note,) = [n for n in d.notes if "the noise given for x" in n]
    assert f"{factor * NOISE:.3g}" in note


def test_far_above_a_given_noise_nothing_is_called_explained() -> None:
    assert judged(0.1 * NOISE).kind == "unknown_physics"


def test_a_true_noise_that_is_given_hides_nothing() -> None:
    assert judged(NOISE, dry=0.05).kind in ("missing_physics", "unknown_physics")


@pytest.mark.parametrize("value", [0.0, -1.0, float("nan"), float("inf")])
def test_values_that_are_no_noise_are_refused(value: float) -> None:
    with pytest.raises(UnusableInput, match="noise of x"):
        given_noise({"x": value}, ("x",), "spring")


def test_a_noise_may_have_a_unit_of_its_reading() -> None:
    assert noise_of(["x=0.5um", "x2 = 2 nm", "v=1e-3"], spring()) == pytest.approx(
        {"x": 5e-7, "x2": 2e-9, "v": 1e-3}
    )


def test_names_that_are_no_sensor_are_refused() -> None:
    with pytest.raises(UnusableInput, match="'F'"):
        given_noise({"F": 1.0}, ("x",), "spring")
    assert given_noise({"x": 1}, ("x", "v"), "spring") == {"x": 1.0}


@pytest.mark.parametrize("text", ["x", "x=", "x=much", "=1", "F=1e-3", "x=0", "x=1ms", "x=1 much"])
def test_the_command_refuses_in_one_line(
    text: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "run.csv"
    r = run(spring())
    rows = zip(r.time, r["F"], r["x"], strict=True)
    lines = [f"{t:.2f},{u:.6g},{x:.8g}" for t, u, x in rows]
    file.write_text("t_s,F[N],x[m]\n" + "\n".join(lines) + "\n", encoding="utf-8")
    model = tmp_path / "model.py"
    model.write_text(
        "from bondgraph import BondGraph, Dq, I, One, Se\n\n\ndef model():\n"
        "    with BondGraph('mass') as g:\n        v = One('v')\n"
        "        Se('F', unit='N') >> v >> I('m', 0.5, unit='kg')\n"
        "        v >> Dq('x', unit='m')\n    return g\n",
        encoding="utf-8",
    )
    asked = ["diagnose", str(file), "--model", str(model), "--out", str(tmp_path / "o")]
    assert main([*asked, "--noise", text]) == 2
    error = capsys.readouterr().err.strip()
    assert "\n" not in error
    assert "noise" in error or "no sensor" in error
