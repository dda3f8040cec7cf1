"""``bondsight bench``: serve a virtual bench; in a checkout also measure times and memory."""

from __future__ import annotations

import argparse
from typing import Any

from bondsight.cli.bench_serve import add_bench_serve_options, bench_serve
from bondsight.cli.checkout import evidence


def add_bench_command(verbs: Any) -> None:
    """Add ``bench`` to the sub-parsers of ``bondsight``."""
    p = verbs.add_parser("bench", help="measure times and memory, or serve a virtual bench")
    p.add_argument("what", nargs="*", help="names of measurements (default: all), or serve")
    p.add_argument("--quick", action="store_true", help="shorten those that can be (diagnosis)")
    p.set_defaults(run=_bench)
    add_bench_serve_options(p)


def _bench(options: argparse.Namespace) -> int:
    if options.what[:1] == ["serve"]:
        return bench_serve(options)
    return int(evidence("tests.benchmarks.command", "bench").bench(options.what, options.quick))
