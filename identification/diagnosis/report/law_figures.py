"""Figures of the law that was found: loop, curve, drift or step response."""

from __future__ import annotations

from typing import Any

import numpy as np

from identification.diagnosis.diagnose import Diagnosis
from identification.diagnosis.report.canvas import TILE, drawing, label, logarithmic, plain
from identification.diagnosis.report.law import LawPath, path
from identification.diagnosis.report.numbers import axis_scale
from identification.diagnosis.report.style import AFTER, BEFORE, FLOOR, MUTED
from identification.diagnosis.report.views import unit_of
from identification.diagnosis.search.candidates import Candidate

Array = np.ndarray
MOST = 1500
HEIGHT = 2.7
MEMORY = 0.05
"""Part of the variance that must remain at one argument for a loop to be drawn."""


def law_figure(d: Diagnosis, trial: Candidate) -> tuple[str, str]:
    """Return figure and caption of the law of `trial`; empty when there is nothing to draw."""
    if trial.effect == "sensor_drift":
        return _drift(d, trial)
    if trial.effect in ("low_pass", "sensor_lag", "creep", "delay"):
        return _step(trial)
    found = path(trial)
    if found is None:
        return "", ""
    return _loop(found) if _many_valued(found) else _curve(found)


def _many_valued(p: LawPath, bins: int = 60) -> bool:
    """Whether the deviation takes clearly different values at the same argument: memory."""
    span = float(np.ptp(p.argument)) or 1.0
    index = np.minimum((bins * (p.argument - p.argument.min()) / span).astype(int), bins - 1)
    count = np.maximum(np.bincount(index, minlength=bins), 1)
    mean = np.bincount(index, p.deviation, bins) / count
    inside = float(np.mean((p.deviation - mean[index]) ** 2))
    return inside > MEMORY * float(np.var(p.deviation))


