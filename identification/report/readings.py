"""Every reading as measured and as fitted, and what is left of it over the noise."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from bondgraph.drawing.panels import Panels
from bondgraph.signals.recording import Split
from bondgraph.signals.split import stretches
from bondgraph.support.arrays import Array
from identification.report.style import AFTER, BEFORE, MEASURED, PLOT, SOFT


def readings_drawn(
    time: Array,
    readings: Array,
    units: Mapping[str, str],
    split: Split,
    fits: Sequence[tuple[str, Array, Array]],
    measures: Mapping[str, str] | None = None,
) -> Panels:
    """Draw readings beside what fits make of them; held-out stretches are shaded.

    Parameters
    ----------
    time : ndarray, shape (N,), s
    readings : ndarray, shape (N, n_y)
    units : dict of str to str
        Units of the readings, in their order.
    split : Split
        Which samples were held out.
    fits : sequence of (str, ndarray (N, n_y), ndarray (n_y,))
        Label, simulated readings and noise; the last one is the best.
    measures : dict of str to str, optional
        What the noise of a reading is, where it is not the noise that the recording shows.

    Returns
    -------
    Panels of matplotlib Axes, shape (n_y, 2)
    """
    import matplotlib as mpl
    from matplotlib.figure import Figure

    from identification.report.canvas import one_legend

    colours = (BEFORE, AFTER)[-len(fits) :]
    held_out = (*stretches(split.test), *stretches(split.looked_at))
    # a model is not asked what it does before it is scored: its state there may be any
    scored = np.ones(time.size, bool)
    for part in stretches(split.rest or ()):
        scored[part] = False
    fits = [(n, np.where(scored[:, None], y, np.nan), floor) for n, y, floor in fits]
    with mpl.rc_context({**PLOT, "figure.facecolor": "white"}):
        figure = Figure(figsize=(11.0, 2.6 * len(units)), layout="constrained")
        axes = np.asarray(figure.subplots(len(units), 2, squeeze=False, sharex=True))
        for i, (name, (left, right)) in enumerate(zip(units, axes, strict=True)):
            left.plot(time, readings[:, i], color=MEASURED, label="measured", lw=1.6)
            for (label, simulated, floor), colour in zip(fits, colours, strict=True):
                left.plot(time, simulated[:, i], color=colour, label=label, lw=0.9)
                over = (readings[:, i] - simulated[:, i]) / floor[i]
                right.plot(time, over, color=colour, lw=0.8)
            for part in held_out:
                start, stop, _ = part.indices(time.size)
                for ax in (left, right):
                    ax.axvspan(time[start], time[stop - 1], color=SOFT, alpha=0.12, lw=0)
            left.set_ylabel(f"{name}, {units[name] or 'SI'}")
            right.set_ylabel(f"left over,\ntimes {(measures or {}).get(name, 'the noise')}")
        one_legend(figure, axes[:1, 0])
        unscored = "" if scored.all() else "; no model is drawn in a rest, which is not scored"
        axes[0, 1].set_title(f"shaded: held out{unscored}", loc="right")
        for ax in axes[-1]:
            ax.set_xlabel("time, s")
    return Panels.of(axes)
