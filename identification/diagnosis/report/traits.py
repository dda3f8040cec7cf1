"""Section of the report: what the missing signal looks like, before any law is assumed."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from identification.diagnosis.diagnose import Diagnosis
from identification.diagnosis.localisation.recording import axes_of
from identification.diagnosis.report import html
from identification.diagnosis.report.canvas import TILE, drawing, label
from identification.diagnosis.report.found import extra
from identification.diagnosis.report.numbers import axis_scale
from identification.diagnosis.report.style import AFTER, BEFORE
from identification.diagnosis.screening.port_history import PortHistory

Array = np.ndarray
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


@dataclass(frozen=True, eq=False)
class Trait:
    """What is known of the signal at one port.

    Attributes
    ----------
    words : str
    shares : dict of str to float
        Held-out share of its variance that each dependence explains.
    signal : ndarray, shape (N,), SI, or None
        The addition to the port's output that explains the residual.
    """

    element: str
    words: str
    shares: Mapping[str, float]
    signal: Array | None


def traits_of(d: Diagnosis) -> tuple[Trait, ...]:
    """Characters of ports with their latent signals, by element or one after the other."""
    raw = extra(d, "traits")
    if isinstance(raw, Mapping):
        pairs: Iterable[tuple[str, Any]] = raw.items()
    else:
        pairs = ((str(getattr(t, "element", "")), t) for t in raw)
    return tuple(_trait(element, t) for element, t in pairs)


def _trait(element: str, t: Any) -> Trait:
    parts = t if isinstance(t, tuple) else (t,)
    parts = (*parts, *(p for t in parts for p in (_of(t, "character"), _of(t, "latent")) if p))
    words = next((w for p in parts if (w := _of(p, "words"))), "")
    shares = next((s for p in parts if isinstance(s := _of(p, "explained"), Mapping)), {})
    signal = next((s for p in parts if (s := _of(p, "signal")) is not None), None)
    words = words() if callable(words) else words
    return Trait(element, str(words), shares, None if signal is None else np.asarray(signal))


def _of(holder: Any, name: str) -> Any:
    return getattr(holder, name, None)


def characterised(d: Diagnosis) -> str:
    """Sentence, shares and pictures of the latent signal at each port that was looked at."""
    parts: list[str] = []
    for k, t in enumerate(traits_of(d)[:PORTS]):
        said = t.words[:1].upper() + t.words[1:]
        parts += [
            html.heading(f"at {t.element}") if t.element else "",
            html.paragraph(said + ("" if said.endswith(".") or not said else ".")),
            html.tiles(*_pictures(d, t, k)),
            _shares(t.shares),
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
    return html.table(heads, rows, (2,), trusted=(1,))


def _pictures(d: Diagnosis, t: Trait, k: int) -> list[str]:
    past = d.scene.past.get(t.element) if d.scene is not None else None
    if (
        past is None
        or t.signal is None
        or t.signal.size != past.n
        or t.element not in d.graph.elements
    ):
        return []
    axes = axes_of(d.graph, t.element, past)
    if len(axes) < 2:
        return []
    found = []
    for j, axis in enumerate(axes[:2]):
        svg = _scatter(f"trait-{k}-{j}", axis.values, t.signal, past, axis.name, axis.unit)
        found.append(
            html.figure(
                svg,
                f"What {t.element} must have added, over {axis.name}; blue where it rises, orange "
                "where it falls. Branches that part are memory or friction.",
            )
        )
    return found


def _scatter(name: str, x: Array, w: Array, past: PortHistory, words: str, unit: str) -> str:
    step = max(1, x.size // MOST)
    moving = np.asarray(past.argument if past.moved is not None else past.rate)
    x, w, rising = x[::step], w[::step], moving[::step] >= 0
    fx, ux = axis_scale(unit, float(np.abs(x).max(initial=0.0)))
    fw, uw = axis_scale("", float(np.abs(w).max(initial=0.0)))
    with drawing(name, 2.5, TILE) as canvas:
        ax = canvas.rows(1)[0, 0]
        for part, colour, said in ((rising, AFTER, "rising"), (~rising, BEFORE, "falling")):
            ax.plot(fx * x[part], fw * w[part], ".", ms=2.5, mew=0, color=colour, label=said)
        ax.set_xlabel(label(words, ux))
        ax.set_ylabel(label("latent signal", uw or "SI"))
        ax.legend(loc="best", markerscale=3)
    return canvas.svg
