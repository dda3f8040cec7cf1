"""Figures without pyplot, and their SVG made safe to put inside a page."""

from __future__ import annotations

import io
import math
import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import matplotlib as mpl
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from identification.diagnosis.report.numbers import superscript
from identification.diagnosis.report.style import PLOT

WIDTH = 9.3
TILE = 4.75
"""Width of a figure that shares its row, inches: readable on a phone, too."""
SHORT = 1.5
"""Decades below which a logarithmic axis needs more labels."""
_FONT = "system-ui,-apple-system,'Segoe UI',Roboto,'Helvetica Neue',Arial,sans-serif"
_NO_METADATA = dict.fromkeys(("Date", "Creator", "Format", "Type"))


@dataclass
class Canvas:
    """A figure being drawn; `svg` is filled when the drawing context ends."""

    figure: Any
    svg: str = ""

    def rows(self, n: int, heights: tuple[float, ...] | None = None, columns: int = 1) -> Any:
        """Axes, shape (n, columns)."""
        ratios = {"height_ratios": heights} if heights else None
        return self.figure.subplots(n, columns, squeeze=False, gridspec_kw=ratios)


@contextmanager
def drawing(name: str, height: float, width: float = WIDTH) -> Iterator[Canvas]:
    """Draw a figure of `width` by `height` inches; the same drawing gives the same bytes.

    Parameters
    ----------
    name : str
        Prefix of all ids, so that figures do not refer into each other.
    """
    settings: Any = {**PLOT, "svg.hashsalt": name}
    with mpl.rc_context(settings):
        figure = Figure(figsize=(width, height), layout="constrained")
        FigureCanvasSVG(figure)
        canvas = Canvas(figure)
        yield canvas
        canvas.svg = inline(figure, name)


def inline(figure: Any, name: str, tight: bool = False) -> str:
    """SVG element of a figure: no prolog, no metadata, ids that start with `name`."""
    out = io.StringIO()
    options: dict[str, Any] = {"bbox_inches": "tight", "pad_inches": 0.02} if tight else {}
    figure.savefig(out, format="svg", metadata=_NO_METADATA, transparent=True, **options)
    text = out.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    text = re.sub(r"<!--.*?-->", "", text, flags=re.DOTALL)
    text = re.sub(r'<g id="[^"]*"', "<g", text)
    text = re.sub(r'\bid="', f'id="{name}-', text)
    text = re.sub(r'href="#', f'href="#{name}-', text)
    text = text.replace("url(#", f"url(#{name}-")
    text = text.replace("'DejaVu Sans'", _FONT)
    return re.sub(r"\n\s*", "\n", text).strip()


def logarithmic(axis: Any) -> None:
    """Label a logarithmic axis with plain text; a short one at 2 and 5 as well.

    Plain text keeps the font of the page, and is several times faster than formulas.
    """

    def decades() -> float:
        low, high = sorted(axis.get_view_interval())
        return float(math.log10(high / low)) if low > 0 else math.inf

    def major(v: float, _: int) -> str:
        power = round(math.log10(v)) if v > 0 else 0
        return f"{v:g}" if -3 < power < 4 else f"10{superscript(power)}"

    def minor(v: float, _: int) -> str:
        lead = v / 10.0 ** math.floor(math.log10(v) + 1e-9) if v > 0 else 0.0
        return major_or_short(v) if decades() < SHORT and round(lead, 6) in (2.0, 5.0) else ""

    def major_or_short(v: float) -> str:
        return f"{v:g}" if 1e-3 < v < 1e4 else f"{v:.0e}"

    axis.set_major_formatter(FuncFormatter(major))
    axis.set_minor_formatter(FuncFormatter(minor))


def plain(text: str) -> str:
    """Text that matplotlib shows as it is."""
    return text.replace("\\", "\\\\").replace("$", r"\$") if "$" in text else text


def label(name: str, unit: str) -> str:
    """Axis label with its unit."""
    return plain(f"{name} ({unit})" if unit else name)
