"""Autocorrelation of the residuals and their correlation with the inputs, with 95 % bands."""

from __future__ import annotations

from typing import Any

import numpy as np

from identification.report.canvas import drawing, plain
from identification.report.picture import Picture
from identification.report.style import AFTER, BAND, BEFORE, FLOOR
from identification.validation.channel import ChannelJudgement
from identification.validation.figures.layout import MOST_ROWS, left_out
from identification.validation.judge import Judgement

MOST_COLUMNS = 3
MOST_LAGS = 60


def correlation_figure(j: Judgement) -> Picture:
    """Draw one row a reading: its own memory, then what it owes to each input."""
    ranked = sorted(j.channels, key=lambda c: -np.nan_to_num(c.judged.chi2, nan=-1.0))
    kept = ranked[:MOST_ROWS]
    rows = [c for c in j.channels if c in kept and c.white is not None]
    if not rows:
        return Picture("", "")
    columns = 1 + min(max(len(c.inputs) for c in rows), MOST_COLUMNS - 1)
    with drawing("correlations", 0.35 + 2.0 * len(rows)) as canvas:
        axes = canvas.rows(len(rows), (1,) * columns)
        for line, c in zip(axes, rows, strict=True):
            _memory(line[0], c, j.material.label(c.channel, c.record))
            for k, ax in enumerate(line[1:]):
                _crossed(ax, c, k)
        for ax in axes[-1]:
            ax.set_xlabel("lag (samples)")
    return Picture(
        canvas.svg,
        "Left: autocorrelation of the training residual. Right: correlation with the inputs "
        "(input whitened); positive lags follow the input, negative ones run ahead of it. "
        f"Tinted: 95 % of what independent noise of these colours gives.{left_out(j)}",
    )


def _memory(ax: Any, c: ChannelJudgement, name: str) -> None:
    w = c.white
    assert w is not None
    top = int(min(w.correlations.size - 1, max(25, 1.3 * w.coloured_to), 4 * MOST_LAGS))
    lags = np.arange(1, top + 1)
    _stems(ax, lags, w.correlations[1 : top + 1], w.band, AFTER)
    ax.set_ylabel(plain(f"{name}: correlation"))
    ax.set_title("white" if w.white else "coloured")


def _crossed(ax: Any, c: ChannelJudgement, k: int) -> None:
    if k >= len(c.inputs):
        ax.set_axis_off()
        return
    x = c.inputs[k]
    _stems(ax, x.lags, x.correlations, x.band, BEFORE)
    ax.axvline(-0.5, color=FLOOR, lw=0.8, ls=":")
    if x.causal and x.anticausal:
        word = "follows and runs ahead of"
    elif x.causal:
        word = "follows"
    else:
        word = "runs ahead of" if x.anticausal else "independent of"
    ax.set_title(plain(f"{word} {x.input}"))


def _stems(ax: Any, lags: Any, values: Any, band: float, colour: str) -> None:
    ax.axhspan(-band, band, color=BAND, lw=0, zorder=1)
    for side in (-band, band):
        ax.axhline(side, color=FLOOR, lw=0.8, ls="--", zorder=1.5)
    ax.vlines(lags, 0, values, color=colour, lw=1.4, zorder=2)
    if lags.size <= 100:
        ax.plot(lags, values, "o", ms=2.4, color=colour, zorder=3)
    ax.axhline(0, color=FLOOR, lw=0.6)
    reach = 1.25 * max(float(np.abs(values).max(initial=0.0)), 1.6 * band)
    ax.set_ylim(-reach, reach)
    ax.set_xlim(lags[0] - 1, lags[-1] + 1)
