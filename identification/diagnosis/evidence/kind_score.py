"""What any law of a kind could explain at a port: flexible forms, fitted along the best trajectory.

The candidate that describes the recording best tells how every port has moved, whatever its law.
Along these histories each flexible form is linear in its weights, and so is its answer through the
linear rest of the model; together with the parameters and initial states it is fitted by least
squares and scored on stretches left out, like every law (`block_score`). So "a memory at this
port" is a hypothesis of its own: it speaks where no law of the catalogue fits, and it is the most
that any law of its kind could reach.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from joblib import Parallel, delayed

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.elements import Element, R, TwoPort
from bondgraph.support.arrays import Array
from bondgraph.support.errors import BondsightError
from identification.diagnosis.catalogue.effect import Signature, kind_at
from identification.diagnosis.evidence.block_score import BlockScore
from identification.diagnosis.evidence.leave_out import (
    Rows,
    Stretched,
    rows_of,
    states_of,
    stretched,
)
from identification.diagnosis.screening.flexible_forms import (
    flexible_forms,
    linear_forms,
    sort_anywhere,
)
from identification.diagnosis.screening.mode_forms import mode_forms
from identification.diagnosis.screening.port_history import FittedModel, PortHistory
from identification.diagnosis.screening.port_response import Probes, probes
from identification.diagnosis.screening.score_test import Screened, training_rows
from identification.diagnosis.screening.tangent_space import within_calibration
from identification.estimation.single_record import Fit
from identification.study.problem import Problem
from identification.study.residual import Point, evaluate, slots

Forms = Callable[[Element, PortHistory], Mapping[str, Signature]]


@dataclass(frozen=True, eq=False)
class KindScore:
    """A kind of physics at a port.

    Attributes
    ----------
    element, kind : str
    score : BlockScore
        Of its best fit; the stretches are those of every candidate.
    addition : ndarray, shape (N,), SI
        What the fitted form adds at the port.
    """

    element: str
    kind: str
    score: BlockScore
    addition: Array

    @property
    def label(self) -> str:
        """Text such as ``a memory at C_nl``."""
        return f"{sort_anywhere(self.kind)} at {self.element}"


@dataclass(frozen=True, eq=False)
class Bench:
    """The declared model at the values of a better one: what forms are fitted on.

    Attributes
    ----------
    residual : ndarray, shape (M,)
        Training residual of the declared model there, over the floor.
    columns : ndarray, shape (M, p)
        What parameters, nuisances and initial states change.
    """

    problem: Problem
    rows: Rows
    residual: Array
    columns: Array
    probed: Probes

    @cached_property
    def stretched(self) -> Stretched:
        """The columns, stretch after stretch."""
        return stretched(self.columns, self.rows)


def bench_of(base: Fit, better: Fit, plain: BondGraph | None = None) -> Bench:
    """Put the model of `base` where `better` ended, what `better` has beyond it left out.

    Parameters
    ----------
    plain : BondGraph, optional
        The declared model, which is linear where `base` has laws already: forms answer through it.
    """
    problem = base.problem
    fit = base if base is better else replace(base, point=at_values_of(base, better))
    e = evaluate(problem, fit.point, scored=True)
    columns = np.hstack([within_calibration(base, e), states_of(problem, e)])
    graph = problem.with_chain if plain is None else plain
    return Bench(problem, rows_of(problem), e.residual, columns, probes(fit, graph))


def along(bench: Bench, scene: FittedModel, places: Iterable[str]) -> Bench:
    """Return the bench with what the parameters at some places would add along given histories.

    Their own columns are those of the model without what is missing there, which may move
    otherwise altogether.
    """
    elements, parts = bench.problem.graph.elements, [bench.columns]
    for name in places:
        if name not in scene.past or name not in elements or not bench.probed.knows(name):
            continue
        form = _moving(linear_forms(elements[name], scene.past[name]))
        if form.columns.shape[1]:
            response = bench.probed.respond(name, form.columns, form.flow)
            parts.append(training_rows(bench.problem, response))
    return replace(bench, columns=np.hstack(parts))


def at_values_of(base: Fit, better: Fit) -> Point:
    """Return the point of `base`'s problem with the values of another fit."""
    problem, values = base.problem, better.values
    at, there = slots(problem), slots(better.problem)
    theta = base.point.theta.copy()
    for i, f in enumerate(problem.free):
        value = values.get(f.parameter.name)
        if value is not None and (not f.log or value > 0):
            theta[i] = f.theta(value)
    theta[at.lags] = better.point.theta[there.lags]
    theta[at.offsets] = better.point.theta[there.offsets]
    states = base.point.states.copy()
    if states.shape[0] == better.point.states.shape[0]:
        names = better.problem.dynamics.state_names
        for i, n in enumerate(problem.dynamics.state_names):
            if n in names:
                states[:, i] = better.point.states[:, names.index(n)]
    return Point(theta, states)


