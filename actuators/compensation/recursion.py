"""Recursions over whole records in CasADi's virtual machine instead of in Python."""

from __future__ import annotations

import casadi as ca
import numpy as np

from bondgraph.support.ops import FloatArray


def run_recursion(
    step: ca.Function, state: FloatArray, inputs: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Run ``state, output = step(state, input)`` over a record.

    Parameters
    ----------
    step : casadi.Function
        From (n_state,) and (n_input,) to (n_state,) and (n_output,).
    state : ndarray, shape (n_state,)
        Before the first sample.
    inputs : ndarray, shape (N, n_input), N >= 1

    Returns
    -------
    ndarray, shape (N, n_output)
    ndarray, shape (n_state,)
        After the last sample.
    """
    many = step.mapaccum("record", inputs.shape[0])
    states, outputs = many(ca.DM(state), ca.DM(inputs.T))
    return np.asarray(outputs.full()).T, np.asarray(states[:, -1].full()).ravel()
