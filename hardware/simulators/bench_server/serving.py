"""A bench as a process of its own, for a person or a test."""

from __future__ import annotations

import json
import os
import signal
import sys
import threading
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TextIO

from hardware.simulators.bench_server.config import BenchConfig
from hardware.simulators.bench_server.plants import PlantMaker
from hardware.simulators.bench_server.server import BenchServer

_LOOK = 0.1


def describe(server: BenchServer) -> list[str]:
    """Return what a person needs to use a started bench, one line each."""
    config = server.config
    time = (
        f"passes {config.speed:g} times as fast as the wall clock"
        if config.speed
        else "is virtual: it passes when the program waits"
    )
    lines = [f"bench of a {config.plant.name!r} plant; time {time}"]
    lines += [f"  {name:<15} {address}" for name, address in server.addresses.items()]
    if config.plant.sealed:
        lines.append(f"  sealed truth    sha256 {server.envelope.hash}")
    if not config.watchdog:
        lines.append("  no watchdog     a killed program leaves its voltage on the actuator")
    lines.append("for the program:")
    lines += [f"  export {name}={value}" for name, value in server.environment.items()]
    lines.append("Ctrl-C ends the bench")
    return lines


def serve(
    config: BenchConfig | None = None,
    *,
    plants: Mapping[str, PlantMaker] | None = None,
    output: TextIO | None = None,
    ready_file: str | Path | None = None,
    envelope_file: str | Path | None = None,
    reveal: bool = False,
    reveal_request: str | Path | None = None,
    stop: threading.Event | None = None,
    parent: int | None = None,
    started: Callable[[Mapping[str, str]], list[str]] | None = None,
) -> int:
    """Run a bench until Ctrl-C, SIGTERM or `stop`; returns the exit code.

    Parameters
    ----------
    config : BenchConfig, optional
        The bench.
    plants : mapping, optional
        Makers of further plants.
    output : text stream, optional
        Where its lines go; standard output by default.
    ready_file : path, optional
        Gets addresses, environment and hash as JSON when the bench answers; removed at the end.
    envelope_file : path, optional
        Gets the opened envelope of the truth at the end.
    reveal : bool
        Print the truth at the end.
    reveal_request : path, optional
        The bench ends, and reveals, as soon as this file is there.
    stop : Event, optional
        Ends it from another thread; signals are left alone then.
    parent : int, optional
        Process that started this one: the bench ends, without a word, when it is gone, however it
        ended. Only where the system tells (POSIX).
    started : callable, optional
        Told of the addresses when the bench answers; the lines it returns are printed.

    Raises
    ------
    ValueError
        In one line, if the configuration cannot be used.
    """
    out = sys.stdout if output is None else output
    server = BenchServer(config, plants=plants)
    end = threading.Event() if stop is None else stop
    old = {} if stop is not None else _on_signals(end)
    try:
        with server:
            _say(out, describe(server))
            if started is not None:
                _say(out, started(server.addresses))
            if ready_file is not None:
                _write_ready(server, Path(ready_file))
            requested = _wait(end, reveal_request, parent)
    finally:
        for number, handler in old.items():
            signal.signal(number, handler)
        if ready_file is not None:
            Path(ready_file).unlink(missing_ok=True)
    if _orphaned(parent):
        # nobody is left to read what would come now
        return 0
    _say(out, server.report())
    if envelope_file is not None:
        server.envelope.save(envelope_file)
    if reveal or requested:
        truth = json.dumps(server.envelope.truth(), sort_keys=True)
        _say(out, [f"truth behind {server.envelope.hash}: {truth}"])
    return 0


def _on_signals(end: threading.Event) -> dict[signal.Signals, Any]:
    old: dict[signal.Signals, Any] = {}
    for number in (signal.SIGINT, signal.SIGTERM):
        old[number] = signal.signal(number, lambda *_: end.set())
    return old


def _orphaned(parent: int | None) -> bool:
    """Tell whether the process that started this one is gone."""
    return parent is not None and os.name == "posix" and os.getppid() != parent


def _wait(end: threading.Event, request: str | Path | None, parent: int | None) -> bool:
    """Wait for the end; returns whether the truth was asked for."""
    while not end.wait(_LOOK) and not _orphaned(parent):
        if request is not None and Path(request).exists():
            return True
    return False


def _write_ready(server: BenchServer, file: Path) -> None:
    content = {
        "addresses": server.addresses,
        "environment": server.environment,
        "hash": server.envelope.hash,
        "pid": os.getpid(),
    }
    scratch = file.with_name(f".{file.name}.{os.getpid()}")
    scratch.write_text(json.dumps(content) + "\n", encoding="utf-8")
    scratch.replace(file)


def _say(out: TextIO, lines: list[str]) -> None:
    for line in lines:
        print(line, file=out, flush=True)
