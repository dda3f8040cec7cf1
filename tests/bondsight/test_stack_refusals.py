"""What ``bondsight stack`` and ``compensate`` refuse or tell: one line, and no file is left."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from actuators.stack.identified import IdentifiedStack
from actuators.stack.loading_curve import Interval
from bondgraph.hysteresis import AlJanaideh
from bondgraph.signals.recording import Recording
from bondsight.cli.main import main

RATE = 1000.0
STACK = AlJanaideh.stack_2hz()


@cache
def ramp() -> tuple[np.ndarray, np.ndarray]:
    volt = np.concatenate((np.zeros(200), np.linspace(0, 100, 2000), np.linspace(100, 0, 2000)))
    noise = 2e-9 * np.random.default_rng(0).standard_normal(volt.size)
    return volt, STACK.run(volt)[0] + noise


def saved(folder: Path, name: str, volt: np.ndarray, x: np.ndarray) -> str:
    time = np.arange(volt.size) / RATE
    record = Recording(name, time, {"V": volt, "x": x}, {"V": "V", "x": "m"})
    return str(record.save(folder / f"{name}.npz"))


def stack_file(folder: Path) -> str:
    one = Interval.of(3.5, 0.01)
    stack = IdentifiedStack(
        "known", ("ramp",), one, Interval.of(65e6, 1e5), STACK, (), 0.0, 100.0, 2e-9, 2e-9, 2e-9
    )
    stack.save(folder / "stack.json")
    return str(folder / "stack.json")


def refused(words: list[str], said: str, capsys: pytest.CaptureFixture[str]) -> None:
    capsys.readouterr()
    assert main(words) == 2, words
    error = capsys.readouterr().err
    assert said in error, (words, error)
    assert len(error.strip().splitlines()) == 1


def test_a_good_ramp_passes_and_one_says_what_it_does_not_tell(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    file = saved(tmp_path, "ramp", *ramp())
    figure = tmp_path / "loading.svg"
    assert main(["stack", "mechanical", file, "--stiffness", "65e6", "--out", str(figure)]) == 0
    said = capsys.readouterr()
    assert figure.exists()
    assert said.err == ""
    assert said.out.count("note:") == 1
    assert "T is less by what there is of it" in said.out
    assert "more if" not in said.out


def test_the_mean_is_of_ramps(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    volt, x = ramp()
    time = np.arange(1000) / RATE
    loop = np.append(np.zeros(200), 50.0 * (1.0 - np.cos(4.0 * np.pi * time)))
    noise = 2e-9 * np.random.default_rng(5).standard_normal(loop.size)
    sine = saved(tmp_path, "sine", loop, STACK.run(np.append(volt, loop))[0][volt.size :] + noise)
    assert main(["stack", "mechanical", saved(tmp_path, "ramp", volt, x), sine]) == 0
    said = capsys.readouterr().out
    assert "N/V, of ramp\n" in said
    assert "sine: the voltage slows down" in said


def test_a_recording_that_is_too_short(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    _, x = ramp()
    # a converter with steps of 10 mV
    coarse = 0.01 * np.floor(np.linspace(0.0, 1.9, 70))
    short = saved(tmp_path, "short", np.append(np.zeros(600), coarse), x[:670] + 1e-9)
    for what in ("mechanical", "identify"):
        words = ["stack", what, short, "--out", str(tmp_path / f"{what}.json")]
        refused(words[:3] if what == "mechanical" else words, "short: ", capsys)
    assert not list(tmp_path.glob("*.json"))


def test_a_recording_given_twice_judges_nothing(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    one, again = saved(tmp_path, "one", *ramp()), saved(tmp_path, "again", *ramp())
    out = ["--out", str(tmp_path / "stack.json")]
    refused(["stack", "identify", one, one, *out], "is given twice", capsys)
    refused(["stack", "identify", one, again, *out], "those of one", capsys)
    refused(["stack", "mechanical", one, again], "is given twice", capsys)
    refused(["stack", "identify", one, "--validate", again, *out], "that no fit sees", capsys)
    assert not (tmp_path / "stack.json").exists()


@pytest.mark.parametrize(
    ("volts", "metres", "said"),
    [
        (1.0, -1.0, "the displacement falls where the voltage rises"),
        (1.0, 1e3, "x looks in mm, not m"),
        (1.0, 1e6, "x looks in um, not m"),
        (1e3, 1.0, "looks in mV, not V"),
        (1.0, 1e-3, "less than one layer"),
    ],
)
def test_what_no_stack_does(
    volts: float, metres: float, said: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    volt, x = ramp()
    file = saved(tmp_path, "odd", volts * volt, metres * x)
    refused(["stack", "mechanical", file], said, capsys)
    out = tmp_path / "stack.json"
    refused(["stack", "identify", file, "--out", str(out)], said, capsys)
    assert not out.exists()


def test_noise_alone_and_exchanged_columns(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    volt, _ = ramp()
    noise = 1e-9 * np.random.default_rng(1).standard_normal(volt.size)
    nothing = saved(tmp_path, "noise", volt, noise)
    refused(["stack", "mechanical", nothing], "x does not follow the voltage", capsys)
    # without noise at rest, which would be the voltage now
    swapped = saved(tmp_path, "swapped", STACK.run(volt)[0], volt)
    refused(["stack", "mechanical", swapped], "look exchanged", capsys)


def test_options_that_would_be_ignored(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    file = saved(tmp_path, "ramp", *ramp())
    for words, said in (
        ([file, "--out", str(tmp_path / "x.json")], "a figure ends in .svg"),
        ([file, "--capacitance", "-1"], "takes no --capacitance"),
        ([file, "--validate", file], "takes no --validate"),
        ([file, "--plays", "4"], "takes no --plays"),
        ([file, "--mass", "0.1"], "--mass: give --step"),
        ([file, "--stiffness", "6e7", "--load", file], "--stiffness: k is told by --load"),
        ([file, "--stiffness-error", "6e5", "--load", file], "--stiffness-error: k is told by"),
        ([file, "--stiffness-error", "nan"], "give 0 or more"),
        (["--stiffness", "6e7"], "takes no --stiffness"),
    ):
        refused(["stack", "mechanical", *words], said, capsys)
    refused(["stack", "identify", file, "--capacitance", "-1"], "above 0", capsys)
    assert [f.suffix for f in tmp_path.iterdir()] == [".npz"]


def test_a_target_that_does_not_move_leaves_no_file(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    stack, out = stack_file(tmp_path), tmp_path / "volt.npz"
    words = ["compensate", stack, "--out", str(out), "--controller", str(tmp_path / "c.toml")]
    refused([*words, "--target", "sine:0:0:1e-6:1"], "does not move", capsys)
    refused([*words, "--target", "thesis", "--closed", "0"], "--closed 0: give ticks", capsys)
    refused([*words, "--target", "sine:1:0:1e-3:1"], "this stack goes", capsys)
    assert [f.name for f in tmp_path.iterdir()] == ["stack.json"]
    assert main([*words, "--target", "thesis"]) == 0
    assert out.exists()
    assert (tmp_path / "c.toml").exists()


@pytest.mark.parametrize(
    ("head", "spoil", "said"),
    [
        ("t[s],x[m]", "nan", "remove or fill them"),
        ("t[s],x", "", "such as 'x[m]'"),
        ("t[s],x[m]", "uneven", "even time stamps"),
        ("t[s],x[V]", "", "no channel is in m (x in V)"),
        ("t[s],x[m],y[m]", "", "2 channels in m (x, y); leave one"),
    ],
)
def test_remedies_of_a_target_are_those_of_the_verb(
    head: str, spoil: str, said: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    t = np.arange(500) / RATE
    x = 1e-6 * (1.0 - np.cos(2.0 * np.pi * 2.0 * t))
    if spoil == "nan":
        x[100] = np.nan
    t = t**1.1 if spoil == "uneven" else t
    columns = (t, x, x)[: head.count(",") + 1]
    np.savetxt(
        tmp_path / "t.csv", np.column_stack(columns), delimiter=",", header=head, comments=""
    )
    stack = stack_file(tmp_path)
    capsys.readouterr()
    words = ["compensate", stack, "--target", str(tmp_path / "t.csv")]
    assert main([*words, "--out", str(tmp_path / "volt.npz")]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert not any(o in error for o in ("--map", "--rows", "--fs", "--resample"))
    assert len(error.strip().splitlines()) == 1
    assert not (tmp_path / "volt.npz").exists()
