"""Offsets of several readings that one constant effort, such as a weight, would give as well."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bondgraph.graph.elements import C, Element, I, One, R, Source
from bondgraph.support.arrays import Array
from bondgraph.support.errors import BondsightError
from identification.diagnosis.localisation.recording.variables import variables_of
from identification.diagnosis.screening.port_response import Probes, probes
from identification.estimation.leaning import Leaning
from identification.estimation.single_record import Fit, alone
from identification.report.numbers import quantity
from identification.report.words import listed
from identification.study.residual import evaluate, windows

LEAST = 2
"""Offsets of readings that agree by chance no more."""
BESIDE = 0.3
"""Times the noise that a constant may leave of the offsets that it stands for."""
SHARE = 0.02
"""The same as a part of them: how far the gains of the fitted model may be off."""
SETTLED = 0.01
"""Part by which an answer to a constant may still move in the last third of a recording."""


@dataclass(frozen=True, slots=True)
class ConstantLoad:
    """One constant addition that does to all readings what offsets do.

    Attributes
    ----------
    offsets : tuple of str
    places : tuple of str
        Elements at which it may act, the likeliest first.
    junction : str
        Of the first of them.
    value : float, SI
        What drives that junction, in its positive direction.
    word, unit : str
        What it is, and its unit.
    """

    offsets: tuple[str, ...]
    places: tuple[str, ...]
    junction: str
    value: float
    word: str
    unit: str

    @property
    def claim(self) -> str:
        """For the answer."""
        size = quantity(abs(self.value), self.unit)
        at, *others = self.places
        also = f" (or {', '.join(others)})" if others else ""
        return (
            f"{listed(self.offsets)} together are what one constant {self.word} of {size} at "
            f"{at}{also} would do"
        )

    @property
    def advice(self) -> str:
        """What tells the two apart."""
        return (
            f"{self.claim}, such as a load, a weight or a bias: read the sensors at standstill, "
            "with the drive off and held where it is; an offset of a sensor is still there, a load "
            "is not. "
            f'If it is a load, put MSe("load", {self.value:.4g}, unit="{self.unit}") at '
            f"{self.junction}, and ask for no offsets (Nuisances(offsets=False))"
        )


def constant_load(last: Fit, leaning: Sequence[Leaning]) -> ConstantLoad | None:
    """Return the constant effort that stands for all offsets that a fit leans on, if one does.

    An inertia's comes first: weights and loads act there. None where fewer than two readings have
    offsets worth a word, or where no single place explains them.
    """
    found = [n for n in leaning if n.estimate.name.startswith("offset") and not n.is_ambient]
    if len({n.reading for n in found}) < LEAST:
        return None
    told, floor = _told(last, found), last.problem.data.floor
    allowed = np.maximum(BESIDE, SHARE * np.abs(told / floor))
    fits = []
    try:
        answers = list(_answers(last, probes(last)))
    except (BondsightError, np.linalg.LinAlgError):
        return None
    for e, gain in answers:
        scaled = gain / floor
        size = float(scaled @ (told / floor)) / float(scaled @ scaled)
        if (np.abs(told / floor - size * scaled) <= allowed).all():
            fits.append((e, size))
    if not fits:
        return None
    kinds = (I, C, R)
    fits.sort(key=lambda f: next(k for k, kind in enumerate(kinds) if isinstance(f[0], kind)))
    (first, size), graph = fits[0], last.problem.graph
    v, junction = variables_of(first), graph.neighbour(first.name)
    # what acts at one junction acts alike at all of its elements
    apart = [e.name for e, _ in fits[1:] if graph.neighbour(e.name) != junction]
    # an element takes what its junction gets less
    return ConstantLoad(
        tuple(n.estimate.name for n in found), (first.name, *apart), junction, -size, v.effort,
        v.effort_unit,
    )  # fmt: skip


def _told(last: Fit, found: Sequence[Leaning]) -> Array:
    """Return what the offsets change in each reading, shape (n_y,)."""
    problem, (stack, _) = last.problem, alone(last)
    theta = last.point.theta.copy()
    for n in found:
        at = list(stack.columns[0]).index(stack.names.index(n.estimate.name))
        free = problem.free[at] if at < len(problem.free) else None
        theta[at] = 0.0 if free is None else free.theta(free.parameter.value)
    without = evaluate(problem, replace(last.point, theta=theta), derivatives=False).y
    change = last.simulated - without
    return np.asarray(np.nanmean(change[problem.data.mask("train")], axis=0))


def _answers(last: Fit, probed: Probes) -> Iterator[tuple[Element, Array]]:
    """Yield what a constant effort at every port of a 1-junction changes, where it settles."""
    problem, graph = last.problem, last.problem.graph
    window = max(windows(problem), key=lambda w: w.stop - w.start)
    rest = slice(window.stop - (window.stop - window.start) // 3, window.stop)
    driven = {graph.neighbour(s.name) for s in graph.of_type(Source)}
    for e in graph.of_type(I, C, R):
        place = graph.neighbour(e.name)
        # beside a source it is that source's own offset
        if not isinstance(graph[place], One) or place in driven or not probed.knows(e.name):
            continue
        answer = probed.respond(e.name, np.ones((problem.data.n, 1)))[rest, :, 0]
        gain = answer.mean(axis=0) / problem.data.floor
        size = float(np.abs(gain).max())
        if size > 0 and np.ptp(answer / problem.data.floor, axis=0).max() < SETTLED * size:
            yield e, gain * problem.data.floor
