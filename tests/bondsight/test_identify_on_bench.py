"""From a bench whose stack differs from every model to the compensated loop, by commands."""

from __future__ import annotations

import json
import re
import shutil
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from actuators.stack.identified import IdentifiedStack
from actuators.stack.ramps import stiffness_from_load
from bondgraph.hysteresis import operator_from_dict
from bondgraph.signals.recording import Recording
from bondsight.cli.bench_serve import station_writer
from bondsight.cli.main import main
from hardware.simulators.bench_server import BenchServer
from hardware.simulators.bench_server.config import config_from
from hardware.simulators.plants import conceal

pytestmark = pytest.mark.skipif(shutil.which("gcc") is None, reason="the stub library is C code")

_FILE = tomllib.loads((Path(__file__).parent / "different_stack.toml").read_text(encoding="utf-8"))
SEED = int(_FILE["plant"]["seed"])
# short records: creep of seconds would not be seen in them
BENCH = _FILE | {
    "plant": _FILE["plant"] | {"creep_ratios": [0.02, 0.02], "creep_times": [0.04, 0.4]}
}


@dataclass(frozen=True)
class Session:
    folder: Path
    server: BenchServer
    said: str

    @property
    def station(self) -> str:
        return str(self.folder / "station.toml")

    @property
    def fit(self) -> str:
        return str(self.folder / "stack.json")


def short_circuit() -> tuple[float, float]:
    """Return k and T (N/V) of the bench's stack as the lumped model means them."""
    p = conceal(SEED, "none").case.parameters
    return p["k"], p["alpha"]


