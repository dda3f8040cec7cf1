"""Frequency response of a model's small motions and its exact derivatives by the parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from bondgraph.simulation.dynamics import Model, dynamics_of
from bondgraph.support.arrays import ComplexArray, FloatArray
from bondgraph.support.errors import UnusableInput, require_known


def response_and_sensitivity(
    model: Model,
    p: FloatArray,
    source: str,
    outputs: Sequence[str],
    frequency: FloatArray,
    parameters: Sequence[str],
    bias: Mapping[str, float] | None = None,
) -> tuple[ComplexArray, ComplexArray]:
    """Return G and its derivatives from one source to some outputs.

    Parameters
    ----------
    model : BondGraph, Compiled or Dynamics
        Linear up to scalar laws: these count with their linear slope. Any other is linearised
        about the rest under `bias`; that the rest moves with the parameters is counted.
    p : ndarray, shape (n_p,), SI
    source : str
        Input.
    outputs : sequence of str
        Sensors (n_y of them).
    frequency : ndarray, shape (F,), Hz
        Positive.
    parameters : sequence of str
        n of them.
    bias : mapping of str to float, optional
        Constant commands, SI; 0 where not given.

    Returns
    -------
    response : ndarray, shape (F, n_y)
    sensitivity : ndarray, shape (F, n_y, n)

    Raises
    ------
    UnusableInput
        The model has no slope at its rest.
    """
    dynamics = dynamics_of(model)
    for kind, names, known in (
        ("input", (source, *(bias or {})), dynamics.commands),
        ("sensor", outputs, dynamics.output_names),
        ("parameter", parameters, dynamics.parameter_names),
    ):
        require_known(kind, dynamics.name, known, *names)
    if not (np.asarray(frequency) > 0.0).all():
        raise UnusableInput(f"{dynamics.name}: frequencies of a response must be positive")
    held = {n: np.full(2, (bias or {}).get(n, 0.0)) for n in dynamics.commands}
    u = dynamics.inputs(held, np.arange(2.0))[0]
    rows = [dynamics.output_names.index(o) for o in outputs]
    wanted = [dynamics.parameter_names.index(n) for n in parameters]
    s = np.asarray(2j * np.pi * np.asarray(frequency), complex)
    drive = dynamics.drive([source], s)
    small = dynamics.small_signal(p, u)
    response = small.response(s, drive)[:, rows, 0]
    slopes = dynamics.small_signal_slopes(p, u, wanted)
    sensitivity = small.response_slopes(slopes, s, drive)[:, rows, 0]
    if not (np.isfinite(response).all() and np.isfinite(sensitivity).all()):
        raise UnusableInput(
            f"{dynamics.name}: the equations have no slope at rest under these constant commands; "
            "give others in bias="
        )
    return response, sensitivity
