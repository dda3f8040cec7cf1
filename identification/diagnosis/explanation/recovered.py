"""What the missing signal of a diagnosis looks like, recovered at its likeliest ports."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from bondgraph.graph.elements import C, Element, Source
from bondgraph.graph.sensors import Sensor
from bondgraph.support.arrays import Array
from bondgraph.support.errors import BondsightError
from identification.diagnosis.explanation.characterisation import Character, characterise
from identification.diagnosis.explanation.latent_signal import Latent, latent
from identification.diagnosis.screening.port_history import PortHistory
from identification.diagnosis.screening.port_response import Probes, probes
from identification.diagnosis.screening.tangent_space import freedom
from identification.study.residual import windows

if TYPE_CHECKING:
    from identification.diagnosis.diagnose import Diagnosis

LOST = 0.1
"""Part of what a law bends below which what was recovered does not show it."""
NO_POINTS = " What is missing cannot be recovered here beside the noise: no points are drawn."
"""What is said of a plane whose law is `lost`."""


def characterised(d: Diagnosis, ports: int = 2) -> Diagnosis:
    """Return the diagnosis with what the missing signal looks like at its likeliest ports.

    The signal is rebuilt from the residual of the nominal fit by smoothing, no law assumed.
    """
    if d.scene is None or d.nominal is None or d.kind not in ("missing_physics", "unknown_physics"):
        return d
    step = d.findings[0] if d.findings else d.decision
    if step is None:
        return d
    names = list(dict.fromkeys(t.element for t in sorted(step.trials, key=lambda t: t.test)))
    probed, found = probes(d.scene.nominal), {}
    tangents, scored = freedom(d.scene.nominal), d.scene.data.mask("train")
    for name in [n for n in names if probed.knows(n)][:ports]:
        signal = recovered(d, probed, tangents, scored, name)
        if signal is None:
            continue
        try:
            found[name] = (_seen(d.graph[name], d.scene.past[name], signal.signal), signal)
        except (BondsightError, np.linalg.LinAlgError, ValueError):
            continue
    return replace(d, traits=found)


def _seen(element: Element, past: PortHistory, signal: Array) -> Character:
    """Return what an addition looks like; its energy at a store alone.

    What a resistance imitates is not in the signal, and that is most of what friction takes; a
    transducer gives on one side what it takes on the other.
    """
    store = isinstance(element, C)
    made = characterise(past, signal, flow=not isinstance(element, C | Source | Sensor))
    return made if store else replace(made, loops=replace(made.loops, dissipation=0.0))


def recovered(
    d: Diagnosis, probed: Probes, tangents: Array | None, scored: Array, name: str
) -> Latent | None:
    """Return the addition at one element that explains what the model as it is leaves.

    At a sensor it is what is left of its reading: nothing is to be smoothed. None without an
    answer.

    Parameters
    ----------
    tangents : ndarray, shape (N, n_y, p), or None
        What the parameters of the fit do to the readings; None where they are known.
    scored : ndarray of bool, shape (N,)
        Samples that are looked at.
    """
    if d.scene is None or not probed.knows(name):
        return None
    data, fit = d.scene.data, d.scene.nominal
    residual = np.where(scored[:, None], data.readings - fit.simulated, 0.0)
    floor = _floor(d, data.floor)
    if name in data.names:
        c, square = data.names.index(name), np.sum((residual / floor) ** 2, axis=0)
        share = float(square[c] / (square.sum() or 1.0))
        return Latent(residual[:, c], share, float(np.var(residual[scored, c])), np.inf, 0)
    try:
        return latent(
            partial(probed.respond, name), residual, floor, data.dt, tangents=tangents,
            windows=windows(fit.problem), scored=scored,
        )  # fmt: skip
    except (BondsightError, np.linalg.LinAlgError, ValueError):
        return None


def _floor(d: Diagnosis, floor: Array) -> Array:
    """Return the noise, where it was read too high that which the last repair leaves."""
    if d.repaired is None:
        return floor
    left = np.sqrt(np.mean(d.repaired.residuals("train") ** 2, axis=0))
    return np.where(left > 0, np.fmin(floor, left), floor)


def lost(bend: Array, law: Array) -> bool:
    """Whether what was recovered at an element holds nothing of the law that was found there.

    Parameters
    ----------
    bend, law : ndarray
        What either adds to a straight line.
    """
    return float(np.std(bend)) < LOST * float(np.std(law))
