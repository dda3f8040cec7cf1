"""Frequency responses of linear equations: magnitude and phase of every reading to every input."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from bondgraph.drawing.panels import Panels
from bondgraph.support.arrays import Array

POINTS = 600
AROUND = 30.0
"""Times below the slowest and above the fastest mode that the axes reach."""


def responses(
    matrices: Sequence[Array],
    inputs: Sequence[str],
    outputs: Sequence[str],
    units: Mapping[str, str],
) -> Panels:
    """Draw ``C (s - A)^-1 B + D`` over frequency, in Hz and degrees.

    Returns
    -------
    Panels of matplotlib Axes, shape (2 n_y, n_u)
        Magnitude and phase of each reading, one below the other; a column an input.
    """
    from matplotlib.figure import Figure

    a, b, c, d = matrices
    modes = np.abs(np.linalg.eigvals(a)) / (2 * np.pi) if a.size else np.zeros(0)
    modes = modes[modes > 1e-9 * modes.max(initial=0.0)]
    low, high = (modes.min(), modes.max()) if modes.size else (1.0, 1.0)
    f = np.geomspace(float(low) / AROUND, float(high) * AROUND, POINTS)
    s = 2j * np.pi * f[:, None, None]
    h = c @ np.linalg.solve(s * np.eye(a.shape[0]) - a, np.tile(b, (f.size, 1, 1))) + d
    rows, columns = max(1, len(outputs)), max(1, len(inputs))
    size = (1.0 + 4.5 * columns, 0.8 + 2.8 * rows)
    figure = Figure(figsize=size, layout="constrained")
    axes = figure.subplots(2 * rows, columns, squeeze=False, sharex=True)
    for i, y in enumerate(outputs):
        for k, u in enumerate(inputs):
            size_of, phase_of = axes[2 * i, k], axes[2 * i + 1, k]
            gain, phase = np.abs(h[:, i, k]), np.degrees(np.unwrap(np.angle(h[:, i, k])))
            if not gain.any():  # a phase of nothing is none
                size_of.text(0.5, 0.5, f"{u} does not reach {y}", ha="center", va="center",
                             transform=size_of.transAxes)  # fmt: skip
                gain, phase = np.full(f.size, np.nan), np.full(f.size, np.nan)
            size_of.loglog(f, np.where(gain > 0, gain, np.nan))
            phase_of.semilogx(f, phase)
            below = f"({units[u]})" if "/" in units.get(u, "") else units.get(u, "")
            named = "/".join(n for n in (units.get(y, ""), below) if n)
            size_of.set_title(f"{y} to {u}" + (f", {named}" if named else ""), fontsize=10)
            if k == 0:
                size_of.set_ylabel("magnitude")
                phase_of.set_ylabel("phase, degrees")
    for ax in axes.flat:
        ax.grid(color="#e4e7eb", lw=0.6)
        ax.spines[["top", "right"]].set_visible(False)
    for ax in axes[-1]:
        ax.set_xlabel("frequency, Hz")
    return Panels.of(axes)
