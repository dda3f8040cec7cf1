"""What was found over time, drawn: drift or step response; a law stands in the studio."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from bondgraph.support.arrays import Array
from identification.diagnosis.diagnose import Diagnosis
from identification.diagnosis.localisation.recording.variables import variables_of
from identification.diagnosis.report.law import LawPath, path
from identification.diagnosis.report.views import unit_of
from identification.diagnosis.search.candidates import Candidate
from identification.report.canvas import TILE, drawing, label, logarithmic, plain
from identification.report.numbers import axis_scale
from identification.report.style import AFTER, BEFORE, FLOOR, MUTED

MEMORY = 0.05
"""Part of the variance that must remain at one argument for a loop to be drawn."""


def law_figure(d: Diagnosis, trial: Candidate) -> tuple[str, str]:
    """Return figure and caption of `trial`: of a law words alone, else empty without a figure."""
    if trial.effect == "sensor_drift":
        return _drift(d, trial)
    if trial.effect == "creep":
        return _creep(trial)
    if trial.effect in ("low_pass", "sensor_lag", "delay"):
        return _step(trial)
    found = path(trial)
    return "", "" if found is None else _said(found)


def many_valued(p: LawPath, bins: int = 60) -> bool:
    """Whether the deviation takes clearly different values at the same argument: memory."""
    span = float(np.ptp(p.argument)) or 1.0
    index = np.minimum((bins * (p.argument - p.argument.min()) / span).astype(int), bins - 1)
    count = np.maximum(np.bincount(index, minlength=bins), 1)
    mean = np.bincount(index, p.deviation, bins) / count
    inside = np.sort(np.bincount(index, (p.deviation - mean[index]) ** 2, bins))
    # a law that jumps, or sticks where it does, is of many values in one bin or its neighbour
    return float(inside[:-2].sum()) > MEMORY * p.argument.size * float(np.var(p.deviation))


def _said(p: LawPath) -> str:
    """Say what the law plane shows of a law."""
    where = "Its argument and output are those of the fitted model along the recording."
    if not many_valued(p):
        return f"The law plane above shows the curve over the range that was visited. {where}"
    s, whole = p.argument, p.slope * p.argument + p.deviation
    off = whole - np.polyval(np.polyfit(s, whole, 1), s)
    width = float(np.ptp(off)) / max(float(np.ptp(whole)), 1e-300)
    return (
        f"Rising and falling branches part: the loop in the law plane above is {100 * width:.3g} % "
        f"of the full swing high. {where}"
    )


def _drift(d: Diagnosis, trial: Candidate) -> tuple[str, str]:
    f = trial.fit
    time = f.problem.data.time
    ramp = np.linspace(0.0, 1.0, time.size)
    drift = sum(
        (f.values.get(f"drift_{j}_{trial.element}", 0.0) * ramp**j for j in (1, 2)),
        np.zeros_like(ramp),
    )
    factor, unit = axis_scale(unit_of(d, trial.element), float(np.abs(drift).max(initial=0.0)))
    step = max(1, ramp.size // 400)
    with drawing("law", 2.4, TILE) as canvas:
        ax = canvas.ax
        ax.plot(time[::step], factor * drift[::step], color=AFTER, lw=1.8)
        ax.axhline(0.0, color=MUTED, lw=0.8)
        ax.set_xlabel("time (s)")
        ax.set_ylabel(label(f"drift of {trial.element}", unit))
    return canvas.svg, "What the sensor adds to its reading as time goes on, whatever is measured."


def _creep(trial: Candidate) -> tuple[str, str]:
    """Response to a step of effort."""
    v, name = trial.fit.values, trial.element
    shares = {j: v[f"creep_{j}_{name}"] for j in range(1, 10) if f"creep_{j}_{name}" in v}
    times = {j: v[f"tau_{j}_{name}"] for j in shares if f"tau_{j}_{name}" in v}
    ends = 0.1 * min(times.values(), default=1.0), 3 * max(times.values(), default=1.0)
    t = np.geomspace(*ends, 400)
    y = 1 + sum((shares[j] * -np.expm1(-t / tau) for j, tau in times.items()), np.zeros_like(t))

    def modelled(ax: Any, _: float) -> None:
        ax.axhline(1.0, color=BEFORE, ls="--", label="as modelled")
        ax.set_xscale("log")
        logarithmic(ax.xaxis)

    of = variables_of(trial.fit.problem.graph[name])
    what = f"The {of.displacement} under a constant {of.effort}, over its first value: it grows on."
    drawn = _response(t, y, [*times.values()], f"yield of {name} after a step", modelled)
    return drawn, f"{what} Dotted lines: the fitted times."


def _step(trial: Candidate) -> tuple[str, str]:
    """Response to a unit step of what was found."""
    late = trial.effect == "delay"
    tau = trial.fit.values.get(f"{'delay' if late else 'tau'}_{trial.element}", 0.0)
    if not tau > 0:
        return "", ""
    t = np.linspace(-0.5, 5, 600) * tau
    lagged = np.where(t > 0, -np.expm1(-np.maximum(t, 0) / tau), 0.0)

    def modelled(ax: Any, f: float) -> None:
        ax.plot(f * t, t >= 0, color=BEFORE, ls="--", label="as modelled", drawstyle="steps")

    y = (t >= tau).astype(float) if late else lagged
    drawn = _response(t, y, [tau], "response to a unit step", modelled)
    what = "the same, later" if late else "a first-order lag"
    return drawn, f"The response to a unit step: {what}. Dotted lines: the fitted times."


def _response(
    t: Array, y: Array, marks: list[float], word: str, modelled: Callable[[Any, float], None]
) -> str:
    factor, unit = axis_scale("s", float(t.max()))
    with drawing("law", 2.4, TILE) as canvas:
        ax = canvas.ax
        modelled(ax, factor)
        ax.plot(factor * t, y, color=AFTER, lw=1.8, label="as found")
        for tau in marks:
            ax.axvline(factor * tau, color=FLOOR, lw=0.8, ls=":")
        ax.set_xlabel(label("time after the step", unit))
        ax.set_ylabel(plain(word))
        ax.legend(loc="lower right")
    return canvas.svg
