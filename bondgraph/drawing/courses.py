"""Channels over time, one below the other."""

from __future__ import annotations

from collections.abc import Mapping

from bondgraph.drawing.panels import Panels
from bondgraph.support.arrays import Array


def courses(time: Array, channels: Mapping[str, Array], units: Mapping[str, str]) -> Panels:
    """Draw channels over time.

    Returns
    -------
    Panels of matplotlib Axes, shape (n,)
    """
    from matplotlib.figure import Figure

    count = max(1, len(channels))
    figure = Figure(figsize=(9.0, 0.8 + 1.4 * count), layout="constrained")
    axes = figure.subplots(count, 1, squeeze=False, sharex=True)[:, 0]
    for ax, (name, values) in zip(axes, channels.items(), strict=False):
        ax.plot(time, values, lw=1.0)
        ax.set_ylabel(f"{name}, {units[name]}" if units.get(name) else name)
        ax.grid(color="#e4e7eb", lw=0.6)
        ax.spines[["top", "right"]].set_visible(False)
    axes[-1].set_xlabel("time, s")
    return Panels.of(axes)
