"""The columns of the tool's own screening, one for every law at every place."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bondgraph.support.arrays import FloatArray as Array
from identification.diagnosis.catalogue import UNNAMED
from identification.diagnosis.screening.port_history import FittedModel
from identification.diagnosis.screening.port_response import Probes, probes
from identification.diagnosis.screening.score_test import Screened, projection, training_rows


@dataclass(frozen=True, eq=False)
class Columns:
    """A regression whose columns are laws.

    Attributes
    ----------
    labels : tuple of (str, str)
        Effect and element of each column.
    matrix : ndarray, shape (M, p)
        What each law does to the readings of the training part, weighed by the noise; whatever
        parameters, nuisances and initial states may imitate is projected out, here and there.
    residual : ndarray, shape (M,)
        What the nominal model leaves, likewise.
    """

    labels: tuple[tuple[str, str], ...]
    matrix: Array
    residual: Array


IMITATED = 1e-7
"""Part of a column that has to be left beside what parameters, nuisances and states may do."""


def columns_of(scene: FittedModel, ranking: Sequence[Screened]) -> Columns:
    """Return the columns of a screening, each law in the shape that explained most.

    The unnamed curve is left out: it is no law.
    """
    onto, probe = projection(scene), probes(scene.nominal, scene.nominal.problem.with_chain)
    asked = [s for s in ranking if s.latent is not None and s.effect.name != UNNAMED.name]
    labels, parts = [], []
    for element in dict.fromkeys(s.element.name for s in asked):
        here = [s for s in asked if s.element.name == element]
        response = _responses(scene, probe, element, here)
        rows, whole = onto.rows(response), training_rows(onto.problem, response)
        # of what other values imitate wholly only rounding is left
        left = np.linalg.norm(rows, axis=0) > IMITATED * np.linalg.norm(whole, axis=0)
        usable = np.isfinite(rows).all(axis=0) & left
        parts.append(rows[:, usable])
        labels += [(s.effect.name, element) for s, good in zip(here, usable, strict=True) if good]
    nothing = np.zeros((onto.residual.size, 0))
    return Columns(tuple(labels), np.hstack([nothing, *parts]), onto.residual)


def _responses(scene: FittedModel, probe: Probes, element: str, here: Sequence[Screened]) -> Array:
    latent = np.stack([s.latent for s in here if s.latent is not None], axis=1)
    flow = None
    if element in probe.flows:
        flow = np.stack([_flow(scene, s) for s in here], axis=1)
    response = probe.respond(element, latent, flow)
    for i, s in enumerate(here):
        if s.effect.plain and (seen := _seen(scene, s)) is not None:
            response[:, :, i] = seen
    return response


def _seen(scene: FittedModel, s: Screened) -> Array | None:
    """Return what an element changes in the readings where it was found by a run with it."""
    assert s.hint is not None
    for signature in s.effect.signatures(scene, s.element):
        if dict(signature.shape or {}) == dict(s.hint.shape) and signature.seen is not None:
            return np.asarray(signature.seen @ s.hint.weights)
    return None


def _flow(scene: FittedModel, s: Screened) -> Array:
    """Return what a law adds on the other side of a two-port."""
    assert s.hint is not None
    for signature in s.effect.signatures(scene, s.element):
        if dict(signature.shape or {}) == dict(s.hint.shape) and signature.flow is not None:
            return np.asarray(signature.flow @ s.hint.weights)
    return np.zeros(scene.data.n)
