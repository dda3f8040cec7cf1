"""Figures without pyplot, and their SVG made safe to put inside a page."""

from __future__ import annotations

import io
import math
import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import matplotlib as mpl
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from identification.report.numbers import superscript
from identification.report.style import AFTER, BAND, FLOOR, MUTED, PLOT, SOFT

WIDTH = 9.3
TILE = 4.75
"""Width of a figure that shares its row, inches: readable on a phone, too."""
SHORT = 1.5
"""Decades below which a logarithmic axis needs more labels."""
_FONT = "system-ui,-apple-system,'Segoe UI',Roboto,'Helvetica Neue',Arial,sans-serif"
_NO_METADATA = dict.fromkeys(("Date", "Creator", "Format", "Type"))


@dataclass(frozen=True)
class Canvas:
    """A figure being drawn, in the style of all figures."""

    figure: Any
    name: str

    def rows(self, n: int, widths: tuple[float, ...] = (1,)) -> Any:
        """Axes, shape (n, len(widths)); columns as wide as `widths` say, to each other."""
        ratios = {"width_ratios": widths}
        return self.figure.subplots(n, len(widths), squeeze=False, gridspec_kw=ratios)

    @cached_property
    def ax(self) -> Any:
        """The only axes."""
        return self.figure.subplots()

    @property
    def svg(self) -> str:
        """The figure as one ``<svg>`` element; the same drawing gives the same bytes."""
        with mpl.rc_context(_settings(self.name)):
            return inline(self.figure, self.name)


def _settings(name: str) -> Any:
    return {**PLOT, "svg.hashsalt": name}


@contextmanager
def drawing(
    name: str, height: float, width: float = WIDTH, paper: bool = False
) -> Iterator[Canvas]:
    """Draw a figure of `width` by `height` inches.

    Parameters
    ----------
    name : str
        Prefix of all ids, so that figures do not refer into each other.
    paper : bool
        On white, for a picture file; figures of a page let the page shine through.
    """
    with mpl.rc_context(_settings(name)):
        colour = "white" if paper else None
        figure = Figure(figsize=(width, height), layout="constrained", facecolor=colour)
        FigureCanvasSVG(figure)
        yield Canvas(figure, name)


def inline(figure: Any, name: str, tight: bool = False) -> str:
    """SVG element of a figure: no prolog, no metadata, ids that start with `name`."""
    out = io.StringIO()
    options: dict[str, Any] = {"bbox_inches": "tight", "pad_inches": 0.02} if tight else {}
    dynamics = figure.get_layout_engine()
    if dynamics is not None:  # matplotlib would draw everything once more to have it laid out
        dynamics.execute(figure)
        figure.set_layout_engine(None)
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


def one_legend(figure: Any, axes: Iterable[Any], most: int = 5, **settings: Any) -> None:
    """Draw one legend above the figure for everything labelled in some axes."""
    found: dict[str, Any] = {}
    for ax in axes:
        for handle, text in zip(*ax.get_legend_handles_labels(), strict=True):
            found.setdefault(text, handle)
    if found:
        figure.legend(
            list(found.values()), list(found), loc="outside upper left",
            ncols=min(len(found), most), **settings,
        )  # fmt: skip


def mark_held_out(ax: Any, start: float, stop: float, alpha: float, named: bool = True) -> None:
    """Tint the held-out samples of a time plot."""
    ax.axvspan(start, stop, color=AFTER, alpha=alpha, lw=0)
    ax.axvline(start, color=MUTED, lw=0.8, ls=":")
    if named:
        ax.annotate(
            "held out", (start, 1.0), (2, 2), xycoords=ax.get_xaxis_transform(),
            textcoords="offset points", va="bottom", fontsize=7.5, color=SOFT,
        )  # fmt: skip


def noise_band(ax: Any, edge: float, word: str, lw: float = 0.8) -> None:
    """Tint what lies within the noise, from -`edge` to `edge`."""
    ax.axhspan(-edge, edge, color=BAND, lw=0, zorder=1, label=word)
    for side in (-edge, edge):
        ax.axhline(side, color=FLOOR, lw=lw, ls="--", zorder=4)
