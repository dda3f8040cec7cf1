"""External disturbance: a force or a flow from outside that does not follow the motion."""

from __future__ import annotations

import numpy as np

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import C, Element, I, One, R, Zero
from bondgraph.laws import Law, Onset, Push, Tone
from bondgraph.support.arrays import Array
from bondgraph.support.ops import NUMPY
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion, Signature
from identification.diagnosis.catalogue.starts import law_units
from identification.diagnosis.screening.port_history import FittedModel, PortHistory

PEAKS = 4
"""Frequencies tried: the strongest lines of the residual."""
ONSETS = 24
"""Times tried for a gradual step, evenly over the record."""
SHIFTS = (-6, -3, -1, 0, 2)
"""Samples by which a sudden step may lie before the place where the residual changes."""


class ExternalDisturbance(Effect):
    """A sinusoid of unknown frequency, a step or a push at unknown times, of effort or flow.

    At the 1-junction of an inertia it is a force beside the others. At the 0-junction of a
    storage it is a flow; it appears in the law as the effort that its integral would add.
    """

    name = "external_disturbance"
    family = "outside"
    kind = "exogenous"
    law = "tone_or_onset"
    sentence = "something from outside acts on it in time, whatever the motion is"
    looks = (
        "a line in the residual's spectrum, or a change from one moment on, for good or for a "
        "while, that neither the command nor the motion has"
    )
    confused_with = ("position_periodic_force", "sensor_drift", "sensor_offset", "periodic_error")
    separated_by = (
        "a record without any command: a disturbance stays, everything that follows the motion "
        "is gone"
    )
    source = "disturbance models of Ljung, System Identification, 1999"

    def places(self, graph: BondGraph) -> tuple[Element, ...]:
        """Inertias of a 1-junction, storages of a 0-junction."""
        masses = (e for e in graph.of_type(I) if _beside(graph, e, One))
        stores = (e for e in graph.of_type(C) if e.law is None and _beside(graph, e, Zero))
        return (*masses, *stores)

    def signatures(self, scene: FittedModel, element: Element) -> tuple[Signature, ...]:
        """Sine and cosine at the residual's strongest lines; steps at many times, and a push."""
        past = scene.of(element)
        found = []
        for f in spectral_peaks(scene.residual / scene.data.floor, past.dt, PEAKS):
            turn = 2 * np.pi * f * past.time
            found.append(Signature.of((np.sin(turn), np.cos(turn)), frequency=f))
        spacing = past.dt * past.n / ONSETS
        gradual = [(j * spacing, 0.2 * spacing) for j in range(1, ONSETS)]
        sudden = [
            ((k + shift) * past.dt, 2 * past.dt)
            for k in change_points(scene.residual / scene.data.floor)
            for shift in SHIFTS
        ]
        shapes = [{"time": float(t), "rise": float(rise)} for t, rise in (*gradual, *sudden)]
        if past.added is not None:
            summed = isinstance(element, C)
            begin, end = (k * past.dt for k in while_it_lasts(past.added, summed=summed))
            shapes.append({"time": begin, "end": end, "rise": 2 * past.dt})
        for shape in shapes:
            law = _law(past, shape, isinstance(element, C), "1")
            unit = (1.0, *(p.value for p in law.parameters("x")[1:]), 0.0)
            column = law.deviation(NUMPY, 0.0, (past.time,), unit)
            found.append(Signature(np.asarray(column)[:, None], shape=shape))
        return tuple(found)

    def insert(self, scene: FittedModel, element: Element, hint: Hint | None = None) -> Insertion:
        """Insert a branch (inertia) or a law (storage) that depends on time alone."""
        past, g = scene.of(element), scene.graph
        shape = dict(hint.shape) if hint is not None else {}
        if not shape:
            peaks = spectral_peaks(scene.residual / scene.data.floor, past.dt, 1)
            shape = {"frequency": peaks[0] if peaks else 1.0 / (past.dt * past.n)}
        stores = isinstance(element, C)
        law = _law(past, shape, stores, law_units(element)[0])
        name = element.name if stores else f"outside_{element.name}"
        if stores:
            graph = g.with_element(name, law=law)
        else:
            graph = g.with_branch(g.neighbour(element.name), [R(name, law=law)])
        names = tuple(p.name for p in law.parameters(name))
        strengths = names[:2] if isinstance(law, Tone) else names[:1]
        starts = {} if hint is None else hint.by_name(strengths)
        return self.inserted(element, graph, (starts,), strengths)


