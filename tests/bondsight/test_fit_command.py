"""``bondsight fit``: right values, files that reopen, one line for what cannot be used."""

from __future__ import annotations

import json
from collections.abc import Callable
from html import unescape
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from actuators.models.opening import load_model
from bondgraph.support.arrays import FloatArray as Array
from bondsight.cli.main import main
from bondsight.cli.progress import Bar
from identification.estimation import FitStatus
from identification.estimation.archive import open_fit
from identification.report import canvas
from tests.settled import simulate

TRUTH = {"m": 0.5, "d": 2.0, "k": 200.0}
NOISE = 2e-4
RATE = 100.0
FILES = {"fit.html", "fit.json", "fit.npz"}
MODEL = """
from bondgraph import BondGraph, C, Dq, I, One, R, Se

def model(m=0.7, d=1.0, k=300.0):
    with BondGraph("carriage") as g:
        v = One("v")
        Se("F", unit="N") >> v >> I("m", m, unit="kg")
        v >> R("d", d, unit="N*s/m")
        v >> C("k", stiffness=k, unit="N/m")
        v >> Dq("x", unit="m")
    return g
"""


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("model") / "carriage.py"
    path.write_text(MODEL)
    return path


@pytest.fixture(autouse=True)
def undrawn(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave the figures of the pages undrawn but where the files are looked at."""
    if request.node.name != test_values_files_and_reopening.__name__:
        monkeypatch.setattr(canvas, "inline", lambda *_: "<svg></svg>")


def force(n: int, seed: int) -> Array:
    rng = np.random.default_rng(seed)
    tone = 4 * np.sin(2 * np.pi * 1.1 * np.arange(n) / RATE)
    return np.asarray(np.cumsum(rng.standard_normal(n)) * 0.3 + tone)


def moved(model: Path, u: Array, **values: float) -> Array:
    graph = load_model(str(model)).with_values({**TRUTH, **values})
    y = np.asarray(simulate(graph, np.arange(u.size) / RATE, {"F": u}, hold="linear")["x"])
    return y + NOISE * np.random.default_rng(u.size).standard_normal(u.size)


def table(path: Path, header: str, *columns: Array) -> Path:
    np.savetxt(path, np.column_stack(columns), "%.9g", ",", header=header, comments="")
    return path


def record(path: Path, model: Path, n: int = 600, seed: int = 1, **values: float) -> Path:
    u = force(n, seed)
    return table(path, "t[s],F[N],x[m]", np.arange(n) / RATE, u, moved(model, u, **values))


def fitted(folder: Path) -> dict[str, Any]:
    found = json.loads((folder / "fit.json").read_text(encoding="utf-8"))
    assert isinstance(found, dict)
    return found


def misses(document: dict[str, Any], truth: dict[str, float]) -> dict[str, float]:
    """Return the distance of each value to the truth in standard errors."""
    rows = {row["name"]: row for row in document["parameters"]}
    return {
        n: abs(rows[n]["value"] - true) / (np.diff(rows[n]["ci95"])[0] / 3.92)
        for n, true in truth.items()
    }


def test_values_files_and_reopening(
    model: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    first = record(tmp_path / "run.csv", model)
    other = record(tmp_path / "other.csv", model, 400, 2)
    out = tmp_path / "out"
    options = ["--model", str(model), "--validate", str(other), "--init", "50", "--out", str(out)]
    assert main(["fit", str(first), *options]) == 0
    printed = capsys.readouterr()
    assert {p.name for p in out.iterdir()} == FILES
    assert "<title>Fit of carriage</title>" in (out / "fit.html").read_text(encoding="utf-8")
    document = fitted(out)
    assert document["status"] == "converged"
    far = misses(document, TRUTH)
    assert max(far.values()) < 4
    for row in document["parameters"]:
        assert np.diff(row["ci95"])[0] < 0.1 * row["value"]
        assert row["name"] in printed.out
    train, judged = document["recordings"]
    assert train["test_rmse"]["x"] == pytest.approx(NOISE, rel=0.25)
    assert judged["train_rmse"]["x"] is None
    assert judged["test_rmse"]["x"] == pytest.approx(NOISE, rel=0.25)
    again = open_fit(out / "fit.npz")
    assert again.status is FitStatus.CONVERGED
    for row in document["parameters"]:
        assert again.values[row["name"]] == row["value"]
    assert again.rmse("test", 1)["x"] == judged["test_rmse"]["x"]


def test_json_on_standard_output_is_the_file(
    model: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = record(tmp_path / "run.csv", model, 300)
    options = ["--model", str(model), "--fix", "m=0.5", "--json", "--out", str(tmp_path / "out")]
    assert main(["fit", str(run), *options]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document == fitted(tmp_path / "out")
    assert [row["name"] for row in document["parameters"]] == ["d", "k"]


def test_own_parameters_stay_with_their_recordings(
    model: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    soft = record(tmp_path / "soft.csv", model, seed=1, k=150.0)
    stiff = record(tmp_path / "stiff.csv", model, seed=2, k=250.0)
    out = str(tmp_path / "out")
    words = ["fit", str(soft), str(stiff), "--model", str(model), "--own", "k", "--out", out]
    assert main([*words, "--validate", str(stiff), "--init", "50"]) == 0
    document = fitted(tmp_path / "out")
    truth = {"m": 0.5, "d": 2.0, "k @soft": 150.0, "k @stiff": 250.0}
    # the validation file has the name of a fitted one: names are numbered then
    rows = {row["name"].split("#")[0]: row for row in document["parameters"]}
    document["parameters"] = [{**row, "name": n} for n, row in rows.items()]
    assert max(misses(document, truth).values()) < 4
    # a stiffness of its own is not known for a recording that is only judged: said in words
    assert any("k of soft" in note for note in document["notes"])
    capsys.readouterr()


def test_decay_without_a_moving_command(model: Path, tmp_path: Path) -> None:
    n = 400
    t = np.arange(n) / RATE
    w = np.sqrt(TRUTH["k"] / TRUTH["m"] - 4.0)
    x = 0.05 * np.exp(-2 * t) * (np.cos(w * t) + 2 / w * np.sin(w * t))
    x += 1e-4 * np.random.default_rng(0).standard_normal(n)
    run = table(tmp_path / "swing.csv", "t[s],F[N],x[m]", t, 0 * t, x)
    out = tmp_path / "out"
    assert main(["fit", str(run), "--model", str(model), "--fix", "m=0.5", "--out", str(out)]) == 0
    assert max(misses(fitted(out), {"d": 2.0, "k": 200.0}).values()) < 4


def _texts(rows: int) -> str:
    lines = [f"{i / RATE},{'abc' if i == 7 else i % 5},{0.01 * (i % 3)}" for i in range(rows)]
    return "\n".join(["t[s],F[N],x[m]", *lines]) + "\n"


def _columns(change: Callable[[Array, Array, Array], tuple[Array, Array, Array]]) -> str:
    t, u = np.arange(200) / RATE, force(200, 1)
    rows = np.column_stack(change(t, u, 1e-3 * u))
    return "t[s],F[N],x[m]\n" + "\n".join(",".join(f"{v:.6g}" for v in row) for row in rows)


def _with(values: Array, where: slice, what: float) -> Array:
    changed = values.copy()
    changed[where] = what
    return changed


BAD_FILES = {
    "empty": ("", "empty"),
    "only a header": ("t[s],F[N],x[m]\n", "no row"),
    "text": (_texts(50), "'abc' is not a number"),
    "one sample": ("t[s],F[N],x[m]\n0,1,2\n", "1 sample"),
    "no unit": ("t[s],F,x\n0,1,2\n0.1,2,3\n0.2,1,2\n", "no unit"),
    "nan burst": (
        _columns(lambda t, u, x: (t, u, _with(x, slice(60, 90), np.nan))),
        "30 of 200 values are NaN",
    ),
    "uneven time": (_columns(lambda t, u, x: (t + (t > 1) * 0.004, u, x)), "uneven time"),
    "constant reading": (_columns(lambda t, u, x: (t, u, 0 * x + 0.01)), "constant"),
    "all zero": (_columns(lambda t, u, x: (t, 0 * u, 0 * x)), "constant"),
}


@pytest.mark.parametrize("name", BAD_FILES)
def test_bad_files_are_refused_in_one_line(
    name: str, model: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text, said = BAD_FILES[name]
    run = tmp_path / "bad.csv"
    run.write_text(text)
    out = tmp_path / "out"
    assert main(["fit", str(run), "--model", str(model), "--out", str(out)]) == 2
    printed = capsys.readouterr()
    (line,) = printed.err.splitlines()
    assert line.startswith("bondsight: ")
    assert "bad" in line
    assert said in line
    assert not printed.out
    assert not out.exists() or not any(out.iterdir())


BAD_OPTIONS = {
    "unknown free": (["--free", "m", "q"], "no free parameter 'q'"),
    "no number": (["--fix", "k=abc"], "no number"),
    "negative stiffness": (["--fix", "k=-5"], "must be positive"),
    "not finite": (["--start", "m=inf"], "not a finite number"),
    "start outside of bounds": (["--bound", "k=:100"], "outside of its bounds"),
    "prior of no width": (["--prior", "k=200:0.5"], "factor above 1"),
    "unknown method": (["--method", "magic"], "no method 'magic'"),
    "window of one": (["--window", "1"], "window = 1"),
    "column that is not there": (["--map", "x=nothere"], "no column 'nothere'"),
    "bound of a fixed one": (["--free", "m", "--bound", "k=1:2"], "k is not free"),
    "free and fixed": (["--free", "m", "k", "--fix", "k=3"], "as free and as fixed"),
}


@pytest.mark.parametrize("name", BAD_OPTIONS)
def test_bad_options_are_refused_in_one_line(
    name: str, model: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words, said = BAD_OPTIONS[name]
    run = record(tmp_path / "run.csv", model, 200)
    out = tmp_path / "out"
    assert main(["fit", str(run), "--model", str(model), "--out", str(out), *words]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert said in line
    assert not out.exists() or not any(out.iterdir())


@pytest.mark.parametrize(
    ("name", "said"),
    [pytest.param("milli", "unit", marks=pytest.mark.long), ("reversed", "sign")],
)
def test_suspect_readings_are_said_in_words(
    name: str, said: str, model: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    u = force(500, 3)
    x = moved(model, u)
    changed = {"milli": 1e3 * x, "reversed": -x}[name]
    run = table(tmp_path / "run.csv", "t[s],F[N],x[m]", np.arange(500) / RATE, u, changed)
    main(["fit", str(run), "--model", str(model), "--out", str(tmp_path / "out")])
    lines = capsys.readouterr().err.splitlines()
    assert any(line.startswith("bondsight: ") and said in line for line in lines)


@pytest.mark.parametrize(("rise", "told"), [(0.0, False), (0.05, True)])
def test_drift_is_told_where_the_fit_leaves_it(
    rise: float, told: bool, model: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Beside wrong start values a slow plant had been told to drift, before it was fitted."""
    u = np.cumsum(force(500, 3)) * 0.05
    x = moved(model, u, k=450.0) + rise * np.linspace(-1.0, 1.0, 500)
    run = table(tmp_path / "run.csv", "t[s],F[N],x[m]", np.arange(500) / RATE, u, x)
    main(["fit", str(run), "--model", str(model), "--out", str(tmp_path / "out")])
    assert ("drift" in capsys.readouterr().err) is told


def test_bounds_that_exclude_the_truth(
    model: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = record(tmp_path / "run.csv", model)
    options = ["--model", str(model), "--bound", "k=250:400", "--out", str(tmp_path / "out")]
    assert main(["fit", str(run), *options]) == 0
    rows = {row["name"]: row for row in fitted(tmp_path / "out")["parameters"]}
    assert rows["k"]["at_bound"]
    assert rows["k"]["value"] == pytest.approx(250.0)
    printed = capsys.readouterr().out
    assert "k stopped at its lower bound" in printed
    assert "its interval means nothing" in printed


def test_ctrl_c_keeps_the_best_so_far(
    model: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    said: list[str] = []

    def stop(bar: Bar, text: str, fraction: float) -> None:
        said.append(text)
        if len(said) == 3:
            raise KeyboardInterrupt

    monkeypatch.setattr(Bar, "__call__", stop)
    run = record(tmp_path / "run.csv", model)
    out = tmp_path / "out"
    assert main(["fit", str(run), "--model", str(model), "--out", str(out)]) == 130
    assert "cancelled" in capsys.readouterr().err
    assert {p.name for p in out.iterdir()} == FILES
    document = fitted(out)
    assert document["status"] == "cancelled"
    start = {"m": 0.7, "d": 1.0, "k": 300.0}
    values = {row["name"]: row["value"] for row in document["parameters"]}
    assert any(values[n] != start[n] for n in start)
    assert open_fit(out / "fit.npz").status is FitStatus.CANCELLED


def not_fine(printed: str) -> list[str]:
    """Return the lines of what is not fine, less those of its advice."""
    told = printed.partition("What is not fine")[2].partition("\n\n")[0]
    return [line for line in told.splitlines() if line.startswith("  - ")]


def test_a_fit_that_ends_in_a_valley_begins_again_from_short_stretches(
    model: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = record(tmp_path / "run.csv", model, k=2000.0, d=0.3)  # its resonance is far from declared
    assert main(["fit", str(run), "--model", str(model), "--out", str(tmp_path), "--quiet"]) == 0
    printed = capsys.readouterr().out
    assert "the first fit ended at 5.6" in printed
    assert fitted(tmp_path)["parameters"][2]["value"] == pytest.approx(2000.0, rel=0.01)
    assert open_fit(tmp_path / "fit.npz").values["k"] == pytest.approx(2000.0, rel=0.01)


@pytest.mark.long
def test_exchanged_columns_are_said_before_anything_that_comes_of_it(
    model: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    u = force(600, 1)
    run = table(tmp_path / "run.csv", "t[s],F[N],x[m]", np.arange(600) / RATE, moved(model, u), u)
    assert main(["fit", str(run), "--model", str(model), "--out", str(tmp_path), "--quiet"]) == 0
    printed = capsys.readouterr().out
    assert printed.startswith("carriage: the recording looks wrong")
    first, rest = not_fine(printed)
    assert first.startswith("  - F and x look exchanged")
    assert rest.endswith("judgement.faults")
    assert "--map 'F=COLUMN[UNIT]' --map 'x=COLUMN[UNIT]'" in " ".join(printed.split())
    page = unescape((tmp_path / "fit.html").read_text(encoding="utf-8"))
    for told in (printed, page):
        assert "map={" not in told
    assert "--map 'x=COLUMN[UNIT]'" in page
    assert page.count("look exchanged") >= 1


def test_a_fit_far_above_the_noise_says_what_to_begin_from(
    model: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A stop that the model lacks: no other way down helps, and no column is mixed up."""
    u = force(600, 1)
    y = np.clip(moved(model, u), -0.01, 0.01)
    run = table(tmp_path / "run.csv", "t[s],F[N],x[m]", np.arange(600) / RATE, u, y)
    assert main(["fit", str(run), "--model", str(model), "--out", str(tmp_path), "--quiet"]) == 0
    printed = capsys.readouterr().out
    assert "\ncarriage: far above the noise\n" in f"\n{printed}"
    (*_, first, rest) = not_fine(printed)
    assert first.startswith("  - the fit ended far above the noise, ")
    assert "more that most likely come of it" in rest
    told = " ".join(printed.split())
    assert "try: begin from --starts 32 or from --start NAME=VALUE (may be repeated);" in told
