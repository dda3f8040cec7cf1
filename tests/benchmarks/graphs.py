"""What equations cost as a graph grows, beside another tool and beside SciPy, with the limits."""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
import time
from typing import Any

from tests.benchmarks.chain import FAMILIES
from tests.benchmarks.chain_simulation import FORCES, compare
from tests.benchmarks.peer import peer_time

PEER = "BONDSIGHT_PEER"
"""Environment variable: a Python with BondGraphTools."""

SIZES = (5, 10, 20, 50, 100, 200, 1000, 10_000)
GROWTH = (200, 1000, 4000)
PEER_SIZES = (5, 10, 20)
PEER_LIMIT = 300.0


def graphs() -> None:
    """Chains of 5 to 10,000 segments, loops and rigid masses, stack models, import, simulation."""
    found = {n: _measured(n, "plain") for n in SIZES}
    print("segments   build  equations  numeric  function   closed  total numeric  total fn  MiB")
    for n, r in found.items():
        closed = f"{r['closed']:8.3f}" if "closed" in r else "       -"
        print(
            f"{n:8d} {r['build']:7.3f} {r['equations']:10.3f} {r['numeric']:8.4f} "
            f"{r['function']:9.3f} {closed} {r['numeric_total']:14.4f} {r['function_total']:9.2f} "
            f"{r['peak']:4.0f}"
        )
    large = found[SIZES[-1]]
    slope = _slope({n: found[n]["function_total"] for n in (200, 1000, 10_000)})
    print(f"growth of the total from 200 to 10,000 segments: exponent {slope:.2f}")
    print(limit_line("N = 10,000: equations and CasADi function, s", large["function_total"], 10.0))
    print(limit_line("N = 10,000: peak memory, MiB", large["peak"], 2048.0))
    print(limit_line("N = 50: closed forms from the graph on, s", _closed(found[50]), 0.5))
    print(limit_line("N = 200: closed forms from the graph on, s", _closed(found[200]), 5.0))
    print(limit_line("N = 200: with numbers, s", found[200]["numeric_total"], 0.1))
    _peer(found)
    for family in FAMILIES:
        if family != "plain":
            seconds = {n: _measured(n, family)["equations"] for n in GROWTH}
            text = ", ".join(f"{n}: {s:.2f} s" for n, s in seconds.items())
            print(f"{family} chain, equations at {text}; exponent {_slope(seconds):.2f}")
    _stack_models()
    print(limit_line("import bondgraph, best of 3, s", min(_import() for _ in range(3)), 0.5))
    for force in FORCES:
        c = compare(force=force)
        print(
            f"chain of {c.states} states, {c.samples} samples, {force}: simulate {c.ours:.4f} s "
            f"(first call {c.first:.2f} s, error {c.error:.1e}); solve_ivp {c.solver or 'none'} "
            f"{c.theirs:.3f} s"
        )
        print(limit_line(f"times faster than solve_ivp, {force}", c.ratio, 20.0, least=True))


def limit_line(what: str, value: float, limit: float, *, least: bool = False) -> str:
    """Return a line with value, limit and whether it holds.

    Examples
    --------
    >>> limit_line("import, s", 0.4, 0.5)
    'import, s: 0.4 (limit 0.5): holds'
    """
    holds = value >= limit if least else value <= limit
    word = "at least" if least else "limit"
    return f"{what}: {value:.4g} ({word} {limit:g}): {'holds' if holds else 'MISSED'}"


def _closed(r: dict[str, Any]) -> float:
    return float(r["build"] + r["equations"] + r["closed"])


def _measured(segments: int, family: str) -> dict[str, Any]:
    """Measure one chain in a process of its own, so that the peak of memory is its own."""
    run = subprocess.run(
        [sys.executable, "-m", "tests.benchmarks.chain", family, str(segments)],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    found: dict[str, Any] = json.loads(run.stdout)
    return found


def _slope(seconds: dict[int, float]) -> float:
    """Return the exponent between the smallest and the largest size."""
    small, large = min(seconds), max(seconds)
    return math.log(seconds[large] / seconds[small]) / math.log(large / small)


def _peer(found: dict[int, dict[str, Any]]) -> None:
    python = os.environ.get(PEER)
    if not python:
        print(f"BondGraphTools is not measured: {PEER} names no Python that has it")
        return
    for n in PEER_SIZES:
        peer = peer_time(python, n, PEER_LIMIT)
        if peer.seconds is None:
            print(f"BondGraphTools, N = {n}: more than {PEER_LIMIT:g} s")
            continue
        ratio = peer.seconds / found[n]["numeric_total"]
        print(
            f"BondGraphTools, N = {n}: {peer.seconds:.2f} s, {ratio:.0f} times ours; largest "
            f"difference of a coefficient {peer.difference:.1e}"
        )
        if n == 20:
            print(limit_line("N = 20: times faster than BondGraphTools", ratio, 1000.0, least=True))


def _stack_models() -> None:
    """Print the closed forms of every stack model, after one call that loads what SymPy needs."""
    from actuators.models.catalogue import MODELS
    from bondgraph.equations.derivation import equations

    equations(MODELS["resonator"]()).rates
    for name, model in MODELS.items():
        if name.startswith("stack"):
            graph = model()
            begin = time.perf_counter()
            equations(graph).rates
            print(limit_line(f"{name}: closed forms, s", time.perf_counter() - begin, 0.1))


def _import() -> float:
    code = "import time; t = time.perf_counter(); import bondgraph; print(time.perf_counter() - t)"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return float(run.stdout)