def spectral_peaks(residual: Array, dt: float, count: int) -> list[float]:
    """Frequencies of the strongest lines, strongest first, Hz.

    A line is a local maximum of the channels' joint spectrum (Hann window); its frequency is
    refined by the parabola through the logarithm of the three points.

    Parameters
    ----------
    residual : ndarray, shape (N, n_y)
        Over the noise floor, so that channels weigh alike.
    dt : float
        Time between samples, s.
    """
    n = residual.shape[0]
    if n < 8:
        return []
    window = np.hanning(n)[:, None]
    power = np.sum(np.abs(np.fft.rfft((residual - residual.mean(axis=0)) * window, axis=0)) ** 2, 1)
    if not power.any():
        return []
    inner = power[1:-1]
    tops = 1 + np.flatnonzero((inner >= power[:-2]) & (inner > power[2:]))
    tops = tops[np.argsort(power[tops])[::-1][:count]]
    found = []
    for k in tops:
        a, b, c = np.log(np.maximum(power[k - 1 : k + 2], 1e-300))
        bend = a - 2 * b + c
        found.append(float((k + (0.5 * (a - c) / bend if bend < 0 else 0.0)) / (n * dt)))
    return found


def change_points(residual: Array) -> list[int]:
    """Return samples where the residual's level, its power or its roughness changes most.

    Level and power: the split that takes most out of the sum of squares about the two means (Page,
    Biometrika 41 (1954) 100); roughness: the largest second difference; also where a burst begins.
    """
    n = residual.shape[0]
    if n < 16:
        return []
    rough = np.zeros_like(residual)
    rough[1:-1] = np.diff(residual, 2, axis=0)
    found = [_split(residual), _split(residual**2), _split(rough**2)]
    found.append(int(np.argmax(np.sum(rough**2, axis=1))))
    found += [_burst(residual, width) for width in (max(8, n // 200), max(16, n // 30))]
    return sorted(set(found))


def while_it_lasts(course: Array, *, summed: bool = False) -> tuple[float, float]:
    """Return the samples where a push begins and ends that explains most of a course.

    Parameters
    ----------
    course : ndarray, shape (N,)
    summed : bool
        It is the sum of what acts, beside a slope; otherwise it is what acts, beside its mean.
    """
    count = min(course.size, MOMENTS)
    edges = np.linspace(0, course.size, count + 1).astype(np.intp)
    mean = np.add.reduceat(course, edges[:-1]) / np.diff(edges)
    a, b = np.triu_indices(count + 1, 1)
    at = np.arange(count)
    pushes = ((at >= a[:, None]) & (at < b[:, None])).astype(float)
    beside = np.ones((1, count))
    if summed:
        pushes, beside = np.cumsum(pushes, axis=1), np.stack([np.ones(count), at])
    basis = np.linalg.qr(beside.T)[0]
    pushes -= (pushes @ basis) @ basis.T
    power = np.einsum("ij,ij->i", pushes, pushes)
    gain = np.where(power > 1e-9 * power.max(), (pushes @ mean) ** 2 / power.clip(1e-300), 0.0)
    best = int(np.argmax(gain))
    return float(edges[a[best]]), float(edges[b[best]])


MOMENTS = 100
"""Moments at which a push may begin or end at first; the fit moves them."""


def _burst(x: Array, width: int) -> int:
    """Sample after which the power rises most, over `width` samples either side."""
    power = np.concatenate(
        [[0.0], np.cumsum(np.sum((x / x.std(axis=0).clip(1e-300)) ** 2, axis=1))]
    )
    before = power[width:-width] - power[: -2 * width]
    after = power[2 * width :] - power[width:-width]
    floor = 1e-3 * power[-1] * width / x.shape[0] + 1e-300
    return int(width + np.argmax((after + floor) / (before + floor)))


def _split(x: Array) -> int:
    n = x.shape[0]
    k = np.arange(1, n)[:, None]
    total = np.cumsum(x - x.mean(axis=0), axis=0)[:-1]
    spread = np.maximum(x.var(axis=0), 1e-300)
    gain = np.sum(total**2 / (k * (n - k) / n) / spread, axis=1)
    # the ends have few samples on one side, so that chance alone makes them win
    edge = max(2, n // 50)
    return int(edge + np.argmax(gain[edge : n - edge])) + 1


def _law(past: PortHistory, shape: dict[str, float], stores: bool, unit: str) -> Law:
    duration = past.dt * past.n
    if "frequency" in shape:
        return Tone(shape["frequency"], 1 / duration, 0.1 * past.swing, unit, not stores)
    size = 0.1 * past.swing / (duration if stores else 1.0)
    unit = f"{unit}/s" if stores and unit != "1" else unit
    common = (shape["time"], shape["rise"], 1.5 * duration / ONSETS, size, unit, stores, not stores)
    return Push(*common, end=shape["end"]) if "end" in shape else Onset(*common)


def _beside(graph: BondGraph, element: Element, kind: type[Element]) -> bool:
    return isinstance(graph[graph.neighbour(element.name)], kind)
