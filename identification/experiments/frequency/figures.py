"""Figures of non-parametric results, one function each; matplotlib is imported when asked for."""

from __future__ import annotations

from typing import Any

import numpy as np

from identification.experiments.frequency.distortions import Distortions
from identification.experiments.frequency.response import FrequencyResponse
from identification.report.style import AFTER, BAD, BEFORE, FLOOR, GOOD


def plot_response(response: FrequencyResponse) -> Any:
    """Draw magnitude and phase of every path, with noise and total standard deviation.

    Returns
    -------
    matplotlib.figure.Figure
        Not shown; ``figure.savefig`` writes it.
    """
    from identification.report.canvas import drawing

    paths = [(y, u) for y in response.outputs for u in response.inputs]
    columns = len(response.inputs)
    size = 3.6 * len(response.outputs), 4.2 * min(3, columns) + 1
    with drawing("response", *size, paper=True) as canvas:
        axes = canvas.figure.subplots(
            2 * len(response.outputs), columns, sharex=True, squeeze=False
        )
        for place, (y, u) in enumerate(paths):
            row, column = divmod(place, columns)
            _path(axes[2 * row, column], axes[2 * row + 1, column], response, y, u)
        for axis in axes[-1]:
            axis.set(xlabel="f (Hz)")
        axes[0, 0].legend()
    return canvas.figure


def _path(top: Any, low: Any, response: FrequencyResponse, y: str, u: str) -> None:
    g, noise, total = response.entry(y, u)
    f = response.frequency
    top.loglog(f, np.abs(g), color=AFTER, label="response")
    for values, colour, word in ((noise, FLOOR, "noise"), (total, BAD, "noise + distortion")):
        if np.isfinite(values).any():
            top.loglog(f, values, ".", ms=2, color=colour, label=f"{word}, 1 sd")
    unit = f"{response.units.get(y, '')}/({response.units.get(u, '')})"
    top.set(title=f"{u} to {y}", ylabel=unit)
    low.semilogx(f, np.degrees(np.unwrap(np.angle(g))), color=AFTER)
    low.set(ylabel="phase (deg)")


def plot_distortions(found: Distortions, output: str | None = None) -> Any:
    """Draw the output spectrum: excited, odd and even lines over the noise.

    Returns
    -------
    matplotlib.figure.Figure
    """
    from identification.report.canvas import drawing

    name = output or found.outputs[0]
    level = found.level(name)
    c = found.outputs.index(name)
    with drawing("distortions", 3.8, 6.4, paper=True) as canvas:
        _lines(canvas.ax, found, c)
        canvas.ax.set(xlabel="f (Hz)", ylabel=f"{name} (dB re 1 {found.units[c]})")
        canvas.ax.set_title(str(level), fontsize=8)
        canvas.ax.legend()
    return canvas.figure


def _lines(axis: Any, found: Distortions, c: int) -> None:
    decibel = 20.0 * np.log10(np.maximum(found.amplitude[:, c], 1e-300))
    for kind, colour, marker in (("excited", AFTER, "."), ("odd", BAD, "x"), ("even", GOOD, "+")):
        at = found.kind == kind
        if at.any():
            axis.plot(
                found.frequency[at], decibel[at], marker, ms=4, color=colour, label=f"{kind} lines"
            )
    if np.isfinite(found.noise[:, c]).any():
        noise = 10.0 * np.log10(np.maximum(found.noise[:, c], 1e-300))
        axis.plot(found.frequency, noise, color=FLOOR, lw=0.8, label="noise, 1 sd")
    spread = found.stochastic[:, c]
    if np.isfinite(spread).any():
        at = np.isfinite(spread)
        axis.plot(
            found.frequency[at], 10.0 * np.log10(np.maximum(spread[at], 1e-300)), ".", ms=2,
            color=BEFORE, label="over realisations, 1 sd",
        )  # fmt: skip
