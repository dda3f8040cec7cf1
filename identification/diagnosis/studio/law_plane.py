"""The law plane of every element: what it must do, recovered from the recording, no law assumed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any

import numpy as np
from scipy.integrate import cumulative_trapezoid

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import C, I, Source, TwoPort
from bondgraph.graph.sensors import Sensor
from bondgraph.laws import Overflow
from bondgraph.signals.split import Split, stretches
from bondgraph.support.arrays import Array
from identification.diagnosis.catalogue.places import law_of, sense
from identification.diagnosis.diagnose import Diagnosis
from identification.diagnosis.explanation.law_formula import variable_names
from identification.diagnosis.explanation.recovered import NO_POINTS, lost, recovered
from identification.diagnosis.localisation.recording.variables import (
    two_port_variables,
    variables_of,
)
from identification.diagnosis.report.law import path
from identification.diagnosis.report.law_figures import many_valued
from identification.diagnosis.screening.port_history import FittedModel, PortHistory
from identification.diagnosis.screening.port_response import Probes, probes
from identification.diagnosis.screening.tangent_space import freedom
from identification.diagnosis.search.candidates import Candidate
from identification.diagnosis.studio.beside_repair import beside_repair
from identification.diagnosis.studio.lacking_plane import lacking_plane
from identification.diagnosis.studio.packing import packed, typical
from identification.diagnosis.studio.ratio_plane import changed_ratio, ratio_plane
from identification.diagnosis.studio.turns_plane import repeating, turned_plane
from identification.estimation.single_record import Fit
from identification.report.numbers import axis_scale, unit_of_level
from identification.report.words import spaced
from identification.study.data import Data

POINTS = 4000
"""Points of a plane at most."""
LAWS = 6
"""Laws drawn in a plane at most, the best first."""
LINE = 1200
OPEN: Mapping[tuple[int, ...], str] = MappingProxyType(
    {
        (): "",
        (0,): " Its level is not known; that of the model as it is, fitted, is drawn.",
        (1,): " Its mean slope is not known; that of the model as it is, fitted, is drawn.",
        (0, 1): " Level and mean slope are not known; those of the model as it is, fitted, are "
        "drawn.",
    }
)
"""What is said of the powers of the argument that the parameters can stand for."""
REPAIRED = " All other values are those of the repaired model, and so is the way."
"""What is said of points beside a repair."""
LEVELLED = (
    " The law of the model as it is, fitted, is drawn at the level of the points: an offset of a "
    "reading has taken over the rest."
)
"""What is said of a straight law whose level the readings' offsets have changed."""
SPILLED = " The content counts what has flowed in, what was spilled with it."
"""What is said of a store with a rim."""
SWALLOWED = 0.05
"""Part of the swing of the points by which an offset has moved a law that is drawn without it."""
UNKNOWN = 0.01
"""Part of a power of the argument that the parameters may leave of it, to stand for it."""