@pytest.fixture(scope="module", autouse=True)
def patient() -> Iterator[None]:
    """Let the wire of the interferometer wait: a busy machine may be slow."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("BONDSIGHT_BENCH_SIOS_TIMEOUT", "60")
        yield


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Session]:
    folder = tmp_path_factory.mktemp("bench")
    config = config_from(BENCH)
    takes = {"loading": ("triangle:0.25", "4000"), "loops": ("sine:2", "1500"),
             "held": ("sine:1:0:80", "1500")}  # fmt: skip
    with BenchServer(config) as server:
        station_writer(folder / "station.toml", config)(server.addresses)
        for name, (signal, samples) in takes.items():
            assert not main(
                ["acquire", str(folder / "station.toml"), "--signal", signal, "--rate", "1000",
                 "--samples", samples, "--rest", "0.1", "--name", name, "--out", str(folder),
                 "--quiet"]
            )  # fmt: skip
        k, _ = short_circuit()
        with pytest.MonkeyPatch.context() as patch:
            lines: list[str] = []
            patch.setattr("builtins.print", lambda *a, **_: lines.append(" ".join(map(str, a))))
            files = [str(folder / f"{name}.npz") for name in takes]
            out = str(folder / "stack.json")
            assert not main(["stack", "identify", *files, "--stiffness", str(k), "--out", out,
                             "--plays", "14"])  # fmt: skip
        yield Session(folder, server, "\n".join(lines))


def test_what_is_found_is_what_stands_there(session: Session) -> None:
    stack = IdentifiedStack.open(Path(session.fit))
    assert stack.transducer.value == pytest.approx(short_circuit()[1], rel=0.02)
    assert stack.rms < 2.0 * 2e-9
    assert stack.held_out < 0.002 * stack.stroke()
    assert stack.creep is not None
    assert sum(stack.creep.weights) == pytest.approx(0.04, rel=0.35)
    assert "chosen: ang" in session.said
    assert "thesis 3.52" in session.said


@pytest.mark.long
def test_the_complete_model_on_a_record_that_no_fit_has_seen(
    session: Session, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    loading, loops, held = (str(session.folder / f"{n}.npz") for n in ("loading", "loops", "held"))
    k, _ = short_circuit()
    assert not main(
        ["stack", "identify", loading, loops, "--validate", held, "--stiffness", str(k),
         "--plays", "14", "--out", str(tmp_path / "stack.json")]
    )  # fmt: skip
    said = capsys.readouterr().out
    rows = re.findall(
        r"^  (operator and creep|complete model: .+?) +[\d.]+ nm +([\d.]+) %", said, re.M
    )
    share = {name: float(percent) for name, percent in rows}
    assert share["complete model: lumped + operator"] < 1.0
    assert share["operator and creep"] < 1.0
    assert share["complete model: lumped + Maxwell"] < 2.0
    # the takes follow each other within tenths of a second
    assert "crept by" in said


def test_a_gauge_in_a_take_tells_the_stiffness(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    pressed = BENCH["plant"] | {"press": [4.0, 2.0]}
    config = config_from(BENCH | {"plant": pressed, "fronts": ["interferometer", "card", "gauge"]})
    with BenchServer(config) as server:
        station_writer(tmp_path / "station.toml", config)(server.addresses)
        station = str(tmp_path / "station.toml")
        assert not main(
            ["acquire", station, "--signal", "hold:2:0", "--rate", "500", "--name", "pressed",
             "--out", str(tmp_path), "--quiet"]
        )  # fmt: skip
    assert "gauge: " in capsys.readouterr().out
    recording = Recording.open(tmp_path / "pressed.npz")
    assert recording.units["F"] == "N"
    assert np.ptp(np.asarray(recording["F"])) == pytest.approx(4.0, abs=0.1)
    found = stiffness_from_load(recording)
    assert found.value == pytest.approx(short_circuit()[0], rel=0.01)
    assert abs(found.value - short_circuit()[0]) < 4.0 * found.error


@pytest.mark.long
def test_the_loop_before_and_after(
    session: Session, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    time = np.arange(900) / 1000.0
    target = 1.6e-6 * (1.0 - np.cos(2 * np.pi * time)) * np.interp(time, [0.5, 0.6], [1.0, 0.7])
    Recording("target", time, {"x": target}, {"x": "m"}).save(tmp_path / "target.npz")
    out = str(tmp_path / "voltage.csv")
    assert not main(
        ["compensate", session.fit, "--target", str(tmp_path / "target.npz"),
         "--station", session.station, "--out", out,
         "--controller", str(tmp_path / "pi.toml"), "--rate", "1000", "--closed", "500"]
    )  # fmt: skip
    rows = {
        name: [float(v) for v in numbers.split()]
        for name, numbers in re.findall(
            r"^(bench, [A-Za-z+ ]+?)  +([\d. ]+)$", capsys.readouterr().out, re.M
        )
    }
    before, after = rows["bench, plain gain"], rows["bench, inverse"]
    assert before[1] > 3.0  # per cent of the range
    assert after[1] < 0.5
    assert after[4] < 0.15 * before[4]
    assert rows["bench, PI + inverse"][1] < 0.2
    assert (tmp_path / "bench-inverse.npz").exists()
    controller = tomllib.loads((tmp_path / "pi.toml").read_text(encoding="utf-8"))
    stack = IdentifiedStack.open(Path(session.fit))
    assert operator_from_dict(controller["operator"]) == stack.operator
    assert controller["integral"] < 0.5 * controller["rate"]
    written = Recording.read(out)
    assert np.asarray(written["V"]).min() >= 0.0


@pytest.mark.parametrize(
    ("target", "said"),
    [(9e-6, "this stack goes from 0 to"), (0.0, "rest, begin|move|constant")],
    ids=["too far", "nowhere"],
)
def test_a_target_that_cannot_be_followed_moves_nothing(
    session: Session, capsys: pytest.CaptureFixture[str], tmp_path: Path, target: float, said: str
) -> None:
    time = np.arange(400) / 1000.0
    x = 0.5 * target * (1.0 - np.cos(5 * np.pi * time))
    Recording("target", time, {"x": x}, {"x": "m"}).save(tmp_path / "target.npz")
    steps = len(session.server.rig.trigger_edges)
    words = ["--target", str(tmp_path / "target.npz"), "--station", session.station]
    code = main(["compensate", session.fit, *words, "--out", str(tmp_path / "v.npz")])
    error = capsys.readouterr().err
    assert code == 2
    assert len(error.strip().splitlines()) == 1
    assert re.search(said, error)
    assert len(session.server.rig.trigger_edges) == steps


def test_what_cannot_be_done_moves_nothing(
    session: Session, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    volt = np.linspace(0.0, 100.0, 500)
    bare = Recording("bare", volt / 100.0, {"V": volt, "x": 5e-8 * volt}, {"V": "V", "x": "m"})
    no_rest = str(bare.save(tmp_path / "bare.npz"))
    content = json.loads(Path(session.fit).read_text(encoding="utf-8"))
    dead = {"kind": "al_janaideh", "q": 1e-8, "c": 1.0, "sigma": 5.0, "alpha": -9e-9, "beta": 0.0,
            "count": 3}  # fmt: skip
    no_inverse = tmp_path / "dead.json"
    no_inverse.write_text(json.dumps({**content, "operator": dead}), encoding="utf-8")
    fast = tmp_path / "fast.toml"
    text = Path(session.station).read_text(encoding="utf-8")
    fast.write_text(text.replace("[interferometer]", "[interferometer]\nrate = 1.2e6"))
    target = ["--target", "sine:1:0:2e-6:0.5", "--out", str(tmp_path / "v.npz")]
    at = ["--station", session.station]
    rig = session.server.rig
    edges, now = len(rig.trigger_edges), session.server.extremes
    for words, said in (
        (["stack", "identify", no_rest], "rest before the voltage moves"),
        (["stack", "identify", session.fit], "stack.json"),
        (["compensate", no_rest, *target, *at], "rest before the voltage moves"),
        (["compensate", str(no_inverse), *target, *at], "no inverse"),
        (["compensate", session.fit, *target, *at, "--rate", "100000"], "neither a block"),
        (["compensate", session.fit, *target, *at, "--closed", "20000"], "allows 5 kHz"),
        (["compensate", session.fit, *target, *at, "--closed", "-1"], "above 0"),
        (["compensate", session.fit, *target, "--station", str(fast), "--closed", "500"], "16000"),
        (["compensate", session.fit, *target, "--closed", "500"], "--station"),
    ):
        assert main(words) == 2, words
        error = capsys.readouterr().err
        assert said in error, (words, error)
        assert len(error.strip().splitlines()) == 1, error
    assert len(rig.trigger_edges) == edges
    assert session.server.extremes == now
    assert not list(tmp_path.glob("bench-*"))
    assert not (tmp_path / "v.npz").exists()


def test_words_that_make_no_sense(
    session: Session, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    held, fit = str(session.folder / "held.npz"), session.fit
    out = str(tmp_path / "v.npz")
    for words, said in (
        (["compensate", fit], "--target"),
        (["compensate", "--target", "thesis"], "identified stack first"),
        (["compensate", fit, held, "--target", "thesis"], "leave the others out"),
        (["compensate", fit, "--target", "thesis:500"], "sine:HZ"),
        (["compensate", fit, "--target", "thesis", "--out", "v.txt"], ".npz or .csv"),
        (["compensate", str(session.folder / "station.toml"), "--target", "thesis"], "station"),
        (["stack", "identify"], "give a recording"),
        (["stack", "identify", held, "--out", "x.svg"], ".json"),
        (["stack", "charge", held], "takes no file"),
        (["stack", "mechanical", held, "--stiffness", "-1"], "above 0"),
        (["stack", "mechanical", held, "--map", "y=x"], "F_e"),
        (["stack", "mechanical", held, "--weight", "0.5"], "give --load"),
        (["stack", "mechanical", held, "--load", held], "channels in N"),
        (["stack", "mechanical", held, "--load", held, "--weight", "0"], "above 0"),
        (["stack", "identify", held, "--validate", str(session.folder / "no.npz")], "no.npz"),
        (["stack", "mechanical", held, "--step", held, "--mass", "0.1"], "no step"),
    ):
        extra = ["--out", out] if words[0] == "compensate" and "--out" not in words else []
        assert main([*words, *extra]) == 2, words
        error = capsys.readouterr().err
        assert said in error, (words, error)
        assert len(error.strip().splitlines()) == 1
    assert not main(["stack", "mechanical", held, str(session.folder / "loading.npz")])
    assert "mean: T =" in capsys.readouterr().out
