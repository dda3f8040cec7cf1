"""Figures of non-parametric results, one function each; matplotlib is imported when asked for."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from identification.experiments.frequency.distortions import Distortions
from identification.experiments.frequency.response import FrequencyResponse

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["plot_distortions", "plot_response"]


def plot_response(response: FrequencyResponse) -> Figure:
    """Draw magnitude and phase of every path, with noise and total standard deviation.

    Returns
    -------
    matplotlib.figure.Figure
        Not shown; ``figure.savefig`` writes it.
    """
    from matplotlib.figure import Figure

    paths = [(y, u) for y in response.outputs for u in response.inputs]
    figure = Figure(figsize=(4.2 * min(3, len(response.inputs)) + 1, 3.6 * len(response.outputs)))
    columns = len(response.inputs)
    axes = figure.subplots(2 * len(response.outputs), columns, sharex=True, squeeze=False)
    for place, (y, u) in enumerate(paths):
        row, column = divmod(place, columns)
        g, noise, total = response.entry(y, u)
        top, low = axes[2 * row, column], axes[2 * row + 1, column]
        f = response.frequency
        top.loglog(f, np.abs(g), color="C0", label="response")
        for values, colour, word in ((noise, "0.5", "noise"), (total, "C3", "noise + distortion")):
            if np.isfinite(values).any():
                top.loglog(f, values, ".", ms=2, color=colour, label=f"{word}, 1 sd")
        unit = f"{response.units.get(y, '')}/({response.units.get(u, '')})"
        top.set(title=f"{u} to {y}", ylabel=unit)
        low.semilogx(f, np.degrees(np.unwrap(np.angle(g))), color="C0")
        low.set(ylabel="phase (deg)")
    for axis in axes[-1]:
        axis.set(xlabel="f (Hz)")
    axes[0, 0].legend(fontsize="small")
    figure.set_layout_engine("constrained")
    return figure


def plot_distortions(found: Distortions, output: str | None = None) -> Figure:
    """Draw the output spectrum: excited, odd and even lines over the noise.

    Returns
    -------
    matplotlib.figure.Figure
    """
    from matplotlib.figure import Figure

    name = output or found.outputs[0]
    level = found.level(name)
    c = found.outputs.index(name)
    figure = Figure(figsize=(6.4, 3.8))
    axis = figure.subplots()
    decibel = 20.0 * np.log10(np.maximum(found.amplitude[:, c], 1e-300))
    for kind, colour, marker in (("excited", "C0", "."), ("odd", "C3", "x"), ("even", "C2", "+")):
        at = found.kind == kind
        if at.any():
            axis.plot(
                found.frequency[at], decibel[at], marker, ms=4, color=colour, label=f"{kind} lines"
            )
    if np.isfinite(found.noise[:, c]).any():
        noise = 10.0 * np.log10(np.maximum(found.noise[:, c], 1e-300))
        axis.plot(found.frequency, noise, color="0.5", lw=0.8, label="noise, 1 sd")
    spread = found.stochastic[:, c]
    if np.isfinite(spread).any():
        at = np.isfinite(spread)
        axis.plot(
            found.frequency[at], 10.0 * np.log10(np.maximum(spread[at], 1e-300)), ".", ms=2,
            color="C1", label="over realisations, 1 sd",
        )  # fmt: skip
    axis.set(xlabel="f (Hz)", ylabel=f"{name} (dB re 1 {found.units[c]})", title=str(level))
    axis.title.set_fontsize(8)
    axis.legend(fontsize="small")
    figure.set_layout_engine("constrained")
    return figure