def planes(d: Diagnosis, share: float = 1.0) -> dict[str, Any]:
    """Return the times of the points and, by element, argument, recovered output and laws.

    The missing addition is rebuilt at one element at a time, as if it sat there alone, from the
    residual of the fit of the model as it is (`explanation.recovered`). What the parameters of
    that fit imitate is not in it, such as a level beside a free offset of the reading: laws are
    drawn without it, too. Where one law was named, its repair knows the parameters
    (`beside_repair`). A plane whose law is not seen in what was rebuilt has no points.
    """
    if d.scene is None:
        return {"time": packed([], "<f8"), "of": {}}
    scene, probed = d.scene, probes(d.scene.nominal)
    # the search sees less than the page may show
    data = d.data if d.data is not None and d.data.n == scene.data.n else scene.data
    tangents = freedom(_over_all(scene.nominal, data))
    scored = data.mask("train") | data.mask("held-out")
    known = scored & np.isfinite(scene.nominal.simulated).all(axis=1)
    at = np.flatnonzero(known)
    at = at[:: max(1, -(-at.size // round(share * POINTS)))]
    line = round(share * LINE)
    basis = _basis(known[:, None, None] * tangents / scene.data.floor[:, None])
    found: dict[str, Any] = {}
    for name, past in scene.past.items():
        if name not in d.graph.elements or not np.ptp(past.argument[known]) > 0:
            continue
        past = _inwards(d.graph, name, past)
        if (ratio := changed_ratio(d, name)) is not None:
            found[name] = ratio_plane(d, ratio, probed, basis, known, at)
            continue
        if (lacking := lacking_plane(d, name, known, at, line)) is not None:
            found[name] = lacking
            continue
        if (own := beside_repair(d, name, known)) is not None:
            shown = replace(past, argument=own.argument, output=own.output - own.added)
            points = (data.time[known], own.argument[known], own.output[known])
            free = _imitated(scene, probed, basis, known, name)
            found[name] = _plane(d, name, shown, own.added, at, points, free, line, past)
            continue
        signal = recovered(d, probed, tangents, known, name)
        if signal is None:
            continue
        added = signal.signal
        if _bends_flux(d, name):
            found[name] = _flux_plane(d, name, past, added, known, at, line)
            continue
        if (turning := repeating(d, name, past)) is not None:
            found[name] = turned_plane(d, name, past, added, known, at, turning)
            continue
        free = _imitated(scene, probed, basis, known, name)
        points = (data.time[known], past.argument[known], (past.output + added)[known])
        found[name] = _plane(d, name, past, added, at, points, free, line)
    return {"time": packed(data.time[at], "<f8"), "of": found}


def _inwards(graph: BondGraph, name: str, past: PortHistory) -> PortHistory:
    """Return a past whose flow is that into the element, as its law counts it."""
    return past if sense(graph, graph[name]) > 0 else replace(past, argument=-past.argument)


def _over_all(fit: Fit, data: Data) -> Fit:
    """Return a fit that knows all samples of `data` as training or test."""
    split = data.split
    rest = (*stretches(split.test), *stretches(split.looked_at))
    whole = replace(data, split=Split(split.train, rest, split.rule))
    return replace(fit, problem=replace(fit.problem, data=whole))


def _basis(tangents: Array) -> Array:
    """Orthonormal columns of what the parameters do to all readings, shape (N n_y, rank)."""
    flat = tangents.reshape(-1, tangents.shape[2])
    size = np.linalg.norm(flat, axis=0)
    if not np.isfinite(size).all():
        return flat[:, :0]
    u, s, _ = np.linalg.svd(flat[:, size > 0] / size[size > 0], full_matrices=False)
    return np.asarray(u[:, s > 1e-8 * s.max(initial=0.0)])


def _imitated(
    scene: FittedModel, probed: Probes, basis: Array, known: Array, name: str
) -> tuple[int, ...]:
    """Return the powers of the argument, 0 and 1, that the parameters of the fit can stand for."""
    columns = np.column_stack([np.ones(scene.data.n), scene.past[name].argument])
    asked = known[:, None, None] * probed.respond(name, columns) / scene.data.floor[:, None]
    asked = asked.reshape(-1, 2)
    whole = np.sum(asked**2, axis=0)
    left = whole - np.sum((basis.T @ asked) ** 2, axis=0)
    return tuple(int(i) for i in np.flatnonzero(left < UNKNOWN * whole))


def _plane(
    d: Diagnosis,
    name: str,
    past: PortHistory,
    added: Array,
    at: Array,
    points: tuple[Array, Array, Array],
    free: tuple[int, ...],
    most: int,
    nominal: PortHistory | None = None,
) -> dict[str, Any]:
    """Return one plane in readable units, its lines of `most` points.

    `nominal` has the law of the model as it is where points are those of the repair.
    """
    x, xu, yu, xw, yw = _axes(d.graph, name, past)
    if isinstance(d.graph[name], Source | Sensor):
        read = d.recording.read_in.get(name, "")
        xu, yu = unit_of_level(xu, read), unit_of_level(yu, read)
    plain, straight = (x, past.output) if nominal is None else (nominal.argument, nominal.output)
    y = past.output + added
    known = nominal is not None
    said = REPAIRED if known else OPEN[free]
    if known and 0 in free:
        gap = float(np.nanmean(y[at]) - np.nanmean(straight[at]))
        if abs(gap) > SWALLOWED * float(np.ptp(y[at])):
            straight, said = straight + gap, said + LEVELLED
    said += SPILLED * _spills(d, name)
    laws = [] if isinstance(d.graph[name], I) else _laws(d, name, points, free, most, known)
    fx, ux = axis_scale(xu, float(np.nanmax(np.abs(x[typical(x)]), initial=0.0)))
    fy, uy = axis_scale(yu, float(np.nanmax(np.abs(y[typical(y)]), initial=0.0)))
    line = _stretch(at.size, most)
    own = next(((s, w) for _, on, s, w in laws if on), None)
    no_points = own is not None and lost(_bend(x[at], y[at]), _bend(*own))
    shown = at[:0] if no_points else at
    return {
        "x": packed(fx * x[shown]),
        "y": packed(fy * y[shown]),
        "power": packed((added * _flow(d.graph, name, past))[shown]),
        "xLabel": f"{xw} ({ux})" if ux else xw,
        "yLabel": f"{yw} ({uy})" if uy else yw,
        "open": NO_POINTS if no_points else said,
        "nominal": {"x": packed(fx * plain[at][line]), "y": packed(fy * straight[at][line])},
        "laws": [
            {"label": label, "on": on, "x": packed(fx * s), "y": packed(fy * w)}
            for label, on, s, w in laws
        ],
    }  # fmt: skip


def _spills(d: Diagnosis, name: str) -> bool:
    chosen = [s.chosen for s in d.findings if s.chosen and s.chosen.element == name]
    graphs = (d.graph, *(t.fit.problem.graph for t in chosen))
    return any(isinstance(law_of(g[name]), Overflow) for g in graphs)


def _bend(x: Array, y: Array) -> Array:
    """Return what a path adds to its straight line."""
    powers = np.column_stack([np.ones(x.size), x / (np.abs(x).max(initial=0.0) or 1.0)])
    return np.asarray(y - powers @ np.linalg.lstsq(powers, y, rcond=None)[0])


def _bends_flux(d: Diagnosis, name: str) -> bool:
    """Whether a law of the momentum of an inertia was tried, such as iron that saturates."""
    tried = [*d.trials, *(t for s in d.steps for t in (*s.possible, *s.same_place))]
    graphs = (t.fit.problem.graph for t in tried if t.element == name)
    return isinstance(d.graph[name], I) and any(law_of(g[name]) is not None for g in graphs)


def _flux_plane(
    d: Diagnosis, name: str, past: PortHistory, added: Array, known: Array, at: Array, most: int
) -> dict[str, Any]:
    """Return the plane of an inertia: flow over momentum, which its effort only tells the rate of.

    The recovered momentum is the integral of the recovered effort; level and slope of what is
    missing in time, and its mean slope over the flow, are not known.
    """
    assert d.data is not None
    v, flow, time = variables_of(d.graph[name]), past.argument, past.time
    straight = _inertance(past) * flow
    more = cumulative_trapezoid(np.where(known, added, 0.0), dx=past.dt, initial=0.0)
    momentum = straight + more - np.polyval(np.polyfit(time[known], more[known], 1), time)
    laws = _laws(d, name, (d.data.time[known], flow[known], momentum[known]), (0, 1), most)
    fx, ux = axis_scale(v.momentum_unit, float(np.nanmax(np.abs(momentum))))
    fy, uy = axis_scale(v.flow_unit, float(np.nanmax(np.abs(flow))))
    line = _stretch(at.size, most)
    return {
        "x": packed(fx * momentum[at]),
        "y": packed(fy * flow[at]),
        "power": packed((added * flow)[at]),
        "xLabel": f"{v.momentum} of {name} ({ux})" if ux else f"{v.momentum} of {name}",
        "yLabel": f"{v.flow} ({uy})" if uy else v.flow,
        "open": OPEN[0, 1],
        "nominal": {"x": packed(fx * straight[at][line]), "y": packed(fy * flow[at][line])},
        "laws": [
            {"label": label, "on": on, "x": packed(fx * p), "y": packed(fy * f)}
            for label, on, f, p in laws
        ],
    }  # fmt: skip


def _inertance(past: PortHistory) -> float:
    """Effort of the model as it is over the rate of its flow."""
    square = float(past.rate @ past.rate)
    return float(past.rate @ past.output) / square if square else 0.0


def _axes(graph: BondGraph, name: str, past: PortHistory) -> tuple[Array, str, str, str, str]:
    """Argument of the law with units and words; an inertia's is the rate of its flow."""
    e = graph[name]
    if isinstance(e, TwoPort):
        return past.argument, *two_port_variables(graph, e)
    xu, yu, xw, yw = variable_names(graph, name)
    if isinstance(e, I):
        # the effort of the model as it is says the rate better than a difference of samples
        inertance = _inertance(past)
        rate = past.output / inertance if inertance else past.rate
        return rate, f"{xu}/s" if xu else "", yu, f"rate of the {xw}", yw
    return past.argument, xu, yu, xw, yw


def _flow(graph: BondGraph, name: str, past: PortHistory) -> Array:
    """Flow through an element whose effort the addition belongs to; none at sources and sensors."""
    e = graph[name]
    if isinstance(e, Source | Sensor):
        return np.zeros(past.n)
    return past.rate if isinstance(e, C) else past.argument


def _laws(
    d: Diagnosis,
    name: str,
    points: tuple[Array, Array, Array],
    free: tuple[int, ...],
    most: int,
    known: bool = False,
) -> list[tuple[str, bool, Array, Array]]:
    """Laws fitted at an element, those that are still in the set switched on.

    Less the part by the `free` powers of the argument that the `points` (time, argument, output)
    leave open; where both are, the argument has the level and the scale of the points: the fit of
    the law has its own, and neither is known. Where the points are `known`, the named law is as
    it is.
    """
    found: list[tuple[str, bool, Array, Array]] = []
    named = {s.chosen.label for s in d.findings if s.chosen is not None} if known else set()
    inside = {t.label for s in d.steps for t in (*s.possible, *s.same_place)}
    best: dict[str, Candidate] = {}
    for t in (*(t for s in d.steps for t in (*s.possible, *s.same_place)), *d.trials):
        if t.element == name and np.isfinite(t.test):
            best.setdefault(t.label, t)
    for t in sorted(best.values(), key=lambda t: (t.label not in inside, t.test))[:LAWS]:
        run = path(t)
        if run is None:
            continue
        argument, output = run.argument, run.slope * run.argument + run.deviation
        if isinstance(d.graph[name], I):  # told as the momentum over the flow
            argument, output = output, argument
        apart = () if t.label in named else free
        if apart == (0, 1):
            there = np.interp(run.time, *points[:2])
            line = np.column_stack([np.ones(argument.size), argument / np.abs(argument).max()])
            argument = line @ np.linalg.lstsq(line, there, rcond=None)[0]
        if apart:
            powers = argument[:, None] ** np.array(apart)
            powers = powers / (np.abs(powers).max(axis=0) + 1e-300)
            missing = np.interp(run.time, points[0], points[2]) - output
            output = output + powers @ np.linalg.lstsq(powers, missing, rcond=None)[0]
        one = not many_valued(run)
        order = np.argsort(argument, kind="stable") if one else np.arange(argument.size)
        part = order[:: -(-order.size // most)] if one else order[_stretch(order.size, most)]
        word = "flexible curve" if t.effect == "unknown" else spaced(t.effect)
        found.append((word, t.label in inside, argument[part], output[part]))
    return found


def _stretch(n: int, most: int) -> slice:
    """Part of a path of `n` samples to draw as a line: the end, hardly thinned, loops whole."""
    step = max(1, -(-n // 2 // most))
    return slice(-most * step, None, step)
