"""Frequency response of a model's linear rest and its exact derivatives by the parameters."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bondgraph.simulation.first_order_hold import blocks
from bondgraph.simulation.lure import Compiled
from bondgraph.support.arrays import ComplexArray, FloatArray
from bondgraph.support.errors import UnusableInput, unknown_name


def response_and_sensitivity(
    compiled: Compiled,
    p: FloatArray,
    source: str,
    outputs: Sequence[str],
    frequency: FloatArray,
    parameters: Sequence[str],
) -> tuple[ComplexArray, ComplexArray]:
    """Return G and its derivatives from one source to some outputs.

    With ``X = (j w - A)^-1 B``: ``G = C X + D`` and
    ``dG = dC X + dD + C (j w - A)^-1 (dA X + dB)``. Laws count with their linear slope.

    Parameters
    ----------
    compiled : Compiled
    p : ndarray, shape (n_p,), SI
    source : str
        Input.
    outputs : sequence of str
        Sensors (n_y of them).
    frequency : ndarray, shape (F,), Hz
        Positive.
    parameters : sequence of str
        n of them.

    Returns
    -------
    response : ndarray, shape (F, n_y)
    sensitivity : ndarray, shape (F, n_y, n)
    """
    space = compiled.space
    if source not in space.input_names:
        raise unknown_name("input", source, space.name, space.input_names)
    for o in outputs:
        if o not in space.output_names:
            raise unknown_name("sensor", o, space.name, space.output_names)
    for n in parameters:
        if n not in compiled.parameter_names:
            raise unknown_name("parameter", n, space.name, compiled.parameter_names)
    if not (np.asarray(frequency) > 0.0).all():
        raise UnusableInput(f"{space.name}: frequencies of a response must be positive")
    column = list(space.input_names).index(source)
    rows = [list(space.output_names).index(o) for o in outputs]
    block = np.asarray(compiled.matrices(p).full(), float)
    jacobian = np.asarray(compiled.matrices_jacobian(p).full(), float)
    at = [compiled.parameter_names.index(n) for n in parameters]
    a, b, c, d = _parts(compiled, block, column, rows)
    tangents = [
        _parts(compiled, jacobian[:, i].reshape(block.shape, order="F"), column, rows) for i in at
    ]
    identity = np.eye(compiled.n_x)
    resolvent = 2j * np.pi * np.asarray(frequency)[:, None, None] * identity - a
    x = np.linalg.solve(resolvent, np.broadcast_to(b[:, None], (*resolvent.shape[:2], 1)))[:, :, 0]
    response = x @ c.T + d
    # C (j w - A)^-1 once, for all parameters
    left = np.linalg.solve(
        resolvent.transpose(0, 2, 1), np.broadcast_to(c.T, (*resolvent.shape[:2], len(rows)))
    )
    sensitivity = np.empty((*response.shape, len(at)), complex)
    for i, (da, db, dc, dd) in enumerate(tangents):
        inner = x @ da.T + db
        sensitivity[:, :, i] = x @ dc.T + dd + np.einsum("fxy,fx->fy", left, inner)
    return response, sensitivity


def _parts(
    compiled: Compiled, block: FloatArray, column: int, rows: list[int]
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    parts = blocks(compiled, block)
    return (
        np.asarray(parts.a), np.asarray(parts.b[:, column]), np.asarray(parts.cy[rows]),
        np.asarray(parts.dy[rows, column]),
    )  # fmt: skip
