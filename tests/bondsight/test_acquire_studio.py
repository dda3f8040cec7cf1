"""``bondsight acquire --studio``: the model runs along while a take is recorded."""

from __future__ import annotations

import argparse
import json
import threading
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from urllib.error import HTTPError
from urllib.request import Request, urlopen

import numpy as np
import pytest

from actuators.models import opening
from bondgraph import BondGraph, C, Dq, I, One, R, Se
from bondgraph.signals.recording import Recording
from bondgraph.simulation.simulate import simulate
from bondgraph.support.errors import UnusableInput
from bondsight.cli import acquire, diagnose
from bondsight.cli.acquire_studio import POINTS, RunningAlong, recorded_on_and_on
from bondsight.cli.main import main
from bondsight.cli.output import Stopped
from bondsight.cli.studio import stoppable
from hardware.contracts import Chunk
from hardware.recorder import TakePlan
from identification.diagnosis import studio, verdict
from identification.diagnosis.explanation import recovered
from identification.diagnosis.studio.live import LiveStudio
from tests.patience import HANGS

RATE, N = 1000.0, 60_000
V = 2.0 + np.sin(2 * np.pi * 3.0 * np.arange(N) / RATE)


def actuator() -> BondGraph:
    with BondGraph("actuator") as g:
        body = One("body")
        Se("V_in", unit="N") >> body >> I("m", 0.5, unit="kg")
        body >> R("d", 4.0, unit="N*s/m")
        body >> C("k", stiffness=2e3, unit="N/m")
        body >> Dq("x", unit="m")
    return g


def chunk(first: int, micrometres: np.ndarray) -> Chunk:
    flags = np.zeros(micrometres.size, np.uint16)
    return Chunk("gauge", first, {"x": micrometres, "y": micrometres}, {"x": "um", "y": "V"}, flags)


def test_what_arrives_is_held_against_the_model() -> None:
    """A sensor with another zero and 1 mm too much from a sample on: the strip shows just that."""
    t = np.arange(N) / RATE
    x = simulate(actuator(), t, {"V_in": V}, x0="rest")["x"]
    seen = 1e6 * (x + 7e-3 + 1e-3 * (t > 30.0))
    seen[5000] = np.nan
    with LiveStudio() as live:
        along = RunningAlong(live, TakePlan(V, RATE), actuator(), ["V_in=V"], {"gauge": 50.0})
        for first in range(0, N, 777):
            along(
                SimpleNamespace(
                    phase="play", late=0, chunks=[chunk(first, seen[first : first + 777])]
                )
            )
        live.finish("<p>made</p>")
        with urlopen(f"{live.address}events", timeout=HANGS) as stream:
            lines = stream.read().decode().split("\n\n")
    told = [json.loads(s.split("data: ")[1]) for s in lines if s.startswith("event: take")]
    assert {p["name"] for p in told} == {"x (m)"}
    at, y, model = (np.concatenate([p[k] for p in told]) for k in ("t", "y", "model"))
    assert N / 4 < at.size <= POINTS
    np.testing.assert_allclose(np.diff(at), 3 / RATE, rtol=1e-6)
    np.testing.assert_allclose(model, (x - x[0])[np.round(at * RATE).astype(int)], atol=1e-12)
    np.testing.assert_allclose(y - model, 1e-3 * (at > 30.0), atol=1e-9)


def test_it_asks_which_model(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["acquire", "--simulated", "--studio"]) == 2
    assert "add --diagnose MODEL" in capsys.readouterr().err


def experiment(words: str, kind: str = "ramp", **commands: np.ndarray) -> Any:
    return SimpleNamespace(words=words, kind=kind, commands=commands)


def diagnosed(out: Path, *experiments: Any) -> Any:
    """What the page is made of: two sources, of which one is a voltage."""
    out.mkdir(exist_ok=True)
    (out / "report.html").write_text("<body>form-action 'none'</body>")
    with BondGraph("actuator") as g:
        body = One("body")
        Se("V_in", unit="V") >> body
        Se("F", unit="N") >> body >> R("d", 4.0, unit="N*s/m")
    return SimpleNamespace(graph=g, data=SimpleNamespace(dt=1e-3), experiments=experiments)


def post(live: LiveStudio, body: str, **headers: str) -> int:
    asked = Request(f"{live.address}record", body.encode(), headers=headers)
    try:
        with urlopen(asked, timeout=HANGS) as answer:
            return int(answer.status)
    except HTTPError as error:
        return error.code


