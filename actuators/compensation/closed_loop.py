"""A sampled loop around the virtual actuator: controller, inverse operator, limits, sensor.

Each sample: the last measured error goes through the controller; its output is added to the
reference; the inverse operator makes a voltage of the sum; the envelope holds it; the actuator
moves. The whole loop is one compiled recursion.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np

from actuators.compensation.adaptive_inverse import AdaptiveInverse
from actuators.compensation.feedforward import Invertible, limited_inverse
from actuators.compensation.margins import OPEN, ProportionalIntegral
from actuators.compensation.recursion import run_recursion
from actuators.compensation.sliding_mode import SlidingMode
from actuators.compensation.virtual_actuator import VirtualActuator
from actuators.stack.voltage_limits import UNIPOLAR
from bondgraph.signals.drive_limits import DriveLimits
from bondgraph.support.errors import UnusableInput
from bondgraph.support.ops import FloatArray

SAMPLE_RATE = 20_000.0
"""Hz."""


@dataclass(frozen=True, slots=True)
class ControlLoop:
    """What stands between reference and actuator.

    Parameters
    ----------
    model : Invertible or AdaptiveInverse
        V to m; its inverse makes the voltage. `linear_operator` compensates nothing.
    controller : ProportionalIntegral or SlidingMode
        Gains in command (m) per error (m); all 0 leaves the loop open.
    feedforward : bool
        Whether the reference itself is sent through the inverse.
    envelope : DriveLimits
    sample_rate : float
        Hz.
    """

    model: Invertible | AdaptiveInverse
    controller: ProportionalIntegral | SlidingMode = OPEN
    feedforward: bool = True
    envelope: DriveLimits = UNIPOLAR
    sample_rate: float = SAMPLE_RATE


@dataclass(frozen=True, slots=True)
class LoopRun:
    """Result of `run_loop`.

    Attributes
    ----------
    x : ndarray, shape (N,), m
        True displacement at the samples.
    voltage : ndarray, shape (N,), V
        Applied from each sample to the next.
    clipped : ndarray of bool, shape (N,)
        Where the envelope held the voltage back.
    """

    x: FloatArray
    voltage: FloatArray
    clipped: np.ndarray


def run_loop(
    loop: ControlLoop,
    actuator: VirtualActuator,
    reference: FloatArray,
    noise: FloatArray | None = None,
    *,
    preview: FloatArray | None = None,
) -> LoopRun:
    """Run a loop from rest at 0 V, actuator and inverse virgin.

    Parameters
    ----------
    loop : ControlLoop
    actuator : VirtualActuator
    reference : ndarray, shape (N,), m
        At the samples.
    noise : ndarray, shape (N,), m, optional
        Added to the measured displacement.
    preview : ndarray, shape (N,), m, optional
        The reference that the feedforward uses, such as the one half a sample later, which undoes
        the delay of the hold; `reference` when not given.

    Returns
    -------
    LoopRun

    Raises
    ------
    UnusableInput
        If the records are not finite or differ in length.
    """
    disturbance = np.zeros(reference.size) if noise is None else noise
    ahead = reference if preview is None else preview
    if not (reference.shape == disturbance.shape == ahead.shape and reference.ndim == 1):
        raise UnusableInput("run_loop: reference, noise and preview must be records of one length")
    inputs = np.column_stack([reference, ahead, disturbance])
    if not np.isfinite(inputs).all():
        raise UnusableInput("run_loop: reference, noise and preview must be finite")
    start = np.concatenate(
        [np.zeros(actuator.n_states + 2 + loop.controller.n_states), _model_start(loop)]
    )
    out, _ = run_recursion(_step(loop, actuator), start, inputs)
    if not np.isfinite(out).all():
        raise UnusableInput("run_loop: the loop diverged beyond all numbers; lower the gains")
    clipped = loop.envelope.outside(out[:, 1] + out[:, 2])
    return LoopRun(out[:, 0], out[:, 1], clipped)


def _step(loop: ControlLoop, actuator: VirtualActuator) -> ca.Function:
    """One sample; state: actuator, last error, last reading, controller, model."""
    n, dt, model, controller = (
        actuator.n_states,
        1.0 / loop.sample_rate,
        loop.model,
        loop.controller,
    )
    first = n + 2 + controller.n_states
    state, given = ca.SX.sym("state", first + _model_start(loop).size), ca.SX.sym("input", 3)
    plant, error, reading = state[:n], state[n], state[n + 1]
    added, decided = controller.decide(error, state[n + 2 : first], dt)
    wanted = added + (given[1] if loop.feedforward else 0.0)
    if isinstance(model, AdaptiveInverse):
        voltage, reached, excess, after = model.step(
            wanted, reading, state[first:], loop.envelope, dt
        )
    else:
        memory = tuple(state[first + i] for i in range(model.n_memory))
        voltage, reached, excess, advanced = limited_inverse(model, wanted, memory, loop.envelope)
        after = ca.vertcat(*advanced)
    decided = controller.unwound(decided, reached - wanted, dt)
    moved = actuator.step(plant, voltage, dt)
    measured = plant[1] + given[2]
    return ca.Function(
        "sample",
        [state, given],
        [
            ca.vertcat(moved, given[0] - measured, measured, decided, after),
            ca.vertcat(plant[1], voltage, excess),
        ],
    )


def _model_start(loop: ControlLoop) -> FloatArray:
    if isinstance(loop.model, AdaptiveInverse):
        return loop.model.start
    return np.asarray(loop.model.initial_memory(0.0), dtype=float)
