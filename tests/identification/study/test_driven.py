"""Dead inputs are named before anything is fitted; a fit of nothing ends in one line."""

from __future__ import annotations

import json
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

from bondgraph import BondGraph, Dq, I, One, R, Recording, Se, UnusableInput
from bondsight.cli.main import main
from identification.estimation import Study, estimate
from identification.study.driven import require_driven

T = np.arange(400) * 1e-2
MODEL = """
from bondgraph import BondGraph, Dq, I, One, R, Se

def model():
    with BondGraph("cart") as g:
        body = One("body")
        Se("F", unit="N") >> body >> I("m", 0.5, unit="kg")
        body >> R("d", 1.0, unit="N*s/m")
        body >> Dq("x", unit="m")
    return g
"""


def cart() -> BondGraph:
    with BondGraph("cart") as g:
        body = One("body")
        Se("F", unit="N") >> body >> I("m", 0.5, unit="kg")
        body >> R("d", 1.0, unit="N*s/m")
        body >> Dq("x", unit="m")
    return g


def record(force: object, x: object) -> Recording:
    whole = {"F[N]": force + 0 * T, "x[m]": x + 0 * T}  # type: ignore[operator]
    return Recording.from_arrays("run", whole, fs=100.0)


def test_a_dead_input_is_refused_a_constant_one_said() -> None:
    with pytest.raises(UnusableInput, match=r"input F is 0 in all 400 samples while x moves"):
        require_driven(cart(), [record(0.0, np.sin(3 * T))])
    (line,) = require_driven(cart(), [record(3.0, np.sin(3 * T))])
    assert line.startswith("input F is 3 in all 400 samples")
    assert require_driven(cart(), [record(0.0, 0.0), record(np.sin(T), np.sin(T))]) == ()


def test_a_model_without_a_source_and_what_it_does_not_use_is_said() -> None:
    with BondGraph("coasting") as g:
        body = One("body")
        body >> I("m", 0.5, unit="kg")
        body >> R("d", 1.0, unit="N*s/m")
        body >> Dq("x", unit="m")
    (line,) = require_driven(g, [record(np.sin(T), np.sin(T))])
    assert line == (
        "coasting has no source, so nothing but the start says what it does; columns that are no "
        "reading: F"
    )


def test_file_and_page_say_it_too(tmp_path: Path) -> None:
    model, run, out = tmp_path / "cart.py", tmp_path / "run.csv", tmp_path / "out"
    model.write_text(MODEL.replace('        Se("F", unit="N") >> body', "        body"))
    noise = 1e-6 * np.random.default_rng(0).normal(size=T.size)
    rows = "".join(
        f"{t:.2f},{v:.4g},{x:.4g}\n" for t, v, x in zip(T, np.sin(T), noise, strict=True)
    )
    run.write_text("t[s],F[N],x[m]\n" + rows)
    assert main(["diagnose", str(run), "--model", str(model), "--out", str(out), "--quiet"]) == 0
    said = "cart has no source"
    found = json.loads((out / "verdict.json").read_text())
    assert any(n.startswith(said) for n in found["notes"])
    assert found["advice"][0].startswith(said)
    assert said in (out / "report.html").read_text()


def test_noise_on_a_resting_sensor_is_no_motion() -> None:
    noise = np.random.default_rng(0).normal(size=T.size)
    assert require_driven(cart(), [record(0.0, noise)]) == ()


def test_diagnose_ends_before_a_fit(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model, run = tmp_path / "cart.py", tmp_path / "run.csv"
    model.write_text(MODEL)
    rows = "".join(f"{t:.2f},0,{np.sin(3 * t):.6f}\n" for t in T)
    run.write_text("t[s],F[N],x[m]\n" + rows)
    out = tmp_path / "out"
    assert main(["diagnose", str(run), "--model", str(model), "--out", str(out)]) == 2
    printed = capsys.readouterr()
    assert printed.err.startswith("bondsight: run: input F is 0")
    assert printed.err.count("\n") == 1
    assert not out.exists()


def test_what_a_library_raises_is_said_in_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    def stumbles(*_: object) -> None:
        raise ValueError("array must not contain infs or NaNs")

    monkeypatch.setattr(import_module("identification.estimation.estimate"), "_settled", stumbles)
    with pytest.raises(UnusableInput, match="x is constant: nothing can be fitted"):
        estimate(Study(cart(), record(np.sin(T), 0.25)))
    with pytest.raises(UnusableInput, match=r"infs or NaNs.*check values, units and bounds"):
        estimate(Study(cart(), record(np.sin(T), np.sin(T))))
