"""``bondsight acquire --simulated``: a virtual bench in a process of its own, by its wire."""

from __future__ import annotations

import argparse
import json
import secrets
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from bondgraph.support.errors import unknown_name
from bondsight.cli.output import words_of
from bondsight.cli.virtual_bench import served

if TYPE_CHECKING:
    from hardware.simulators.judging.truths import ExamTruth

ALSO = {"V": "V_in", "R_a": "R_e", "b": "R_nl"}
"""Places that are the same ports in `stack_with_payload`; its ``k`` and ``C_nl`` are others."""


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
    from hardware.simulators.plants.stack import effects

    if options.seed is None:
        options.seed = secrets.randbits(31)
    config = bench_config(
        options.bench, effect=options.effect, place=options.place or None,
        strength=options.strength or None, seed=options.seed,
    )  # fmt: skip
    if config.plant.effect not in ("drawn", *effects()) and config.plant.name == "stack":
        raise unknown_name("effect", config.plant.effect, "the bench", effects())
    # refused before a process is started for it
    envelope = P840_1_UNIPOLAR
    _, rate = waveform(options.signal, options.rate, options.samples, envelope, options.seed)
    if options.erase is not None:
        erasure(options.erase, rate, envelope)
    with served(config) as bench:
        words_of(options)(f"truth sealed: sha256 {bench.digest}")
        result = record_and_diagnose(options, bench.settings)
    _conclude(bench.said, bench.digest, result, options.json)
    return 0


def _conclude(said: str, digest: str, result: Any, quiet: bool) -> None:
    """Print what the actuator met, and the truth beside the verdict."""
    from bondsight.cli.judged import describe, judge
    from hardware.simulators.judging.truths import truth_of

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
    if "moved" not in content:
        print(f"seal opened:    {truth}")
        return
    opened = truth_of(content)
    print(f"seal opened:    {describe(opened)} (seed {opened.id.removeprefix('bench-')})")
    if result is not None:
        print(f"the verdict is: {judge(_in_words_of(result.graph, opened), result).result}")


def _in_words_of(graph: Any, truth: ExamTruth) -> ExamTruth:
    """Let a place also be called what it is called in a model that calls it otherwise."""
    effects = (
        replace(e, places=e.places | {ALSO[p] for p in e.places if ALSO.get(p) in graph.elements})
        for e in truth.effects
    )
    return replace(truth, effects=tuple(effects))
