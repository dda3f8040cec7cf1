"""How exact the inverses are when the actuator is their own model."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from actuators.compensation.feedforward import Invertible, feedforward
from actuators.compensation.model_inverse import (
    BondGraphStack,
    LumpedStack,
    bond_graph_feedforward,
    lumped_feedforward,
)
from actuators.compensation.motion import AnalyticMotion
from actuators.stack.voltage_limits import UNIPOLAR
from bondgraph import BondGraph, simulate
from bondgraph.hysteresis import Operator
from bondgraph.signals.drive_limits import DriveLimits
from bondgraph.support.ops import Expression, FloatArray

ACCURACY = 1e-7


def operator_residual(
    operator: Operator,
    inverse_of: Invertible,
    x_ref: FloatArray,
    memory: Sequence[Expression],
    believed: Sequence[Expression] | None = None,
    *,
    envelope: DriveLimits = UNIPOLAR,
) -> tuple[FloatArray, FloatArray]:
    """Return the voltage of the inverse and what is left of the reference behind an operator.

    Parameters
    ----------
    operator : Operator
        The actuator, V to m.
    inverse_of : Invertible
        The model that is inverted.
    x_ref : ndarray, shape (N,), m
    memory : sequence of float
        Memory of the actuator.
    believed : sequence of float, optional
        What the compensation takes it for; `memory` when not given.
    envelope : DriveLimits

    Returns
    -------
    voltage : ndarray, shape (N,), V
    residual : ndarray, shape (N,), m
        Displacement less reference.
    """
    known = memory if believed is None else believed
    voltage = feedforward(inverse_of, x_ref, known, envelope=envelope)
    return voltage, operator.run(voltage, memory)[0] - x_ref


def lumped_residual(motion: AnalyticMotion, hysteresis: Operator, stack: LumpedStack) -> FloatArray:
    """Return what the simulated lumped-parameter model leaves of a motion, shape (N,), m.

    The simulation starts at rest and takes the voltage as linear between the samples, which is
    the only error besides that of its integrator: it falls with the square of the sample step.
    """
    voltage = lumped_feedforward(motion, hysteresis, stack)
    return _left(stack.graph(hysteresis), motion, voltage, 4 if stack.resistance else 2)


def bond_graph_residual(motion: AnalyticMotion, law: Operator, stack: BondGraphStack) -> FloatArray:
    """Return what the simulated general bond graph model leaves of a motion, shape (N,), m."""
    voltage = bond_graph_feedforward(motion, law, stack)
    return _left(stack.graph(law), motion, voltage, 3)


def _left(graph: BondGraph, motion: AnalyticMotion, voltage: FloatArray, n_x: int) -> FloatArray:
    start = np.zeros(n_x)
    run = simulate(
        graph, motion.time, {"V_in": voltage}, x0=start, accuracy=ACCURACY, hold="linear"
    )
    return np.asarray(run["x"] - motion.x)


def voltage_steps(
    reference: Callable[[FloatArray, float], AnalyticMotion],
    frequency: float,
    hysteresis: Operator,
    stack: LumpedStack,
) -> tuple[float, float]:
    """Return how far the inverse of the lumped model steps at t = 0 and after half a period, V.

    Parameters
    ----------
    reference : callable
        `thesis_reference` or `smooth_reference`.
    frequency : float
        Hz.
    hysteresis : Operator
    stack : LumpedStack
    """
    half = 0.5 / frequency
    before = np.append(np.linspace(0.0, half, 1000, endpoint=False), np.nextafter(half, 0.0))
    voltage = lumped_feedforward(reference(np.append(before, half), frequency), hysteresis, stack)
    return float(voltage[0]), float(voltage[-1] - voltage[-2])