def test_the_page_asks_the_station_for_the_next_experiment(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """Its signal is written by us; of the browser only a number is taken, once, from our page."""
    volts, still = np.linspace(0.0, 5.0, 50), np.zeros(50)
    push = experiment("push", V_in=still, F=volts)
    sensor = experiment("measure f_body too", "sensor", V_in=volts, F=still)
    ramp = experiment("ramp <b>", V_in=volts, F=still)
    taken: list[argparse.Namespace] = []

    def take(options: argparse.Namespace) -> Any:
        taken.append(options)
        if len(taken) == 2:
            raise UnusableInput("12 V is above the envelope")
        return diagnosed(options.out, *(() if len(taken) > 2 else (push, sensor, ramp)))

    options = argparse.Namespace(
        signal="session", name="take", out=tmp_path, rate=9.0, rest=1.0, json=True
    )
    with LiveStudio() as live:
        loop = threading.Thread(target=lambda: recorded_on_and_on(options, live, take), daemon=True)
        loop.start()
        while "record on the station" not in live.shown():
            loop.join(0.01)
        assert "ramp &lt;b&gt;" in live.shown()  # a push is no voltage
        assert "push" not in live.shown()
        assert "measure f_body" not in live.shown()  # nobody has put it there
        asked = "moves=yes&take="
        refused = ["take=0", f"{asked}1", f"{asked}x", f"{asked}0{'0' * 40}"]  # unticked, then odd
        assert [post(live, body) for body in refused] == [404] * 4
        assert post(live, f"{asked}0", Origin="http://elsewhere") == 403
        assert len(taken) == 1
        for count in (2, 3):
            assert post(live, f"{asked}0") == 200
            while len(taken) < count or not live._page:
                loop.join(0.01)
        assert "record on the station" not in live.shown()
        assert "form-action 'none'" in live.shown()
    loop.join(HANGS)
    assert [t.name for t in taken] == ["take", "take_1", "take_2"]
    said = capfd.readouterr()
    assert said.out == ""  # it is that of the JSON
    assert "not recorded: 12 V is above the envelope" in said.err
    signal = Recording.read(Path(taken[2].signal))
    np.testing.assert_allclose(signal["V"], volts)
    assert signal.dt == pytest.approx(1e-3)
    assert (taken[2].rate, taken[2].rest, taken[2].out) == (None, 0.0, tmp_path / "next_2")


def test_a_stop_ends_one_search_and_no_more(tmp_path: Path) -> None:
    """Asked for during a take it does not count; before anything is found the last page comes."""
    ramp = experiment("ramp", V_in=np.linspace(0.0, 5.0, 50))
    options = argparse.Namespace(
        signal="session", name="take", out=tmp_path, rate=9.0, rest=1.0, json=True
    )
    stops = [False, True]
    seen: list[str] = []

    def take(asked: argparse.Namespace) -> Any:
        live.stop()
        watch = stoppable(live)
        watch("fitting", 0.3)
        seen.append(asked.name)
        if stops.pop(0):
            live.stop()
            try:
                watch("fitting", 0.3)
            except KeyboardInterrupt:
                raise Stopped("stopped before anything was found") from None
        return diagnosed(asked.out, ramp)

    with LiveStudio() as live:
        loop = threading.Thread(target=lambda: recorded_on_and_on(options, live, take), daemon=True)
        loop.start()
        while not live._page:
            assert loop.is_alive()
            loop.join(0.01)
        first = live.shown()
        assert live.choose(0)
        while len(seen) < 2 or not live._page:
            assert loop.is_alive()
            loop.join(0.01)
        assert live.shown() == first
    loop.join(HANGS)
    assert seen == ["take", "take_1"]


def test_an_interrupt_is_no_stop_of_the_page(tmp_path: Path) -> None:
    ramp = experiment("ramp", V_in=np.linspace(0.0, 5.0, 50))
    answers = [diagnosed(tmp_path, ramp)]

    def take(_: argparse.Namespace) -> Any:
        if not answers:
            raise Stopped("Ctrl-C")
        return answers.pop()

    live: Any = SimpleNamespace(address="", stopped=False, finish=lambda *_: None, wait=lambda: 0)
    with pytest.raises(Stopped, match="Ctrl-C"):
        recorded_on_and_on(argparse.Namespace(name="take", out=tmp_path, json=False), live, take)


def test_the_verdicts_of_several_takes_are_one_line_each(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    wave = Recording("take", np.arange(4.0), {"V": np.arange(4.0)}, {"V": "V"})
    file = wave.save(tmp_path / "take.npz")
    monkeypatch.setattr(opening, "load_model", lambda _: actuator())
    monkeypatch.setattr(acquire, "_record", lambda *_: file)
    monkeypatch.setattr(diagnose, "_found", lambda *_: SimpleNamespace(stopped=""))
    for place, name in (
        (verdict, "write_verdict"), (studio, "write_report"), (recovered, "characterised"),
    ):  # fmt: skip
        monkeypatch.setattr(place, name, lambda *_: tmp_path)
    monkeypatch.setattr(verdict, "verdict", lambda _: {"verdict": ["a", "b"]})
    options = argparse.Namespace(
        diagnose="model.py", maps=[], out=tmp_path, json=True, jobs=1, seed=0
    )
    with LiveStudio() as live:
        for _ in range(2):
            acquire._recorded_and_diagnosed(options, None, live)
    lines = capfd.readouterr().out.splitlines()
    assert [json.loads(line) for line in lines] == [{"verdict": ["a", "b"]}] * 2
