"""Write the score of a trial: Markdown, JSON, figures, a page that opens offline."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from bondgraph.support.whole_file import write_atomically
from identification.report import html
from identification.report.style import BAD, GOOD
from identification.report.tables import markdown
from tests.proof.trial.figures import figures
from tests.proof.trial.gates import Gate
from tests.proof.trial.parts import Part, facts, headline, parts
from tests.proof.trial.scoring import TrialScore, gate_of, plain


def publish(score: TrialScore, commitment: Mapping[str, Any], folder: Path) -> Path:
    """Write everything into `folder`; returns the path of ``RESULTS.md``.

    What the second proof has counted is read from the folder, if it was.
    """
    second = withheld_counted(folder)
    said, known = headline(score, second), facts(score, commitment)
    pieces = list(parts(score, second))
    drawn = figures(score)
    for name, svg in drawn.items():
        write_atomically(folder / f"{name}.svg", svg)
    content = json.dumps(plain(score, second), indent=1, allow_nan=False)
    write_atomically(folder / "score.json", content + "\n")
    met = score.passed and all(g.passed for g in second)
    badge = ("gates met" if second else "gates met, one open", GOOD)
    badge = badge if met else ("not all gates met", BAD)
    top = html.head("Sealed trial", badge, said, known)
    page = _page(top, pieces, figures(score, paper=False))
    write_atomically(folder / "report.html", page)
    target = folder / "RESULTS.md"
    said = f"**{said}**\n\n" + listing(known)
    write_atomically(target, markdown_of("Sealed trial", said, pieces, drawn))
    return target


def withheld_counted(folder: Path) -> tuple[Gate, ...]:
    """Return the gates of the second proof from where it was published; nothing before."""
    path = folder / "withheld.json"
    if not path.is_file():
        return ()
    rows = json.loads(path.read_text(encoding="utf-8"))["gates"]
    return tuple(map(gate_of, rows))


def listing(known: Sequence[tuple[str, str]]) -> str:
    """Return facts as a list in Markdown."""
    return "\n".join(f"- {k}: {v}" for k, v in known)


def markdown_of(title: str, said: str, pieces: Sequence[Part], drawn: Mapping[str, str]) -> str:
    """Return parts as Markdown that shows the figures beside it."""
    lines = [f"# {title}", said]
    for p in pieces:
        table = markdown(p.heads, [[x.replace("|", "/") for x in r] for r in p.rows])
        lines += [f"## {p.title}", p.text, table if p.rows else ""]
        lines += [f"![{name}]({name}.svg)" for name in p.figures if name in drawn]
    return "\n\n".join(x for x in lines if x) + "\n"


def _page(top: str, pieces: Sequence[Part], drawn: Mapping[str, str]) -> str:
    sections = [
        html.section(
            p.title,
            html.paragraph(p.text),
            *(html.figure(drawn[name]) for name in p.figures if name in drawn),
            html.table(p.heads, p.rows),
        )
        for p in pieces
    ]
    return html.page("trial", "Sealed trial", [top, *sections], source="score.json")
