"""A sampled loop around the virtual actuator: controller, inverse operator, limits, sensor.

Each sample: the last measured error goes through the controller; its output is added to the
reference; the inverse operator makes a voltage of the sum; the envelope holds it; the actuator
moves. The whole loop is one compiled recursion.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np

from actuators.compensation.feedforward import Invertible, limited_inverse
from actuators.compensation.margins import OPEN, ProportionalIntegral
from actuators.compensation.recursion import run_recursion
from actuators.compensation.virtual_actuator import VirtualActuator
from actuators.stack.voltage_limits import UNIPOLAR
from bondgraph.signals.drive_limits import DriveLimits
from bondgraph.support.errors import UnusableInput
from bondgraph.support.ops import FloatArray


@dataclass(frozen=True, slots=True)
class ControlLoop:
    """What stands between reference and actuator.

    Parameters
    ----------
    model : Invertible
        V to m; its inverse makes the voltage. `linear_operator` compensates nothing.
    controller : ProportionalIntegral
        Gains in command (m) per error (m); all 0 leaves the loop open.
    feedforward : bool
        Whether the reference itself is sent through the inverse.
    envelope : DriveLimits
    sample_rate : float
        Hz.
    """

    model: Invertible
    controller: ProportionalIntegral = OPEN
    feedforward: bool = True
    envelope: DriveLimits = UNIPOLAR
    sample_rate: float = 20_000.0


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
    substeps: int | None = None,
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
    substeps : int, optional
        Steps of the actuator's integrator per sample.

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
        [np.zeros(actuator.n_states + 2), np.asarray(loop.model.initial_memory(0.0), dtype=float)]
    )
    out, _ = run_recursion(_step(loop, actuator, substeps), start, inputs)
    if not np.isfinite(out).all():
        raise UnusableInput(
            "run_loop: the loop diverged beyond all numbers; lower the gains, or raise substeps "
            "if the actuator is stiff"
        )
    clipped = loop.envelope.outside(out[:, 1] + out[:, 2])
    return LoopRun(out[:, 0], out[:, 1], clipped)


def _step(loop: ControlLoop, actuator: VirtualActuator, substeps: int | None) -> ca.Function:
    """One sample; state: actuator, sum of errors, last error, memory of the model."""
    n, n_m, dt = actuator.n_states, loop.model.n_memory, 1.0 / loop.sample_rate
    kp, ki = loop.controller.proportional, loop.controller.integral
    state, given = ca.SX.sym("state", n + 2 + n_m), ca.SX.sym("input", 3)
    plant, total, error = state[:n], state[n], state[n + 1]
    memory = tuple(state[n + 2 + i] for i in range(n_m))
    total = total + ki * dt * error
    wanted = kp * error + total + (given[1] if loop.feedforward else 0.0)
    voltage, reached, excess, after = limited_inverse(loop.model, wanted, memory, loop.envelope)
    # what could not be reached is taken back from the sum with the controller's own time constant
    unwind = min(1.0, ki * dt / kp) if kp else 1.0
    total = total + (unwind * (reached - wanted) if ki else 0.0)
    moved = actuator.step(plant, voltage, dt, substeps)
    measured = plant[1] + given[2]
    return ca.Function(
        "sample",
        [state, given],
        [
            ca.vertcat(moved, total, given[0] - measured, *after),
            ca.vertcat(plant[1], voltage, excess),
        ],
    )
