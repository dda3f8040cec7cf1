"""Rank every effect at every place by one linear step from the fitted model: cheap, for all ports.

Each effect says what it would add at its port (`Effect.signatures`). The addition is sent through
the linearised model to the readings, whatever parameters, offsets and initial states could imitate
is projected out of it and out of the residual, and the rest is weighed by least squares: the first
Gauss-Newton step of the full fit, for the price of one simulation (score test; Rao 1948).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
from joblib import Parallel, delayed

from bondgraph.graph.elements import Element
from bondgraph.support.arrays import Array
from identification.diagnosis.catalogue.effect import Effect, Hint, Signature
from identification.diagnosis.evidence.leave_out import rows_of
from identification.diagnosis.screening.port_history import FittedModel
from identification.diagnosis.screening.port_response import Probes
from identification.diagnosis.screening.tangent_space import within_calibration
from identification.statistics.blocks import mean_z
from identification.study.problem import Problem
from identification.study.residual import evaluate, weighted, windows

BLOCKS = 24
"""Stretches of the training part that vote on whether an improvement is real."""
TOGETHER = 12
"""Columns that go through the model together at most: more leave the cache."""
WEAKEST = 1e-7
"""Singular values below this share of the largest are a combination without effect."""
ROUNDING = 1e-12
"""The same of the eigenvalues of normal equations, which are rounded."""
HUGE = 1e100
"""Response beyond which a linearisation has run away; its square may be no number."""


@dataclass(frozen=True, eq=False)
class Screened:
    """One effect at one place after the linear screening.

    Attributes
    ----------
    share : float
        Part of the training misfit that one linear step would remove.
    columns : int
        How many weights that took.
    z : float
        Standard errors by which the improvement shows in stretches the weights were not fitted on.
    hint : Hint or None
        What the full fit starts from; None for effects without signatures.
    others : tuple of Hint
        What it may start from too: the best along other courses.
    latent : ndarray, shape (N,), SI, or None
        The addition at the port that the weights make.
    """

    effect: Effect
    element: Element
    home: bool
    share: float
    columns: int
    z: float
    hint: Hint | None
    latent: Array | None = None
    others: tuple[Hint, ...] = ()

    @property
    def hints(self) -> tuple[Hint | None, ...]:
        """All that the full fit may start from, the best first."""
        return (self.hint, *self.others)

    @property
    def label(self) -> str:
        """Text such as ``hysteresis at C_nl``."""
        return f"{self.effect.name} at {self.element.name}"


@dataclass(frozen=True, eq=False)
class Projection:
    """Residual and rows of the training part, free of what the fit itself can do.

    Attributes
    ----------
    residual : ndarray, shape (M,)
        Weighted residual, projected.
    total : float
        Its sum of squares before the projection took the rest of the fit's freedom.
    blocks : ndarray of int, shape (M,)
        Stretch of the record that each row belongs to.
    """

    problem: Problem
    residual: Array
    total: float
    blocks: Array
    _local: tuple[tuple[slice, Array], ...]
    _shared: Array

    def rows(self, response: Array) -> Array:
        """Weighted, projected rows of responses (N, n_y, k), shape (M, k)."""
        return self.clean(training_rows(self.problem, response))

    def clean(self, x: Array) -> Array:
        """Project out initial states, parameters and nuisances."""
        x = x.copy(order="K")
        for rows, q in self._local:
            x[rows] -= q @ (q.T @ x[rows])
        # column by column, as they lie in memory
        return np.asarray(x - ((self._shared.T @ x).T @ self._shared.T).T)


def projection(scene: FittedModel, free: Array | None = None) -> Projection:
    """Prepare the screening of a fitted model; `free`, shape (M, k), may take any weight too."""
    fit = scene.nominal
    problem = fit.problem
    e = evaluate(problem, fit.point)
    local = tuple((rows, _basis(matrix)) for rows, matrix in e.local)
    nothing = np.zeros((e.residual.size, 0))
    raw = Projection(problem, e.residual, 0.0, np.zeros(0), local, nothing)
    columns = within_calibration(fit, e)
    columns = columns if free is None else np.hstack([columns, free])
    made = replace(raw, _shared=_basis(raw.clean(columns)))
    left = made.clean(e.residual[:, None])[:, 0]
    return replace(
        made, residual=left, total=float(left @ left), blocks=rows_of(problem, BLOCKS).block
    )


def screen(
    scene: FittedModel,
    probes: Probes,
    catalogue: Sequence[Effect],
    jobs: int = 1,
    free: Array | None = None,
) -> list[Screened]:
    """Rank the effects of `catalogue` at all their places, best first; those exempt come last.

    `jobs` threads share the work, which is done by libraries that let each other run. `free`,
    shape (M, k), are columns beside those of the parameters that may take any weight.
    """
    onto = projection(scene, free)
    pairs = [
        (effect, element)
        for effect in catalogue
        for element in effect.places_in(scene)
        if element.name in scene.past and probes.knows(element.name)
    ]
    looks = Parallel(n_jobs=jobs, backend="threading")(
        delayed(_screened)(scene, onto, probes, *pair) for pair in pairs
    )
    found = [s for s in looks if s is not None]
    return sorted(found, key=lambda s: (s.hint is None, -s.share))


def _screened(
    scene: FittedModel, onto: Projection, probes: Probes, effect: Effect, element: Element
) -> Screened | None:
    signatures = effect.signatures(scene, element)
    home = effect.home(element)
    if not signatures:
        return Screened(effect, element, home, 0.0, 0, 0.0, None)
    # what an earlier step has inserted is not in the model that is probed
    known = [s for s in signatures if all(probes.knows(other) for other, _ in s.beside)]
    looks = _best(onto, probes, element, known)
    if not looks:
        return None
    gain, x, signature, weights = looks[0]
    share = gain / onto.total if onto.total > 0 else 0.0
    latent = signature.columns @ weights
    hint, *more = (Hint(s.shape or {}, w) for _, _, s, w in looks)
    return Screened(
        effect, element, home, share, weights.size, votes(onto, x), hint, latent, tuple(more)
    )


_Look: TypeAlias = tuple[float, Array, Signature, Array]
"""Gain, rows, signature and weights."""


def _best(
    onto: Projection, probes: Probes, element: Element, signatures: Sequence[Signature]
) -> list[_Look]:
    """Return the best signature along each course; the first one ranks.

    It is that of the fit, which has no name, or of several named ones the best.
    """
    best: dict[str, _Look] = {}
    for some in _batches(signatures):
        sized = [_sized(s) for s in some]
        if not any(factors.any() for _, factors in sized):
            continue
        response = _response(probes, element, [s for s, _ in sized])
        edges = np.cumsum([factors.size for _, factors in sized])[:-1]
        parts = np.split(onto.rows(response), edges, axis=1)
        for signature, (_, factors), x in zip(some, sized, parts, strict=True):
            if not factors.any() or not np.abs(x).max(initial=0.0) < HUGE:
                continue
            weights = _weights(x, onto.residual)
            gain = _gain(x, onto.residual, weights)
            known = best.get(signature.course)
            if known is None or gain > known[0]:
                best[signature.course] = gain, x, signature, weights * factors
    return sorted(best.values(), key=lambda look: (look[2].course != "", -look[0]))


def _response(probes: Probes, element: Element, some: Sequence[Signature]) -> Array:
    """Return what signatures change in the readings, shape (N, n_y, k)."""
    seen = [s.seen for s in some if s.seen is not None]
    if seen:
        return np.concatenate(seen, axis=2)
    flows = [s.flow for s in some if s.flow is not None]
    columns = np.hstack([s.columns for s in some])
    response = probes.respond(element.name, columns, np.hstack(flows) if flows else None)
    for other, *added in zip(*(s.beside for s in some), strict=True):
        response = response + probes.respond(other[0], np.hstack([c for _, c in (other, *added)]))
    return response


def _batches(signatures: Sequence[Signature]) -> Iterator[Sequence[Signature]]:
    """Divide signatures into neighbours that go through the model together."""
    some: list[Signature] = []
    for s in signatures:
        full = sum(t.columns.shape[1] for t in some) + s.columns.shape[1] > TOGETHER
        if some and (full or _ports(s) != _ports(some[0])):
            yield some
            some = []
        some.append(s)
    if some:
        yield some


def _ports(s: Signature) -> tuple[bool, bool, tuple[str, ...]]:
    """Return where a signature adds something, beside its element."""
    return s.flow is not None, s.seen is not None, tuple(name for name, _ in s.beside)


def _sized(s: Signature) -> tuple[Signature, Array]:
    """Return a signature with columns of size one, and their factors; zero where none is usable."""
    size = np.abs(s.columns).max(axis=0)
    usable = np.isfinite(size) & (size > 0)
    if s.flow is not None:
        usable &= np.isfinite(s.flow).all(axis=0)
    for _, added in s.beside:
        usable &= np.isfinite(added).all(axis=0)
    factors = np.where(usable, 1.0 / np.where(usable, size, 1.0), 0.0)

    def scaled(columns: Array) -> Array:
        return np.where(usable, np.where(usable, columns, 0.0) * factors, 0.0)

    flow = None if s.flow is None else scaled(s.flow)
    beside = tuple((name, scaled(added)) for name, added in s.beside)
    seen = None if s.seen is None else scaled(s.seen)
    return replace(s, columns=scaled(s.columns), flow=flow, beside=beside, seen=seen), factors


def _gain(x: Array, r: Array, weights: Array) -> float:
    left = r - x @ weights
    return float(r @ r - left @ left)


def _weights(x: Array, r: Array) -> Array:
    # normal equations: columns are few and many records long, and weak directions are left out
    gram = x.T @ x
    size = np.sqrt(np.diag(gram))
    size = np.where(size > 0, size, 1.0)
    strength, along = np.linalg.eigh(gram / np.outer(size, size))
    kept = strength > ROUNDING * strength.max(initial=0.0)
    along = along[:, kept]
    return np.asarray(along @ ((along.T @ (x.T @ r / size)) / strength[kept]) / size)


def votes(onto: Projection, x: Array) -> float:
    """Return standard errors of the improvement on stretches not used for the weights.

    Logarithms of the stretches' misfits are compared, so that a few loud ones do not decide.
    """
    if not x.shape[1]:
        return 0.0
    gains = np.zeros(BLOCKS)
    for half in (0, 1):
        inside = onto.blocks % 2 == half
        if not inside.any() or inside.all():
            return 0.0
        weights = _weights(x[inside], onto.residual[inside])
        left = onto.residual[~inside] - x[~inside] @ weights
        here = onto.blocks[~inside]
        before = np.bincount(here, onto.residual[~inside] ** 2, BLOCKS)
        after = np.bincount(here, left**2, BLOCKS)
        gains += np.where(before > 0, np.log((before + 1e-300) / (after + 1e-300)), 0.0)
    return mean_z(gains[np.unique(onto.blocks)])


def _basis(x: Array) -> Array:
    """Orthonormal columns that span `x`, negligible directions left out."""
    if not x.shape[1]:
        return np.zeros((x.shape[0], 0))
    size = np.linalg.norm(x, axis=0)
    x = x[:, size > 0] / size[size > 0]
    if not x.shape[1] or not np.isfinite(x).all():
        return np.zeros((x.shape[0], 0))
    q, r = np.linalg.qr(x)
    keep = np.abs(np.diag(r)) > WEAKEST
    return np.asarray(q[:, keep])


def training_rows(problem: Problem, response: Array) -> Array:
    """Weighted training rows of responses (N, n_y, k) in the order of the residual, (M, k)."""
    train = problem.data.mask("train")
    parts = []
    for w in windows(problem):
        chosen = np.flatnonzero(train[w])
        if chosen.size:
            # turned so that time is contiguous, as in the response
            seen = response[w].T.take(chosen, axis=2)
            block = weighted(problem, seen.transpose(1, 2, 0)).transpose(2, 0, 1)
            parts.append(block.reshape(block.shape[0], block.shape[1] * block.shape[2]))
    nothing = [np.zeros((response.shape[2], 0))]
    return np.asarray(np.concatenate(parts or nothing, axis=1).T)
