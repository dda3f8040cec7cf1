"""Final costs of many starts, sorted: how many found the same valley."""

from __future__ import annotations

import numpy as np

from identification.report.canvas import drawing
from identification.report.picture import Picture
from identification.report.style import AFTER, FLOOR, MUTED
from identification.validation.judge import Judgement

SAME = 1e-3
# relative distance of costs that count as one valley


def waterfall_figure(j: Judgement) -> Picture:
    """Draw the cost of each start, best first; empty if there was only one start."""
    costs = np.array(j.material.starts, float)
    good = np.sort(costs[np.isfinite(costs) & (costs > 0)])
    if good.size < 2:
        return Picture("", "")
    best = int(np.sum(good <= good[0] * (1 + SAME)))
    with drawing("waterfall", 2.4, 6.5) as canvas:
        ax = canvas.ax
        order = np.arange(1, good.size + 1)
        ax.semilogy(order, good, "-", color=MUTED, lw=0.8, zorder=1)
        ax.semilogy(order[:best], good[:best], "o", color=AFTER, ms=4, label="best valley")
        if best < good.size:
            ax.semilogy(order[best:], good[best:], "o", color=MUTED, ms=3.5, label="elsewhere")
        ax.axhline(1.0, color=FLOOR, lw=1.2, ls="--", label="noise floor")
        ax.set_xlabel("start, best first")
        ax.set_ylabel("mean square / floor")
        ax.set_xlim(0.3, good.size + 0.7)
        if good.size <= 20:
            ax.set_xticks(order)
        ax.legend(loc="upper left")
    failed = costs.size - good.size
    return Picture(
        canvas.svg,
        f"{best} of {costs.size} starts end in the best valley"
        + (f"; {failed} could not be simulated." if failed else "."),
    )
