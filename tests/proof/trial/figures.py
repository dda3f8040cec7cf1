"""Figures of the score as SVG: names, power, calibration."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from identification.report.style import AFTER, BAD, MUTED
from identification.report.words import spaced
from tests.proof.trial.scoring import Score

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LINE, LIGHT = AFTER, MUTED


def figures(score: Score) -> Mapping[str, str]:
    """Return the figures by file name, as SVG text that does not change from run to run."""
    made = {}
    if score.names.rows:
        size = (2.6 + 0.26 * len(score.names.columns), 2.0 + 0.24 * len(score.names.rows))
        made["names.svg"] = _drawn(_names, score, size)
    if score.power:
        made["power.svg"] = _drawn(_power, score, (6.2, 3.6))
    if score.calibration.table:
        made["calibration.svg"] = _drawn(_calibration, score, (4.2, 4.0))
    return made


def _drawn(draw: Any, score: Score, size: tuple[float, float]) -> str:
    from identification.report.canvas import drawing

    with drawing(draw.__name__.strip("_"), size[1], size[0], paper=True) as canvas:
        draw(canvas.ax, score)
    return canvas.svg + "\n"


def _names(axes: Axes, score: Score) -> None:
    c = score.names
    counts = np.array([[c.counts[r].get(k, 0) for k in c.columns] for r in c.rows], float)
    share = counts / counts.sum(axis=1, keepdims=True)
    axes.grid(False)
    axes.imshow(share, cmap="Blues", vmin=0.0, vmax=1.0, aspect="auto")
    for i, j in zip(*np.nonzero(counts), strict=True):
        colour = "white" if share[i, j] > 0.5 else "black"
        axes.text(j, i, f"{counts[i, j]:.0f}", ha="center", va="center", color=colour, fontsize=6)
    axes.set_xticks(range(len(c.columns)), [*map(spaced, c.columns)], rotation=90)
    axes.set_yticks(range(len(c.rows)), [*map(spaced, c.rows)])
    axes.set_xlabel("answer")
    axes.set_ylabel("concealed")


def _power(axes: Axes, score: Score) -> None:
    middle = np.array([0.5 * (p.low + p.high) for p in score.power])
    for attribute, colour, label, shift in (
        ("detected", LIGHT, "something said to be missing", -0.4),
        ("named", LINE, "right name and place", 0.0),
        ("wrong", BAD, "wrong name", 0.4),
    ):
        rates = [getattr(p, attribute) for p in score.power]
        value = np.array([r.value for r in rates])
        ends = np.array([r.interval for r in rates])
        # rounding may put an end of the interval beside the value it holds
        below = np.maximum(value - ends[:, 0], 0)
        above = np.maximum(ends[:, 1] - value, 0)
        axes.errorbar(
            middle + shift, value, yerr=[below, above], fmt="o-", color=colour, label=label,
            markersize=3, linewidth=1, capsize=2,
        )  # fmt: skip
    axes.set_xlabel("excess of the nominal misfit over the noise floor, dB")
    axes.set_ylabel("share of the recordings")
    axes.set_ylim(-0.03, 1.03)
    axes.legend()


def _calibration(axes: Axes, score: Score) -> None:
    axes.plot([0, 1], [0, 1], color=LIGHT, linewidth=1)
    for r in score.calibration.table:
        low, high = r.right.interval
        axes.plot([r.stated] * 2, [low, high], color=LINE, linewidth=1)
        axes.plot(r.stated, r.right.value, "o", color=LINE, markersize=3)
        axes.annotate(
            str(r.right.total), (r.stated, r.right.value), textcoords="offset points",
            xytext=(-4, -9), ha="right", fontsize=6,
        )  # fmt: skip
    axes.set_xlabel("stated confidence")
    axes.set_ylabel("share that was right")
    axes.set_xlim(0, 1.02)
    axes.set_ylim(0, 1.02)
