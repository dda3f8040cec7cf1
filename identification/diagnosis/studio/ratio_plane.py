"""The plane of a ratio that changes: over what it changes with, as a user needs it."""

from __future__ import annotations

from typing import Any

import numpy as np
import sympy as sp

from bondgraph.support.arrays import Array
from identification.diagnosis.catalogue.places import modulated_ratio
from identification.diagnosis.catalogue.transduction.nonlinear_ratio import (
    current_of_two_port,
    way_of_two_port,
)
from identification.diagnosis.diagnose import Diagnosis
from identification.diagnosis.explanation.law_formula import signal_words
from identification.diagnosis.screening.observation import filled
from identification.diagnosis.screening.port_history import FittedModel
from identification.diagnosis.screening.port_response import Probes
from identification.diagnosis.search.candidates import Candidate
from identification.diagnosis.studio.packing import packed
from identification.diagnosis.verdict.document import as_repaired
from identification.estimation.single_record import Fit
from identification.report.numbers import axis_scale
from identification.report.words import spaced

SMOOTH = 200
"""Points of the law over its range."""
PARTS = 4
"""Stretches of the recording, each of which tells the ratio by itself."""
PIECES = 8
"""Pieces of the way, in each of which the ratio is a straight line."""
WIDEST = 0.3
"""Change of a ratio, over itself, that is expected before anything is recorded."""
KNOWN = 0.1
"""Standard error of a change from which no point is drawn."""
POINTS = (
    " Points: what each quarter of the recording asks for by itself, in straight pieces, no law "
    "assumed; their level is that of the law."
)
"""What is said of the points of a ratio."""


def changed_ratio(d: Diagnosis, name: str) -> Candidate | None:
    """Return the changing ratio that was named at a two-port, with its last numbers."""
    for t in (s.chosen for s in d.findings):
        if t is None or t.element != name:
            continue
        own = modulated_ratio(t.fit.problem.graph.elements.get(name))
        if own is not None and {*map(str, own.free_symbols)} & {*t.insertion.strengths}:
            return as_repaired(t, d)
    return None


def ratio_plane(
    d: Diagnosis, t: Candidate, probed: Probes, basis: Array, known: Array, at: Array
) -> dict[str, Any]:
    """Return the ratio over the way or the current that it changes with, and that of the model.

    Parameters
    ----------
    probed : Probes
        Of the model as it is.
    basis : ndarray, shape (N n_y, rank)
        Orthonormal columns of what the parameters do to all readings.
    known : ndarray of bool, shape (N,)
        Samples that are looked at.
    at : ndarray of int
        Those that have a point.
    """
    assert d.scene is not None
    graph, name = t.fit.problem.graph, t.element
    ratio = modulated_ratio(graph[name])
    assert ratio is not None
    centre, span = (graph.parameters[f"{n}_{name}"] for n in ("centre", "span"))
    (signal,) = (s for s in ratio.free_symbols if str(s) not in graph.parameters)
    x = np.linspace(centre.value - span.value, centre.value + span.value, SMOOTH)
    y = _over(ratio, t.fit, signal, x)
    nominal = _over(d.scene.graph.coefficient(d.scene.graph[name]), d.scene.nominal, signal, x)
    unit = getattr(graph[name], "unit", "")
    fx, ux = axis_scale(span.unit if span.unit != "1" else "", float(np.abs(x).max()))
    fy, uy = axis_scale(unit, float(np.abs(y).max()))
    what, z = signal_words(graph, str(signal)), _argument(d.scene, name, str(signal))
    own = float(np.mean(nominal)) * (1.0 + _change(d.scene, probed, basis, known, name, z))
    seen = np.isfinite(own[at])
    level = np.mean(_over(ratio, t.fit, signal, z[at]) - own[at], where=seen) if seen.any() else 0.0
    return {
        "x": packed(fx * np.where(seen, z[at], np.nan)),
        "y": packed(fy * (own[at] + level)),
        "power": packed(np.zeros(at.size)),
        "xLabel": f"{what} ({ux})" if ux else what,
        "yLabel": f"ratio of {name} ({uy})" if uy else f"ratio of {name}",
        "open": POINTS,
        "nominal": {"x": packed(fx * x), "y": packed(fy * nominal)},
        "laws": [{"label": spaced(t.effect), "on": True, "x": packed(fx * x), "y": packed(fy * y)}],
    }


def _over(ratio: sp.Expr, fit: Fit, signal: sp.Symbol, x: Array) -> Array:
    """Return a ratio at the values of a fit, along `x`."""
    parameters = fit.problem.graph.parameters
    known = {n: p.value for n, p in parameters.items()} | dict(fit.values)
    own = ratio.subs({s: known[str(s)] for s in ratio.free_symbols if str(s) in known})
    return np.asarray(sp.lambdify(signal, own, "numpy")(x) + np.zeros(x.size))


def _argument(scene: FittedModel, name: str, signal: str) -> Array:
    """Return what a ratio changes with, along the model as it is."""
    past, store = scene.past[name], signal.removeprefix("q_")
    if store == signal:
        return current_of_two_port(past)
    return scene.past[store].argument if store in scene.past else way_of_two_port(past)


def _change(
    scene: FittedModel, probed: Probes, basis: Array, known: Array, name: str, z: Array
) -> Array:
    """Return the change of a ratio over itself that the residual asks for, shape (N,).

    A straight line in each piece of the way, by least squares in each stretch of the recording for
    itself; the mean is open. NaN where it is hardly known.
    """
    data, past = scene.data, scene.past[name]
    if not probed.knows(name):
        return np.full(z.size, np.nan)
    knots = np.linspace(z.min(), z.max(), PIECES + 1)
    hats = np.stack([np.interp(z, knots, one) for one in np.eye(knots.size)], axis=1)
    parts = np.array_split(np.flatnonzero(known), PARTS)
    columns = np.zeros((z.size, PARTS * knots.size))
    for k, rows in enumerate(parts):
        columns[rows[0] : rows[-1] + 1, k * knots.size : (k + 1) * knots.size] = hats[
            rows[0] : rows[-1] + 1
        ]
    asked = columns - columns[known].mean(axis=0)  # a constant is the ratio's own value
    answer = probed.respond(name, asked * past.argument[:, None], asked * past.output[:, None])
    weight = known[:, None] / data.floor
    rows = (answer * weight[:, :, None]).reshape(-1, columns.shape[1])
    left = ((data.readings - filled(scene.nominal.simulated)) * weight).ravel()
    rows, left = rows - basis @ (basis.T @ rows), left - basis @ (basis.T @ left)
    spread = np.linalg.inv(rows.T @ rows + np.eye(columns.shape[1]) / WIDEST**2)
    sure = np.sqrt(np.diag(spread)) < KNOWN
    change = columns @ (spread @ (rows.T @ left))
    return np.where(((columns != 0) & ~sure).any(axis=1) | ~known, np.nan, change)
