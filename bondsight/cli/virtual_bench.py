"""A virtual bench in a process of its own, and its station, for verbs that run on one."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from bondgraph.support.errors import UnusableInput
from hardware.errors import LinkLost

PATIENCE = 60.0
"""For the start of the bench (s of the computer)."""


@dataclass(slots=True)
class ServedBench:
    """A running bench.

    Attributes
    ----------
    settings : StationSettings
        Its station.
    digest : str
        SHA-256 of its sealed truth.
    said : str
        Its last words, once it has ended.
    """

    settings: Any
    digest: str
    said: str = field(default="")


@contextmanager
def served(config: Any) -> Iterator[ServedBench]:
    """Start ``bondsight bench serve`` and end it with the block, its seal opened.

    Parameters
    ----------
    config : BenchConfig

    Raises
    ------
    UnusableInput
        The bench refuses its configuration.
    LinkLost
        It does not answer.
    """
    from hardware.station import settings_from
    from hardware.station.virtual import station_table, stub_library

    library = stub_library() if "interferometer" in config.fronts else ""
    with tempfile.TemporaryDirectory(prefix="bondsight-bench-") as scratch:
        folder = Path(scratch)
        (folder / "bench.json").write_text(json.dumps(asdict(config)), encoding="utf-8")
        with _started(folder) as server:
            try:
                ready = _await(server, folder / "ready.json")
                table = station_table(ready["addresses"], config, library)
                bench = ServedBench(settings_from(table, "virtual bench"), str(ready["hash"]))
                yield bench
                (folder / "end").touch()
                bench.said, _ = server.communicate(timeout=PATIENCE)
            finally:
                if server.poll() is None:
                    server.terminate()
                    server.wait(PATIENCE)


def _started(folder: Path) -> subprocess.Popen[str]:
    words = ["bench", "serve", "--config", str(folder / "bench.json"),
             "--ready", str(folder / "ready.json"), "--end", str(folder / "end"),
             "--parent", str(os.getpid())]  # fmt: skip
    # a Ctrl-C is for the program, which ramps down; the bench has to outlive it
    return subprocess.Popen(
        [sys.executable, "-m", "bondsight", *words],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(p for p in sys.path if p)},
    )  # fmt: skip


def _await(server: subprocess.Popen[str], ready: Path) -> dict[str, Any]:
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        if ready.exists():
            content: dict[str, Any] = json.loads(ready.read_text(encoding="utf-8"))
            return content
        if server.poll() is not None:
            _, error = server.communicate()
            last = (error.strip().splitlines() or ["it said nothing"])[-1]
            raise UnusableInput(last.removeprefix("bondsight: "))
        time.sleep(0.02)
    raise LinkLost(f"the virtual bench did not answer within {PATIENCE:g} s; see bench serve")
