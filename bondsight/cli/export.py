"""``bondsight export``: a model as a file that another tool reads."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

from bondgraph.export.formats import FORMATS, export, target_of
from bondgraph.support import native
from bondgraph.support.errors import UnusableInput
from bondsight.cli.arguments import MODEL


def add_export_command(verbs: Any) -> None:
    """Add ``export`` to the sub-parsers of ``bondsight``."""
    p = verbs.add_parser("export", help="write a model for another tool")
    p.add_argument("model", nargs="?", help=MODEL)
    p.add_argument("--format", choices=tuple(FORMATS), default=None,
                   help="for which tool; --list says what each is")  # fmt: skip
    p.add_argument("--out", type=Path, default=None, metavar="PATH", help="file (C: folder)")
    p.add_argument("--list", action="store_true", help="list the formats")
    p.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> int:
    if options.list:
        for name, f in FORMATS.items():
            print(f"{name:10s} {f.default.format('MODEL'):22s} {f.about}")
        return 0
    if options.model is None or options.format is None:
        missing = "MODEL" if options.model is None else "--format"
        raise UnusableInput(
            f"export needs {missing}: bondsight export MODEL --format {'|'.join(FORMATS)}"
        )
    from actuators.models.opening import load_model

    graph = load_model(options.model)
    graph.require_sound()
    target = target_of(graph, options.format, options.out)
    if target.resolve() == Path(options.model).resolve():
        raise UnusableInput(f"{target} is the model itself; give another --out")
    for file in export(graph, options.format, options.out):
        print(file)
    if options.format.startswith("fmu") and native.compiler() is None:
        print("no C compiler found: the archive has sources only", file=sys.stderr)
    return 0
