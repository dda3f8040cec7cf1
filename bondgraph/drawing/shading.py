"""Elements filled by confidence: colours, captions, legend."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

from bondgraph.drawing import paint
from bondgraph.drawing.geometry import Point, Rect
from bondgraph.drawing.legend import LegendEntry

LEAST = 0.01
_WHITE, _FULL = (255, 255, 255), (251, 146, 60)


def fill(confidence: float) -> str:
    """Colour of a confidence between 0 and 1, from white to orange.

    Examples
    --------
    >>> fill(0.0), fill(1.0)
    ('#ffffff', '#fb923c')
    """
    p = min(max(confidence, 0.0), 1.0)
    return "#" + "".join(
        f"{round(a + p * (b - a)):02x}" for a, b in zip(_WHITE, _FULL, strict=True)
    )


def captions(marked: Mapping[str, str], shades: Mapping[str, float]) -> dict[str, str]:
    """Captions of marked elements with the confidence behind them, of others the confidence."""
    found = dict(marked)
    for name, p in shades.items():
        if p >= LEAST:
            share = f"{100 * p:.0f} %"
            found[name] = f"{marked[name]}, {share}" if marked.get(name) else share
    return found


def legend(shaded: bool, marked: bool, also: bool) -> list[LegendEntry]:
    """Entries for the colour, the solid and the dashed ring."""
    if not shaded:
        return []
    found = [LegendEntry("plausibility of the place, 0 to 100 %", paint.FAINT, _scale)]
    if marked:
        found.append(LegendEntry("found here", paint.ACCENT, partial(_ring, colour=paint.ACCENT)))
    if also:
        text = "cannot be told apart from it"
        found.append(
            LegendEntry(text, paint.SECOND, partial(_ring, colour=paint.SECOND, dash="4 2"))
        )
    return found


def _scale(p: Point) -> str:
    steps = (0.0, 0.33, 0.67, 1.0)
    return "".join(
        paint.box(
            Rect(p[0] + 4.0 * i, p[1] - 9.0, p[0] + 4.0 * (i + 1), p[1] + 1.0), fill(s),
            "#9aa5b1", 0.5, 0.0,
        )
        for i, s in enumerate(steps)
    )  # fmt: skip


def _ring(p: Point, colour: str, dash: str = "") -> str:
    return paint.box(
        Rect(p[0], p[1] - 9.0, p[0] + 15.0, p[1] + 1.0), "none", colour, 1.8, 4.0, dash
    )