def _loop(p: LawPath) -> tuple[str, str]:
    step = max(1, -(-p.argument.size // 2 // MOST))
    s, w = p.argument[-MOST * step :: step], p.deviation[-MOST * step :: step]
    fs, us = axis_scale(p.argument_unit, float(np.abs(s).max()))
    whole = p.slope * s + w
    fy, uy = axis_scale(p.output_unit, float(np.abs(whole).max()))
    gain, base = np.polyfit(s, whole, 1)
    off = whole - (gain * s + base)
    fw, uw = axis_scale(p.output_unit, float(np.abs(off).max()))
    with drawing("law", HEIGHT, TILE) as first:
        ax = first.rows(1)[0, 0]
        ax.plot(fs * s, fy * whole, color=AFTER, lw=0.9, label="found law")
        ends = np.array([s.min(), s.max()])
        ax.plot(
            fs * ends, fy * (gain * ends + base), color=BEFORE, ls="--", lw=1.1,
            label="best straight line",
        )  # fmt: skip
        ax.set_title("the loop")
        _name(ax, p, us, uy)
        ax.legend(loc="upper left")
    with drawing("law-rest", HEIGHT, TILE) as second:
        ax = second.rows(1)[0, 0]
        ax.plot(fs * s, fw * off, color=AFTER, lw=0.9)
        ax.axhline(0.0, color=BEFORE, ls="--", lw=1.1)
        ax.set_title("less the straight line")
        _name(ax, p, us, uw)
    width = float(np.ptp(off)) / max(float(np.ptp(whole)), 1e-300)
    caption = (
        f"Rising and falling branches part: the loop is {100 * width:.3g} % of the full swing "
        "high. The argument and the output are those of the fitted model along the recording."
    )
    return first.svg + second.svg, caption


def _curve(p: LawPath) -> tuple[str, str]:
    order = np.argsort(p.argument, kind="stable")
    s, w = p.argument[order], p.deviation[order]
    step = max(1, -(-s.size // MOST))
    s, w = s[::step], w[::step]
    fs, us = axis_scale(p.argument_unit, float(np.abs(s).max()))
    whole = p.slope * s + w
    fy, uy = axis_scale(p.output_unit, float(np.abs(whole).max()))
    fw, uw = axis_scale(p.output_unit, float(np.abs(w).max()))
    with drawing("law", HEIGHT, TILE) as first:
        ax = first.rows(1)[0, 0]
        ax.plot(fs * s, fy * p.slope * s, color=BEFORE, ls="--", label="its straight line")
        ax.plot(fs * s, fy * whole, color=AFTER, label="found law")
        ax.set_title("the law")
        _name(ax, p, us, uy)
        ax.legend(loc="upper left")
    with drawing("law-rest", HEIGHT, TILE) as second:
        ax = second.rows(1)[0, 0]
        ax.plot(fs * s, fw * w, ".", ms=3, color=AFTER, alpha=0.5, mew=0)
        ax.plot(fs * s, fw * w, color=AFTER, lw=0.8)
        ax.axhline(0.0, color=BEFORE, ls="--", lw=1.1)
        ax.set_title("less its straight line")
        _name(ax, p, us, uw)
    return first.svg + second.svg, (
        "The curve over the range that the recording visited; points are where the model went."
    )


def _name(ax: Any, p: LawPath, argument_unit: str, output_unit: str) -> None:
    ax.set_xlabel(label(p.argument_word, argument_unit))
    ax.set_ylabel(label(p.output_word, output_unit))


def _drift(d: Diagnosis, trial: Candidate) -> tuple[str, str]:
    f = trial.fit
    ramp = np.linspace(0.0, 1.0, f.problem.data.n)
    drift = sum(
        (f.values.get(f"drift_{j}_{trial.element}", 0.0) * ramp**j for j in (1, 2)),
        np.zeros_like(ramp),
    )
    factor, unit = axis_scale(unit_of(d, trial.element), float(np.abs(drift).max(initial=0.0)))
    step = max(1, ramp.size // 400)
    with drawing("law", 2.4, TILE) as canvas:
        ax = canvas.rows(1)[0, 0]
        ax.plot(f.problem.data.time[::step], factor * drift[::step], color=AFTER, lw=1.8)
        ax.axhline(0.0, color=MUTED, lw=0.8)
        ax.set_xlabel("time (s)")
        ax.set_ylabel(label(f"drift of {trial.element}", unit))
    return canvas.svg, "What the sensor adds to its reading as time goes on, whatever is measured."


def _step(trial: Candidate) -> tuple[str, str]:
    """Response to a unit step of what was found."""
    v, name = trial.fit.values, trial.element
    if trial.effect == "creep":
        pairs = [
            (v[f"creep_{j}_{name}"], v[f"tau_{j}_{name}"])
            for j in range(1, 10)
            if f"creep_{j}_{name}" in v and f"tau_{j}_{name}" in v
        ]
        longest = max((tau for _, tau in pairs), default=1.0)
        t = np.geomspace(0.1 * min((tau for _, tau in pairs), default=1.0), 3 * longest, 400)
        y = 1 + sum((a * -np.expm1(-t / tau) for a, tau in pairs), np.zeros_like(t))
        marks = [tau for _, tau in pairs]
        what = "The displacement under a constant effort, over its first value: it keeps growing."
        word = f"yield of {name} after a step"
    else:
        key = f"delay_{name}" if trial.effect == "delay" else f"tau_{name}"
        tau = v.get(key, 0.0)
        if not tau > 0:
            return "", ""
        t = np.linspace(-0.5, 5, 600) * tau
        late = trial.effect == "delay"
        y = (
            (t >= tau).astype(float)
            if late
            else np.where(t > 0, -np.expm1(-np.maximum(t, 0) / tau), 0.0)
        )
        marks = [tau]
        what = "The response to a unit step" + (
            ": the same, later." if late else ": a first-order lag."
        )
        word = "response to a unit step"
    factor, unit = axis_scale("s", float(t.max()))
    with drawing("law", 2.4, TILE) as canvas:
        ax = canvas.rows(1)[0, 0]
        if trial.effect != "creep":
            ax.plot(
                factor * t, t >= 0, color=BEFORE, ls="--", label="as modelled", drawstyle="steps"
            )
        else:
            ax.axhline(1.0, color=BEFORE, ls="--", label="as modelled")
            ax.set_xscale("log")
            logarithmic(ax.xaxis)
        ax.plot(factor * t, y, color=AFTER, lw=1.8, label="as found")
        for tau in marks:
            ax.axvline(factor * tau, color=FLOOR, lw=0.8, ls=":")
        ax.set_xlabel(label("time after the step", unit))
        ax.set_ylabel(plain(word))
        ax.legend(loc="lower right")
    return canvas.svg, what + " Dotted lines: the fitted times."
