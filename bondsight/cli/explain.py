"""``bondsight explain``: a verdict file again, in plain words."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from bondgraph.support.errors import UnusableInput


def add_explain_command(verbs: Any) -> None:
    """Add the command to the parser's verbs."""
    p = verbs.add_parser("explain", help="say a verdict file again in plain words")
    p.add_argument(
        "verdict", type=Path, help="a verdict.json that bondsight diagnose wrote, or its folder"
    )
    p.set_defaults(run=_explain)


def _explain(options: argparse.Namespace) -> int:
    from identification.diagnosis.verdict import read_verdict, retold

    given = options.verdict
    if given.suffix.lower() in (".html", ".htm"):
        raise UnusableInput(
            f"{given}: that is the page; give its folder, {given.parent}, or the verdict.json in it"
        )
    if not given.exists():
        raise UnusableInput(
            f"{given}: no such file or folder; give what `bondsight diagnose --out FOLDER` wrote: "
            "the folder, or the verdict.json in it"
        )
    print(retold(read_verdict(given / "verdict.json" if given.is_dir() else given)))
    return 0
