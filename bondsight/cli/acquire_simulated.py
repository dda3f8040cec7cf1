"""``bondsight acquire --simulated``: a virtual bench in a process of its own, by its wire."""

from __future__ import annotations

import argparse
import json
import os
import secrets
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from bondgraph.support.errors import UnusableInput, unknown_name
from hardware.errors import LinkLost

PATIENCE = 60.0
"""For the start of the bench (s of the computer)."""


def simulated(
    options: argparse.Namespace, record_and_diagnose: Callable[[argparse.Namespace, Any], Any]
) -> int:
    """Start a bench, record and diagnose on it, then open its seal.

    Raises
    ------
    UnusableInput
        The bench refuses its configuration.
    LinkLost
        It does not answer.
    """
    from bondsight.cli.acquire_signal import erasure, waveform
    from bondsight.cli.bench_serve import bench_config
    from hardware.envelope import P840_1_UNIPOLAR
    from hardware.simulators import effects
    from hardware.station.virtual import stub_library

    if options.seed is None:
        options.seed = secrets.randbits(31)
    config = bench_config(
        options.bench, options.effect, options.place, options.strength, options.seed
    )
    if config.plant.effect not in ("none", "drawn", *effects()) and config.plant.name == "stack":
        raise UnusableInput(
            str(unknown_name("effect", config.plant.effect, "the bench", effects()))
        )
    # refused before a process is started for it
    envelope = P840_1_UNIPOLAR
    _, rate = waveform(options.signal, options.rate, options.samples, envelope, options.seed)
    if options.erase is not None:
        erasure(options.erase, rate, envelope)
    library = stub_library()
    with tempfile.TemporaryDirectory(prefix="bondsight-bench-") as scratch:
        folder = Path(scratch)
        with _start(options, folder) as server:
            said, digest, result = _session(
                options, server, folder, config, library, record_and_diagnose
            )
    _conclude(said, digest, result, options.json)
    return 0


def _session(
    options: argparse.Namespace,
    server: subprocess.Popen[str],
    folder: Path,
    config: Any,
    library: str,
    record_and_diagnose: Callable[[argparse.Namespace, Any], Any],
) -> tuple[str, str, Any]:
    """Record and diagnose while the bench lives; return its last words, hash, the diagnosis."""
    from hardware.station import settings_from
    from hardware.station.virtual import station_table

    try:
        ready = _await(server, folder / "ready.json")
        print(f"truth sealed: sha256 {ready['hash']}")
        table = station_table(ready["addresses"], config, library, config.card.ppm)
        result = record_and_diagnose(options, settings_from(table, "virtual bench"))
        (folder / "end").touch()
        said, _ = server.communicate(timeout=PATIENCE)
    finally:
        if server.poll() is None:
            server.terminate()
            server.wait(PATIENCE)
    return said, str(ready["hash"]), result


def _start(options: argparse.Namespace, folder: Path) -> subprocess.Popen[str]:
    arguments = ["bench", "serve", "--ready", str(folder / "ready.json"),
                 "--end", str(folder / "end"), "--seed", str(options.seed),
                 "--parent", str(os.getpid())]  # fmt: skip
    for name in ("effect", "place", "strength"):
        if getattr(options, name):
            arguments += [f"--{name}", getattr(options, name)]
    if options.bench is not None:
        arguments += ["--config", str(options.bench)]
    # a Ctrl-C is for the program, which ramps down; the bench has to outlive it
    return subprocess.Popen(
        [sys.executable, "-m", "bondsight", *arguments],
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


def _conclude(said: str, digest: str, result: Any, quiet: bool) -> None:
    """Print what the actuator met, and the truth beside the verdict."""
    from bondsight.cli.demonstration import describe, judge
    from hardware.simulators import Truth

    lines = said.splitlines()
    sealed = f"truth behind {digest}: "
    truth = next((line.removeprefix(sealed) for line in lines if line.startswith(sealed)), "")
    if quiet:
        return
    for line in lines:
        if "voltage at the actuator" in line:
            print(f"actuator:   {line}")
    if not truth:
        print("seal:       the bench said nothing of its truth")
        return
    content = json.loads(truth)
    if "effect" not in content:
        print(f"seal opened:    {truth}")
        return
    opened = Truth.from_dict(content)
    print(f"seal opened:    {describe(opened)} (seed {opened.seed})")
    if result is not None:
        print(f"the verdict is: {judge(opened, result).result}")