def kind_scores(
    bench: Bench,
    scene: FittedModel,
    ranked: Sequence[Screened],
    places: Iterable[str] | None = None,
    jobs: int = 1,
    forms: Forms = flexible_forms,
    modes: bool = True,
) -> list[KindScore]:
    """Score every kind at the given places (all, unless given), best first.

    Parameters
    ----------
    scene : FittedModel
        Of the best candidate: its ports' histories are used.
    ranked : sequence of Screened
        Effects screened there; the additions they ask for join the forms of their kind.
    jobs : int
        Threads that share the places.
    forms : callable
        What every kind may look like at an element with its past.
    modes : bool
        Masses have resonances too (`mode_forms`).
    """
    elements = bench.problem.graph.elements
    found = Parallel(n_jobs=jobs, backend="threading")(
        delayed(_scores)(bench, scene, ranked, elements[name], forms, modes)
        for name in asked_places(bench, scene, places)
    )
    return sorted((k for each in found for k in each), key=lambda k: k.score.loss)


def asked_places(
    bench: Bench, scene: FittedModel, places: Iterable[str] | None = None
) -> list[str]:
    """Return those of the places (all, unless given) whose history and answer are known."""
    elements = bench.problem.graph.elements
    return [
        name
        for name in places or list(elements)
        if name in scene.past and bench.probed.knows(name) and name in elements
    ]


def _scores(
    bench: Bench,
    scene: FittedModel,
    ranked: Sequence[Screened],
    element: Element,
    made: Forms,
    modes: bool,
) -> list[KindScore]:
    return scores_at(bench, element.name, forms_at(scene, ranked, element, made, modes))


def forms_at(
    scene: FittedModel,
    ranked: Sequence[Screened],
    element: Element,
    made: Forms = flexible_forms,
    modes: bool = True,
) -> dict[str, Signature]:
    """Return the forms of every kind at an element, what its laws would add among them."""
    forms = dict(made(element, scene.past[element.name]))
    if modes:
        forms |= mode_forms(scene, element)
    for s in ranked:
        # the addition of a two-port has two sides, of which the screening keeps one
        alone = s.element.name == element.name and not isinstance(element, TwoPort)
        if alone and s.effect.kind and s.latent is not None:
            column = np.nan_to_num(s.latent)[:, None]
            for k in _kinds_of(s.effect.kind, element):
                known = forms.get(k)
                both = column if known is None else np.hstack([known.columns, column])
                forms[k] = Signature(both)
    return forms


def _kinds_of(kind: str, element: Element) -> tuple[str, ...]:
    """Kinds whose form an addition joins: friction that remembers is dissipative as well."""
    rubs = kind == "memory" and isinstance(element, R)
    return (kind_at(kind, element), *(("dissipative",) if rubs else ()))


def scores_at(bench: Bench, element: str, forms: Mapping[str, Signature]) -> list[KindScore]:
    """Score the forms of one element."""
    return [
        KindScore(element, kind, *scored_beside(bench, columns, x))
        for kind, columns, x in answers_at(bench, element, forms)
    ]


def answers_at(
    bench: Bench, element: str, forms: Mapping[str, Signature]
) -> Iterator[tuple[str, Array, Array]]:
    """Yield each kind with its columns (N, k) and what they change in the residual (M, k).

    Columns that kinds share are sent through the model once.
    """
    known = dict[bytes, Array]()
    for kind, form in forms.items():
        kept = _moving(form)
        if not kept.columns.shape[1]:
            continue
        keys = [_key(kept, j) for j in range(kept.columns.shape[1])]
        new = [j for j, key in enumerate(keys) if key not in known]
        if new:
            flow = None if kept.flow is None else kept.flow[:, new]
            try:
                response = bench.probed.respond(element, kept.columns[:, new], flow)
            except BondsightError:
                continue
            rows = training_rows(bench.problem, response)
            known |= {keys[j]: rows[:, i] for i, j in enumerate(new)}
        x = np.stack([known[key] for key in keys]).T
        if np.isfinite(x).all():
            yield kind, kept.columns, x


def alone(bench: Bench) -> BlockScore:
    """Score the columns of a bench without any form."""
    nothing = np.zeros((bench.residual.size, 0))
    return scored_beside(bench, nothing[:0], nothing)[0]


def _key(form: Signature, column: int) -> bytes:
    flow = b"" if form.flow is None else form.flow[:, column].tobytes()
    return form.columns[:, column].tobytes() + flow


def _moving(form: Signature) -> Signature:
    """Return the columns that move, finite and of size one."""
    x = form.columns
    sizes = np.abs(x).max(axis=0, initial=0.0)
    kept = np.isfinite(x).all(axis=0) & (np.ptp(x, axis=0) > 0)
    if form.flow is not None:
        kept &= np.isfinite(form.flow).all(axis=0)
    sizes = sizes[kept]
    flow = None if form.flow is None else form.flow[:, kept] / sizes
    return Signature(x[:, kept] / sizes, flow)


def scored_beside(bench: Bench, form: Array, x: Array) -> tuple[BlockScore, Array]:
    """Fit columns `x` (M, k) beside those of the bench; what the `form` (N, k) adds then."""
    both = bench.stretched.beside(x)
    total = both.products.sum(axis=0)
    size = np.sqrt(np.diag(total))
    size[size == 0] = 1.0
    # a little precision: forms that nearly coincide must not run against each other
    gram = total / np.outer(size, size) + RIDGE * np.eye(size.size)
    order = bench.rows.order
    weights = np.linalg.solve(gram, both.columns.T @ bench.residual[order] / size) / size
    left = bench.residual.copy()
    left[order] -= both.columns @ weights
    out = both.held_out(left, RIDGE * size**2)
    return BlockScore(out), np.asarray(form @ weights[bench.columns.shape[1] :])


RIDGE = 1e-9
"""Precision of the weights of unit columns."""
