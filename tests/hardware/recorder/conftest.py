"""A whole virtual bench in the threads of the test, and its station."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hardware.simulators.bench_server import BenchServer
from hardware.simulators.bench_server.config import config_from
from hardware.simulators.siosifm import build
from hardware.station import OpenStation, open_station, settings_from

Bench = tuple[BenchServer, OpenStation]


@pytest.fixture(scope="session")
def library(tmp_path_factory: pytest.TempPathFactory) -> str:
    if shutil.which("gcc") is None:
        pytest.skip("no gcc: the stub of the interferometer's library is C code")
    return str(build(tmp_path_factory.mktemp("stub")))


@pytest.fixture
def bench(library: str) -> Iterator[Callable[..., Bench]]:
    """Return what makes a bench; all are closed at the end."""
    opened: list[Any] = []

    def make(**config: Any) -> Bench:
        config.setdefault("plant", {"effect": "none", "seed": 5})
        server = BenchServer(config_from(config))
        addresses = server.start()
        opened.append(server.stop)
        host, _, port = addresses["interferometer"].rpartition(":")
        station = open_station(
            settings_from(
                {
                    "envelope": {"preset": "P-840.1-unipolar", "gentle": 5000.0},
                    "clock": {"bench": addresses["control"]},
                    "output": {
                        "kind": "mf634",
                        "address": addresses["card"],
                        "trigger": 0,
                        "clock": 0,
                    },
                    "amplifier": {
                        "gain": 20.0,
                        "voltage_monitor": 0.05,
                    },
                    "interferometer": {
                        "connection": f"net:{host}:{port}",
                        "library": library,
                        "dead_path": 0.1,
                        "clocked": server.config.clocked,
                    },
                }
            )
        )
        opened.append(station.close)
        return server, station

    yield make
    for close in reversed(opened):
        close()


@pytest.fixture
def swing() -> np.ndarray[Any, np.dtype[np.float64]]:
    """Return a gentle wave of 400 samples of 10 kHz with rest, steps of all sizes and an end."""
    rng = np.random.default_rng(3)
    t = np.arange(400) / 400.0
    return np.asarray(
        30.0 + 20.0 * np.sin(2 * np.pi * 2 * t) ** 3 + 2.0 * rng.uniform(-1.0, 1.0, t.size)
    )


@pytest.fixture
def target(tmp_path: Path) -> Path:
    return tmp_path / "take"
