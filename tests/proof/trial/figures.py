"""Figures of the score as SVG: names, power, reliability, error over the oracle's, baselines."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from identification.report.canvas import drawing, logarithmic
from identification.report.style import AFTER, BAD, GOOD, MUTED
from identification.report.words import spaced
from tests.proof.trial.curve_figure import HEIGHT, curves_on
from tests.proof.trial.scoring import TrialScore
from tests.proof.trial.tables import Power

Draw = Callable[[Any, TrialScore], None]
ACROSS = 4
"""Small pictures in a row."""


def figures(score: TrialScore, paper: bool = True) -> dict[str, str]:
    """Return the figures by name, as SVG text that does not change from run to run.

    Parameters
    ----------
    paper : bool
        On white, for a picture file; figures of a page let the page show through.
    """
    c, rows = score.names, -(-(len(score.power) - 1) // ACROSS)
    table: dict[str, tuple[Draw, float, float, bool]] = {
        "names": (_names, 2.6 + 0.26 * len(c.columns), 2.0 + 0.24 * len(c.rows), bool(c.rows)),
        "power": (_power, 6.2, 3.6, "all" in score.power and bool(score.power["all"])),
        "power_by_cell": (_by_cell, 8.4, 1.6 * rows + 0.8, len(score.power) > 2),
        "reliability": (_reliability, 4.4, 4.0, bool(score.exam.reliability)),
        "error_over_oracle": (_ratios, 6.2, 3.2, bool(score.ratios)),
        "baselines": (_baselines, 8.4, HEIGHT, any(c.points for c in score.curves)),
    }
    made = {}
    for name, (draw, width, height, there) in table.items():
        if there:
            with drawing(name, height, width, paper=paper) as canvas:
                draw(canvas.figure if draw in WHOLE else canvas.ax, score)
            made[name] = canvas.svg + "\n"
    return made


def _names(axes: Any, score: TrialScore) -> None:
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


def _curve(
    axes: Any, powers: tuple[Power, ...], what: str, shift: float = 1.0, **style: Any
) -> None:
    rates = [getattr(p, what) for p in powers]
    value, ends = np.array([r.value for r in rates]), np.array([r.exact for r in rates])
    # the geometric middle of the range, half a decade where one end is open
    low = np.array([p.low or p.high / 3 for p in powers])
    high = np.array([min(p.high, 3 * p.low or p.high) for p in powers])
    axes.errorbar(
        shift * np.sqrt(low * high), value,
        yerr=[np.maximum(value - ends[:, 0], 0), np.maximum(ends[:, 1] - value, 0)],
        fmt="o-", markersize=3, linewidth=1, capsize=2, **style,
    )  # fmt: skip


def _strengths(axes: Any) -> None:
    axes.set_xscale("log")
    logarithmic(axes.xaxis)
    axes.set_xlabel("what the effect moves a reading by, over its noise (rms)")
    axes.set_ylabel("share of the recordings")
    axes.set_ylim(-0.03, 1.03)
    axes.legend()


def _power(axes: Any, score: TrialScore) -> None:
    for what, colour, label, shift in (
        ("told", MUTED, "said to miss something", 0.94),
        ("placed", GOOD, "right place, and name or kind", 0.98),
        ("named", AFTER, "right name and place", 1.02),
        ("wrong", BAD, "wrong name", 1.06),
    ):
        _curve(axes, score.power["all"], what, shift, color=colour, label=label)
    _strengths(axes)


def _by_cell(figure: Any, score: TrialScore) -> None:
    """Draw a small picture for each cell."""
    groups = [(cell, powers) for cell, powers in score.power.items() if cell != "all"]
    grid = figure.subplots(
        -(-len(groups) // ACROSS), ACROSS, squeeze=False, sharex=True, sharey=True
    )
    for axes in grid.flat[len(groups) :]:
        axes.set_axis_off()
    for axes, (cell, powers) in zip(grid.flat, groups, strict=False):
        _curve(axes, powers, "placed", color=GOOD, label="right place, and name or kind")
        _curve(axes, powers, "named", 1.04, color=AFTER, label="right name and place")
        axes.set_title(spaced(cell))
        axes.set_xscale("log")
        logarithmic(axes.xaxis)
        axes.set_ylim(-0.05, 1.05)
    figure.supxlabel("what the effect moves a reading by, over its noise (rms)", fontsize="medium")
    figure.supylabel("share of the recordings", fontsize="medium")
    figure.legend(*grid.flat[0].get_legend_handles_labels(), loc="outside upper right", ncols=2)


def _reliability(axes: Any, score: TrialScore) -> None:
    axes.plot([0, 1], [0, 1], color=MUTED, linewidth=1)
    for r in score.exam.reliability:
        axes.plot([r.stated] * 2, r.right.exact, color=AFTER, linewidth=1)
        axes.plot(r.stated, r.right.value, "o", color=AFTER, markersize=3)
        axes.annotate(
            str(r.right.total), (r.stated, r.right.value), textcoords="offset points",
            xytext=(-4, -9), ha="right", fontsize=6,
        )  # fmt: skip
    axes.set_xlabel("stated probability of the name")
    axes.set_ylabel("share that was right")
    axes.set_xlim(min(0.75, *(r.low for r in score.exam.reliability)), 1.01)
    axes.set_ylim(min(0.75, *(r.right.exact[0] for r in score.exam.reliability)), 1.01)


def _ratios(axes: Any, score: TrialScore) -> None:
    found = np.sort([*score.ratios.values()])
    axes.step(found, np.arange(1, found.size + 1) / found.size, where="post", color=AFTER)
    axes.axvline(1.0, color=MUTED, linewidth=1)
    axes.set_xscale("log")
    logarithmic(axes.xaxis)
    axes.set_xlabel("held-out error after the repair, over the oracle's")
    axes.set_ylabel("share of the recordings")


def _baselines(figure: Any, score: TrialScore) -> None:
    curves_on(figure, score.curves)


WHOLE = (_by_cell, _baselines)
"""What draws on the figure, not on its only axes."""
