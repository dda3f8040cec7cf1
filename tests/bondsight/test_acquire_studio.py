"""``bondsight acquire --studio``: the model runs along while a take is recorded."""

from __future__ import annotations

import json
from types import SimpleNamespace
from urllib.request import urlopen

import numpy as np
import pytest

from bondgraph import BondGraph, C, Dq, I, One, R, Se
from bondgraph.simulation.simulate import simulate
from bondsight.cli.acquire_studio import POINTS, RunningAlong
from bondsight.cli.main import main
from hardware.contracts import Chunk
from hardware.recorder import TakePlan
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
