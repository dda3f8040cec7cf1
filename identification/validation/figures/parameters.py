"""Parameters with their intervals, relative to what was declared."""

from __future__ import annotations

import numpy as np
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from identification.report.canvas import drawing, plain
from identification.report.picture import Picture
from identification.report.style import AFTER, BEFORE, FLOOR, MUTED
from identification.validation.judge import Judgement
from identification.validation.validation_data import Number

MOST = 40


def parameter_figure(j: Judgement) -> Picture:
    """Draw each value and its 95 % interval over the declared value (over itself if none)."""
    numbers = [n for n in j.material.numbers if reference(n) != 0 and not n.only][:MOST]
    if not numbers:
        return Picture("", "")
    with drawing("parameters", 0.75 + 0.26 * len(numbers)) as canvas:
        ax = canvas.ax
        rows = np.arange(len(numbers))[::-1]
        ends = [_relative(n) for n in numbers]
        ratios = [v for e in ends for v in e if np.isfinite(v)]
        wide = min(ratios) > 0 and max(ratios) / min(ratios) > 5
        low, high = _window(ratios, wide)
        for y, n, (a, v, b) in zip(rows, numbers, ends, strict=True):
            colour = BEFORE if n.at_bound else AFTER
            a, b = (low if not np.isfinite(a) else a), (high if not np.isfinite(b) else b)
            ax.plot([max(a, low), min(b, high)], [y, y], color=colour, lw=2.2, alpha=0.55)
            ax.plot([np.clip(v, low, high)], [y], "o", color=colour, ms=4.5)
            for side, out in ((low, a < low), (high, b > high)):
                if out:
                    ax.plot([side], [y], "<" if side == low else ">", color=colour, ms=5)
        ax.axvline(1.0, color=FLOOR, lw=1.0, ls="--")
        ax.set_yticks(rows, [plain(n.name) for n in numbers])
        ax.set_ylim(-0.6, len(numbers) - 0.4)
        if wide:
            ax.set_xscale("log")
            ax.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
            ax.xaxis.set_major_formatter(FuncFormatter(lambda v, _: f"{v:g}"))
            ax.xaxis.set_minor_formatter(NullFormatter())
        ax.set_xlim(low, high)
        ax.set_xlabel("value over declared value")
        ax.grid(axis="y", color=MUTED, alpha=0.25)
    cut = len(j.material.numbers) - len(numbers)
    return Picture(
        canvas.svg,
        "Fitted values with 95 % intervals over the declared values; orange lies at a bound, an "
        "arrow leaves the picture." + (f" {cut} are not drawn." if cut else ""),
    )


def reference(n: Number) -> float:
    """Return the declared value, else the fitted one; 0 where neither can be divided by."""
    for v in (n.nominal, n.value):
        if np.isfinite(v) and v != 0:
            return float(v)
    return 0.0


def _relative(n: Number) -> tuple[float, float, float]:
    r = reference(n)
    a, b = sorted((n.ci95[0] / r, n.ci95[1] / r))
    return a, n.value / r, b


def _window(ratios: list[float], wide: bool) -> tuple[float, float]:
    """Range of the axis: what nine tenths need, 1 included."""
    v = np.array([*ratios, 1.0])
    if wide:
        low, high = max(v.min() / 1.3, 1e-3), min(v.max() * 1.3, 1e3)
        return float(low), float(high)
    middle = np.quantile(v, [0.02, 0.98])
    margin = 0.08 * max(float(np.ptp(middle)), 1e-6)
    return (
        float(max(min(middle[0], 1.0) - margin, -3.0)),
        float(min(max(middle[1], 1.0) + margin, 5.0)),
    )
