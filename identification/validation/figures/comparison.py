"""Fits side by side over the noise floor."""

from __future__ import annotations

import numpy as np

from identification.report.canvas import drawing, plain
from identification.report.picture import Picture
from identification.report.style import AFTER, BAND, FLOOR, MUTED
from identification.validation.compare import Comparison

MOST = 6


def comparison_figure(c: Comparison) -> Picture:
    """Draw the held-out rms error over the floor, reading by reading, with 95 % intervals."""
    readings = list(range(len(c.best.judgement.channels)))[:MOST]
    fits = c.contestants
    with drawing("comparison", 0.7 + len(readings) * (0.4 + 0.32 * len(fits))) as canvas:
        axes = canvas.rows(len(readings))[:, 0]
        for ax, k in zip(axes, readings, strict=True):
            errors = [x.judgement.channels[k].judged for x in fits]
            rows = np.arange(len(fits))[::-1]
            size = np.array([np.sqrt(e.chi2) for e in errors])
            ends = np.array([[np.sqrt(v) for v in e.chi2_ci] for e in errors])
            spread = np.nan_to_num(np.abs(ends.T - size))
            colours = [AFTER if x is c.best else MUTED for x in fits]
            ax.axvspan(1e-9, 1.0, color=BAND, lw=0, zorder=0)
            ax.axvline(1.0, color=FLOOR, lw=1.4, ls="--", zorder=1)
            ax.hlines(rows, np.minimum(size, 1.0), np.maximum(size, 1.0), color=colours, lw=1.2)
            ax.errorbar(size, rows, xerr=spread, fmt="none", ecolor="#3e4c59", lw=3, alpha=0.45)
            ax.scatter(size, rows, s=34, color=colours, zorder=3)
            for y, v in zip(rows, size, strict=True):
                ax.annotate(f"{v:.3g}", (v, y), (0, 6), textcoords="offset points", ha="center",
                            fontsize=8)  # fmt: skip
            ax.set_ylim(-0.6, len(fits) - 0.3)
            top = float(np.nanmax(np.append(ends, size), initial=1.2))
            low = float(np.nanmin(size, initial=1.0))
            if top > 8:
                ax.set_xscale("log")
                ax.set_xlim(0.7 * low, 1.4 * top)
            else:
                ax.set_xlim(0, 1.15 * top)
            ax.set_yticks(rows, [plain(x.name) for x in fits])
            v = c.best.judgement.channels[k]
            ax.set_title(plain(c.best.judgement.material.label(v.channel, v.record)))
        axes[-1].set_xlabel("rms error / noise floor")
    return Picture(
        canvas.svg,
        "Held-out error of each fit over the noise floor (dashed, tinted below), with 95 % "
        "intervals; the best in colour.",
    )
