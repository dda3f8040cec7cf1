"""Spectrum by kind of line beside the residual and the noise."""

from __future__ import annotations

from typing import Any

import numpy as np

from identification.report.canvas import drawing, label, one_legend
from identification.report.numbers import axis_scale
from identification.report.picture import Picture
from identification.report.style import AFTER, BEFORE, FLOOR, MEASURED
from identification.validation.distortion import Separated

ODD, EVEN = BEFORE, "#6d28d9"
MOST = 4


def distortion_figure(s: Separated, name: str = "distortion") -> Picture:
    """Draw excited, odd and even lines of each reading, its noise, and what the model leaves.

    Parameters
    ----------
    name : str
        Prefix of the ids in the SVG; different in figures of one page.
    """
    outputs = s.reading.outputs[:MOST]
    with drawing(name, 0.6 + 2.5 * len(outputs)) as canvas:
        axes = canvas.rows(len(outputs))[:, 0]
        for c, (ax, output) in enumerate(zip(axes, outputs, strict=True)):
            _lines(ax, s, c, output)
        axes[-1].set_xlabel("frequency (Hz)")
        one_legend(canvas.figure, [axes[0]])
    return Picture(
        canvas.svg,
        f"{s.record}: mean over {s.reading.periods} periods. Lines the drive leaves out show noise "
        "and distortion only; where the residual at excited lines stays above the noise, the model "
        "misses something that repeats.",
    )


def _lines(ax: Any, s: Separated, c: int, name: str) -> None:
    d = s.reading
    unit = d.units[c]
    factor, shown = axis_scale("" if unit == "1" else unit, float(d.amplitude[:, c].max()))
    kinds = (("excited", MEASURED, "excited"), ("odd", ODD, "odd, left out"),
             ("even", EVEN, "even, left out"))  # fmt: skip
    for kind, colour, word in kinds:
        at = d.kind == kind
        if at.any():
            ax.loglog(d.frequency[at], factor * d.amplitude[at, c], ".", ms=3, color=colour,
                      alpha=0.7, label=word)  # fmt: skip
    at = (d.kind == "excited") & np.isfinite(s.residual[:, c])
    if at.any():
        ax.loglog(d.frequency[at], factor * s.residual[at, c], "-", lw=0.9, color=AFTER,
                  label="residual at excited lines")  # fmt: skip
    noise = np.sqrt(d.noise[:, c])
    if np.isfinite(noise).any():
        ax.loglog(d.frequency, factor * noise, ls="--", lw=0.9, color=FLOOR, label="noise")
    ax.set_ylabel(label(name, shown))
