"""Section of the report: what the missing signal looks like, before any law is assumed."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from bondgraph.support.arrays import Array
from identification.diagnosis.diagnose import Diagnosis
from identification.diagnosis.localisation.recording import axes_of
from identification.diagnosis.screening.port_history import PortHistory
from identification.report import html
from identification.report.canvas import TILE, drawing, label
from identification.report.numbers import axis_scale
from identification.report.style import AFTER, BEFORE
from identification.report.words import stopped

MOST = 900
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


def characterised(d: Diagnosis, *, pictures: bool = True) -> str:
    """Sentence, shares and, if wanted, pictures of the latent signal at each port."""
    parts: list[str] = []
    for k, (element, (character, found)) in enumerate([*d.traits.items()][:PORTS]):
        parts += [
            html.heading(f"at {element}") if element else "",
            html.paragraph(stopped(character.words)),
            html.tiles(*(_pictures(d, element, found.signal, k) if pictures else ())),
            _shares(character.explained),
        ]
    if not any(parts):
        return ""
    intro = (
        "The residual fixes what a port must have added to its output, whatever its law is. Which "
        "of the port's own variables explains that signal says what kind of physics it is."
    )
    return html.section(
        "What it looks like, before any law is assumed", html.paragraph(intro), *parts
    )


def _shares(shares: Mapping[str, float]) -> str:
    """Table of the dependences, strongest first."""
    order = sorted(shares, key=lambda n: -shares[n])
    rows = [
        [DEPENDENCES.get(n, n), html.bar(shares[n]), f"{100 * max(shares[n], 0.0):.0f} %"]
        for n in order
    ]
    heads = ("depends on", "", "held-out share of its variance")
    return html.table(heads, rows, (2,))


def _pictures(d: Diagnosis, element: str, signal: Array, k: int) -> list[str]:
    past = d.scene.past.get(element) if d.scene is not None else None
    if past is None or signal.size != past.n or element not in d.graph.elements:
        return []
    axes = axes_of(d.graph, element, past)
    return [
        html.figure(
            _scatter(f"trait-{k}-{j}", axis.values, signal, past, axis.name, axis.unit),
            f"What {element} must have added, over {axis.name}; blue where it rises, orange "
            "where it falls. Branches that part are memory or friction.",
        )
        for j, axis in enumerate(axes[:2] if len(axes) > 1 else ())
    ]


def _scatter(name: str, x: Array, w: Array, past: PortHistory, words: str, unit: str) -> str:
    step = max(1, x.size // MOST)
    moving = np.asarray(past.argument if past.moved is not None else past.rate)
    x, w, rising = x[::step], w[::step], moving[::step] >= 0
    fx, ux = axis_scale(unit, float(np.abs(x).max(initial=0.0)))
    fw, uw = axis_scale("", float(np.abs(w).max(initial=0.0)))
    with drawing(name, 2.5, TILE) as canvas:
        ax = canvas.ax
        for part, colour, said in ((rising, AFTER, "rising"), (~rising, BEFORE, "falling")):
            ax.plot(fx * x[part], fw * w[part], ".", ms=2.5, mew=0, color=colour, label=said)
        ax.set_xlabel(label(words, ux))
        ax.set_ylabel(label("latent signal", uw or "SI"))
        ax.legend(loc="best", markerscale=3)
    return canvas.svg
