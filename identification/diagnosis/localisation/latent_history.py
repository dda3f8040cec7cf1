"""The past of every port along the signal that must have acted at one of them.

Where a relation says that the mismatch sits at a port, the readings say what was added there,
sample by sample, whatever the law is. With it the model goes where the plant went: every port's
history is the true one, and what was added can be held against it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bondgraph.support.arrays import Array
from bondgraph.support.errors import BondsightError
from identification.diagnosis.localisation.blind_relations import BlindRelation, ample_size
from identification.diagnosis.localisation.relations.course import latent_course
from identification.diagnosis.localisation.relations.latent import LatentModel, latent_model
from identification.diagnosis.localisation.relations.refit import timed
from identification.diagnosis.screening.observation import filled, scene_of, watched_signals
from identification.diagnosis.screening.port_history import FittedModel
from identification.diagnosis.screening.port_response import Probes, probes
from identification.estimation.single_record import Fit
from identification.study.residual import Point, evaluate, weighted, windows


def latent_history(
    fit: Fit, relation: BlindRelation, probed: Probes | None = None
) -> tuple[FittedModel, dict[str, Array]]:
    """Return the scene along the likeliest signal at the ports of a relation, and that signal.

    Parameters
    ----------
    fit : Fit
        The nominal fit.
    relation : BlindRelation
        What is added at its first port stands for the others, which have the same effect.

    Returns
    -------
    scene : FittedModel
        Its `nominal` is the declared model at the parameters that the relation found, with nothing
        added: its residual is what the signal explains.
    course : dict of str to ndarray, shape (N,)
        By the source that stands for the port.

    Raises
    ------
    BondsightError
        The relation is not blind to an addition at a port (but to a reading), or nothing is known.
    """
    model = latent_model(probed if probed is not None else probes(fit))
    sources = model.ports.get(relation.ports[0], ())
    if not sources or not relation.theta.size:
        raise BondsightError(f"{relation.ports[0]} has no signal of its own to look for")
    bare = _at(fit, Point(relation.theta, fit.point.states))
    course = _course(bare, model, relation.ports[0])
    driven = dict(zip(sources, _between(course, fit.problem.data.hold).T, strict=True))
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
    return replace(seen, past=past), dict(zip(sources, course.T, strict=True))


def _at(fit: Fit, point: Point) -> Fit:
    simulated = evaluate(fit.problem, point, derivatives=False).y
    return replace(fit, point=point, simulated=simulated)


def _course(bare: Fit, model: LatentModel, port: str) -> Array:
    """Signal over the whole record, shape (N, k)."""
    problem = bare.problem
    sampled = model.sampled(port, bare.point.theta)
    size = ample_size(bare, sampled, bare.simulated)
    if size is None:
        raise BondsightError(f"what was added at {port} could be anything")
    left = filled(problem.data.readings - bare.simulated)
    course = np.zeros((problem.data.n, size.size))
    for w in windows(problem):
        block = weighted(problem, left[w].T[:, :, None].copy()).transpose(0, 2, 1)
        course[w] = latent_course(sampled, size, timed(problem, bare.point.theta, block)[:, 0].T)
    return course


def _between(course: Array, hold: str) -> Array:
    """Return values that a source has to take where the engine holds them between samples."""
    if hold != "hold":
        return course
    return np.concatenate([0.5 * (course[1:] + course[:-1]), course[-1:]])


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
