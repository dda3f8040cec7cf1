"""Section of the report: what the missing signal looks like, before any law is assumed."""

from __future__ import annotations

from collections.abc import Mapping

from identification.diagnosis.diagnose import Diagnosis
from identification.report import html
from identification.report.words import stopped

PORTS = 3
DEPENDENCES = {
    "argument": "its present argument",
    "rate": "the rate of its argument",
    "memory": "its argument and the turning points",
    "slow": "slow lags of its argument",
    "product": "argument and rate together",
    "time": "time",
    "way": "the way it has gone",
}


RAW = (
    " It is rebuilt from what the model as it is leaves, whose other values have bent for what is "
    "missing: it may show less than the law that was named, and nothing of one that follows a "
    "variable of another element."
)
"""What is said of it where a law was named, which was fitted with all other values."""

UNSEEN = (
    "No variable of the port alone draws it while all other values are kept; with those refitted "
    "the law that was named does."
)


def characterised(d: Diagnosis) -> str:
    """Sentence and shares of the latent signal at each port; of what was named at its place."""
    parts: list[str] = []
    named = [s.chosen.element for s in d.findings if s.chosen is not None]
    shown = {n: d.traits[n] for n in named if n in d.traits} if named else d.traits
    for element, (character, _) in [*shown.items()][:PORTS]:
        unseen = character.variable == "nothing"
        parts += [
            html.heading(f"at {element}") if element else "",
            html.paragraph(UNSEEN if named and unseen else stopped(character.words)),
            html.paragraph(
                f"What {element} must have added is in its law plane." if element else ""
            ),
            _shares(character.explained),
        ]
    if not any(parts):
        return ""
    intro = (
        "The residual fixes what a port must have added to its output, whatever its law is. Which "
        "of the port's own variables explains that signal says what kind of physics it is."
    )
    return html.section(
        "What it looks like, before any law is assumed",
        html.paragraph(intro + (RAW if named else "")), *parts,
    )  # fmt: skip


def _shares(shares: Mapping[str, float]) -> str:
    """Table of the dependences, strongest first."""
    order = sorted(shares, key=lambda n: -shares[n])
    rows = [
        [DEPENDENCES.get(n, n), html.bar(shares[n]), f"{100 * max(shares[n], 0.0):.0f} %"]
        for n in order
    ]
    heads = ("depends on", "", "held-out share of its variance")
    return html.table(heads, rows, (2,))
