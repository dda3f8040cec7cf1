"""Every reading as measured and as fitted, and what is left of it over the noise."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from bondgraph.signals.split import stretches
from bondgraph.support.arrays import Array
from identification.report.style import AFTER, BEFORE, MEASURED, PLOT, SOFT

if TYPE_CHECKING:
    from identification.study.problem import Data


def readings_drawn(
    data: Data, fits: Sequence[tuple[str, Array, Array]], units: Mapping[str, str]
) -> Any:
    """Draw readings beside what fits make of them; held-out stretches are shaded.

    Parameters
    ----------
    fits : sequence of (str, ndarray (N, n_y), ndarray (n_y,))
        Label, simulated readings and noise; the last one is the best.

    Returns
    -------
    ndarray of matplotlib Axes, shape (n_y, 2)
    """
    import matplotlib as mpl
    from matplotlib.figure import Figure

    colours = (BEFORE, AFTER)[-len(fits) :]
    held_out = (*stretches(data.split.test), *stretches(data.split.looked_at))
    with mpl.rc_context({**PLOT, "figure.facecolor": "white"}):
        figure = Figure(figsize=(11.0, 2.6 * len(data.names)), layout="constrained")
        axes = np.asarray(figure.subplots(len(data.names), 2, squeeze=False, sharex=True))
        for i, (name, (left, right)) in enumerate(zip(data.names, axes, strict=True)):
            left.plot(data.time, data.readings[:, i], color=MEASURED, label="measured", lw=1.6)
            for (label, simulated, floor), colour in zip(fits, colours, strict=True):
                left.plot(data.time, simulated[:, i], color=colour, label=label, lw=0.9)
                over = (data.readings[:, i] - simulated[:, i]) / floor[i]
                right.plot(data.time, over, color=colour, lw=0.8)
            for part in held_out:
                start, stop, _ = part.indices(data.n)
                for ax in (left, right):
                    ax.axvspan(data.time[start], data.time[stop - 1], color=SOFT, alpha=0.12, lw=0)
            left.set_ylabel(f"{name}, {units.get(name) or 'SI'}")
            right.set_ylabel("left over, times the noise")
        axes[0, 0].legend(loc="upper left", ncols=3)
        axes[0, 0].set_title("shaded: held out")
        for ax in axes[-1]:
            ax.set_xlabel("time, s")
    return axes
