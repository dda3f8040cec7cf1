"""Pages that follow from the command line and from the models."""

from __future__ import annotations

import argparse
from pathlib import Path

from actuators.models.catalogue import MODELS
from bondgraph.drawing.svg import svg
from bondsight.cli.main import _parser


def write_commands(file: Path) -> None:
    """Write the help of every verb."""
    parser = _parser()
    lines = ["# Commands", "", "```text", parser.format_help().rstrip(), "```", ""]
    (verbs,) = (a for a in parser._actions if isinstance(a, argparse._SubParsersAction))
    for name, verb in sorted(verbs.choices.items()):
        lines += [f"## {name}", "", "```text", verb.format_help().rstrip(), "```", ""]
    file.write_text("\n".join(lines), encoding="utf-8")


def write_models(folder: Path) -> None:
    """Write the catalogue of models, each drawn with its causal strokes."""
    folder.mkdir(parents=True, exist_ok=True)
    lines = ["# Models", "", "By name in every command, or from `actuators` in Python.", ""]
    for name, build in MODELS.items():
        graph = build()
        (folder / f"{name}.svg").write_text(svg(graph), encoding="utf-8")
        lines += [f"## {name}", "", _first(build.__doc__), "", f"![{name}]({name}.svg)", ""]
        rows = [f"| `{n}` | {p.value:.6g} | {p.unit} |" for n, p in graph.parameters.items()]
        lines += ["| parameter | value | unit |", "| --- | --- | --- |", *rows, ""]
    (folder / "index.md").write_text("\n".join(lines), encoding="utf-8")


def _first(text: str | None) -> str:
    return " ".join((text or "").split("\n\n")[0].split()).replace("``", "`")
