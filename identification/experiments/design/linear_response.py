"""Frequency response of a model's small motions and its exact derivatives by the parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from bondgraph.support.arrays import ComplexArray, FloatArray
from bondgraph.support.errors import UnusableInput, require_known
from identification.study.engine import Model, engine_of


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
    model : BondGraph, Compiled or Engine
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
    engine = engine_of(model)
    for kind, names, known in (
        ("input", (source, *(bias or {})), engine.commands),
        ("sensor", outputs, engine.output_names),
        ("parameter", parameters, engine.parameter_names),
    ):
        require_known(kind, engine.name, known, *names)
    if not (np.asarray(frequency) > 0.0).all():
        raise UnusableInput(f"{engine.name}: frequencies of a response must be positive")
    held = {n: np.full(2, (bias or {}).get(n, 0.0)) for n in engine.commands}
    u = engine.inputs(held, np.arange(2.0))[0]
    rows = [engine.output_names.index(o) for o in outputs]
    wanted = [engine.parameter_names.index(n) for n in parameters]
    s = np.asarray(2j * np.pi * np.asarray(frequency), complex)
    drive = engine.drive([source], s)
    small = engine.small_signal(p, u)
    response = small.response(s, drive)[:, rows, 0]
    slopes = engine.small_signal_slopes(p, u, wanted)
    sensitivity = small.response_slopes(slopes, s, drive)[:, rows, 0]
    if not (np.isfinite(response).all() and np.isfinite(sensitivity).all()):
        raise UnusableInput(
            f"{engine.name}: the equations have no slope at rest under these constant commands; "
            "give others in bias="
        )
    return response, sensitivity
