"""The past of every port along the signal that must have acted at one of them.

Where a relation says that the mismatch sits at a port, the readings say what was added there,
sample by sample, whatever the law is. With it the model goes where the plant went: every port's
history is the true one, and what was added can be held against it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bondgraph.support.arrays import Array
from bondgraph.support.errors import BondsightError
from identification.diagnosis.localisation.blind_relations import BlindRelation, ample_size
from identification.diagnosis.localisation.relations.course import followed, latent_course
from identification.diagnosis.localisation.relations.latent import LatentModel
from identification.diagnosis.localisation.relations.refit import timed
from identification.diagnosis.screening.observation import filled, scene_of, watched_signals
from identification.diagnosis.screening.port_history import FittedModel
from identification.estimation.single_record import Fit
from identification.study.residual import Point, evaluate, weighted, windows


@dataclass(frozen=True, eq=False)
class LatentHistory:
    """What was added at a port, and the past of every port with it.

    Attributes
    ----------
    scene : FittedModel
        Its `nominal` is the declared model at the parameters that the relation found, with nothing
        added: its residual is what the signal explains.
    likely : ndarray, shape (N, k)
        The likeliest course of the signals at the port.
    ample : ndarray, shape (N, k)
        What follows the readings as closely as any course can, their noise too.
    """

    scene: FittedModel
    likely: Array
    ample: Array


def latent_history(
    fit: Fit, relation: BlindRelation, port: str, model: LatentModel
) -> LatentHistory:
    """Look along the likeliest signal at a port of a relation.

    Parameters
    ----------
    fit : Fit
        The nominal fit.
    relation : BlindRelation
        Blind to the port.
    port : str
        Where the signal is taken to act. Histories are true if it does, or at a port whose signals
        move the readings as this one's do (`equal_ports`).
    model : LatentModel
        Of the fit.

    Raises
    ------
    BondsightError
        The relation is not blind to an addition at a port (but to a reading), or nothing is known.
    """
    sources = model.ports.get(port, ())
    if not sources or not relation.theta.size:
        raise BondsightError(f"{port} has no signal of its own to look for")
    bare = _at(fit, Point(relation.theta, fit.point.states))
    likely, ample = _courses(bare, model, port)
    driven = dict(zip(sources, likely.T, strict=True))
    watched = watched_signals(model.probes.graph)
    names = {n for pair in watched.values() for n in pair}
    # the states at the start belong to it: what is left beside the signal says how they were
    moved, _ = replace(model.probes, fit=bare).observed(names, driven)
    bare = _at(fit, Point(relation.theta, bare.point.states + _starts(bare, moved)))
    moved, traces = replace(model.probes, fit=bare).observed(names, driven)
    seen = scene_of(bare, watched, traces)
    past = dict(seen.past)
    y = filled(bare.simulated + moved)
    for i, n in enumerate(fit.problem.data.names):
        past[n] = replace(past[n], argument=y[:, i], output=y[:, i])
    return LatentHistory(replace(seen, past=past), likely, ample)


def equal_ports(model: LatentModel, ports: Sequence[str], theta: Array) -> list[tuple[str, ...]]:
    """Group ports whose signals move the readings alike, but for a constant factor.

    Ports of a class are parallel only: behind another mass the same readings need another signal.
    """
    angles = np.geomspace(1e-3, 2.0, 9)
    groups: list[tuple[Array, tuple[str, ...]]] = []
    for port in (p for p in ports if model.ports.get(p)):
        own = model.sampled(port, theta).response(angles)
        for i, (first, members) in enumerate(groups):
            if first.shape == own.shape:
                factor = complex(np.vdot(first, own) / np.vdot(first, first))
                same = np.linalg.norm(own - factor.real * first) <= SAME * np.linalg.norm(own)
                if same:
                    groups[i] = first, (*members, port)
                    break
        else:
            groups.append((own, (port,)))
    return [members for _, members in groups]


SAME = 1e-6


def _at(fit: Fit, point: Point) -> Fit:
    simulated = evaluate(fit.problem, point, derivatives=False).y
    return replace(fit, point=point, simulated=simulated)


def _courses(bare: Fit, model: LatentModel, port: str) -> tuple[Array, Array]:
    """Signals over the whole record, shapes (N, k): the likeliest, and ample ones."""
    problem = bare.problem
    sampled = model.sampled(port, bare.point.theta)
    size = ample_size(bare, sampled, bare.simulated)
    if size is None:
        raise BondsightError(f"what was added at {port} could be anything")
    left = filled(problem.data.readings - bare.simulated)
    likely = np.zeros((problem.data.n, size.size))
    ample = likely.copy()
    for w in windows(problem):
        block = weighted(problem, left[w].T[:, :, None].copy()).transpose(0, 2, 1)
        seen = timed(problem, bare.point.theta, block)[:, 0].T
        likely[w], ample[w] = latent_course(sampled, size, seen), followed(sampled, size, seen)
    return likely, ample


def _starts(bare: Fit, moved: Array) -> Array:
    """Change of the states at the start that explains most of what the signal leaves."""
    problem = bare.problem
    e = evaluate(problem, bare.point)
    change = np.zeros_like(bare.point.states)
    train = problem.data.mask("train")
    left = problem.data.readings - bare.simulated - moved
    local = iter(e.local)
    for i, w in enumerate(windows(problem)):
        if not train[w].any():
            continue
        _, columns = next(local)
        if columns.shape[1]:
            rest = weighted(problem, left[w][train[w]].T[:, :, None].copy())
            change[i, problem.free_states] = np.linalg.lstsq(columns, rest.ravel(), rcond=1e-8)[0]
    return change
