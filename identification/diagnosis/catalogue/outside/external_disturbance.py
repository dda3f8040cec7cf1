"""External disturbance: a force or a flow from outside that does not follow the motion."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import C, Element, I, One, R, Zero
from bondgraph.laws import Law, Onset, Push, Tone
from bondgraph.support.arrays import Array
from identification.diagnosis.catalogue.effect import Effect
from identification.diagnosis.catalogue.site import Site, Values
from identification.diagnosis.catalogue.starts import law_units
from identification.diagnosis.screening.port_history import FittedModel

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
    laws = (Tone, Onset, Push)
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

    weights = ("a", "b", "h")
    rebalances = False

    def grid(self, at: Site) -> Sequence[Values]:
        """Return the residual's strongest lines, steps at many times, and a push."""
        dt, residual = at.past.dt, at.scene.residual / at.scene.data.floor
        lines = [{"frequency": f} for f in spectral_peaks(residual, dt, PEAKS)]
        spacing = at.past.duration / ONSETS
        gradual = [(j * spacing, 0.2 * spacing) for j in range(1, ONSETS)]
        sudden = [((k + s) * dt, 2 * dt) for k in change_points(residual) for s in SHIFTS]
        steps = [{"time": float(t), "rise": float(rise)} for t, rise in (*gradual, *sudden)]
        if at.past.added is None:
            return [*lines, *steps]
        ends = while_it_lasts(at.past.added, summed=isinstance(at.element, C))
        begin, end = (k * dt for k in ends)
        return [*lines, *steps, {"time": begin, "end": end, "rise": 2 * dt}]

    def made(self, at: Site, time: float | None = None, **shape: float) -> Law:
        """Return what depends on time alone: a sinusoid, a step or a push."""
        duration, stores, size = at.past.duration, isinstance(at.element, C), 0.1 * at.past.swing
        unit = law_units(at.element)[0]
        if time is None:
            frequency = shape.get("frequency") or _strongest(at)
            return Tone(frequency, 1 / duration, size, unit, not stores)
        if stores:
            size, unit = size / duration, f"{unit}/s" if unit != "1" else unit
        margin = 1.5 * duration / ONSETS
        common = (time, shape["rise"], margin, size, unit, stores, not stores)
        return Push(*common, end=shape["end"]) if "end" in shape else Onset(*common)

    def with_law(
        self, scene: FittedModel, element: Element, law: Law
    ) -> tuple[BondGraph, tuple[str, ...]]:
        """Give a storage the law, and an inertia a branch beside it."""
        if isinstance(element, C):
            return super().with_law(scene, element, law)
        beside, g = R(f"outside_{element.name}", law=law), scene.graph
        names = tuple(p.name for p in law.parameters(beside.name))
        return g.with_branch(g.neighbour(element.name), [beside]), names


def _strongest(at: Site) -> float:
    """Return the frequency of the residual's strongest line."""
    found = spectral_peaks(at.scene.residual / at.scene.data.floor, at.past.dt, 1)
    return found[0] if found else 1.0 / at.past.duration


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


def _beside(graph: BondGraph, element: Element, kind: type[Element]) -> bool:
    return isinstance(graph[graph.neighbour(element.name)], kind)
