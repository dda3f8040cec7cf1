"""Figure of a recording to which nothing could be fitted."""

from __future__ import annotations

import numpy as np

from identification.diagnosis.diagnose import Diagnosis
from identification.diagnosis.report.views import level_unit_of
from identification.report.canvas import drawing, label
from identification.report.numbers import axis_scale
from identification.report.style import MEASURED
from identification.report.traces import envelope


def recording_figure(d: Diagnosis) -> str:
    """All channels over time: what there is when nothing can be fitted."""
    names = list(d.recording.channels)[:8]
    with drawing("recording", 0.4 + 1.2 * len(names), 6.6) as canvas:
        axes = canvas.rows(len(names))[:, 0]
        for ax, name in zip(axes, names, strict=True):
            y = np.asarray(d.recording[name])
            factor, unit = axis_scale(level_unit_of(d, name), float(np.abs(y).max(initial=0.0)))
            t, v = envelope(np.asarray(d.recording.time), factor * y)
            ax.plot(t, v, color=MEASURED, lw=0.9)
            ax.set_ylabel(label(name, unit))
        axes[-1].set_xlabel("time (s)")
    return canvas.svg
