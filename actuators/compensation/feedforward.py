"""Compensation by the exact inverse of a hysteresis operator (thesis section 7.2).

The electro-mechanics are neglected: the actuator is its operator, voltage in, displacement out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from actuators.compensation.recursion import run_recursion
from actuators.stack.voltage_limits import UNIPOLAR
from bondgraph.hysteresis import Memory, PrandtlIshlinskii
from bondgraph.hysteresis.checks import finite_record
from bondgraph.hysteresis.invertible import InvertibleOperator
from bondgraph.signals.drive_limits import DriveLimits
from bondgraph.support.ops import CASADI, Expression, FloatArray

Invertible: TypeAlias = InvertibleOperator[Any]
"""An operator with an exact inverse, such as Al Janaideh's or Ang's."""


def feedforward(
    operator: Invertible,
    x_ref: ArrayLike,
    memory: Sequence[Expression] | None = None,
    *,
    envelope: DriveLimits = UNIPOLAR,
) -> FloatArray:
    """Return the voltage for which `operator`, starting from `memory`, gives `x_ref`.

    Parameters
    ----------
    operator : Invertible
        Model of the actuator, V to m.
    x_ref : array, shape (N,), m
    memory : sequence of float, optional
        Memory of `operator` before the first sample; virgin at 0 V when not given. An actuator
        that has been used is not virgin, and the inverse is exact only with its true memory.
    envelope : DriveLimits
        Voltages the actuator may see.

    Returns
    -------
    ndarray, shape (N,), V

    Raises
    ------
    VoltageLimit
        If the reference asks for a voltage outside the envelope; nothing is clipped.
    NotInvertible
        If the operator has no inverse.

    References
    ----------
    krejci2001, kuhnen2003; stack actuator thesis, eq. (7.1) and (7.2), which leave out the
    inverse envelope and the initial states.

    Examples
    --------
    >>> model = PrandtlIshlinskii((0.0, 1.0), (50e-9, 10e-9))
    >>> feedforward(model, [0.0, 110e-9]).round(9).tolist()
    [0.0, 2.0]
    """
    start = operator.initial_memory(0.0) if memory is None else memory
    voltage, _ = operator.inverse().run(x_ref, operator.inverse_memory(start))
    return envelope.require(voltage, "feedforward")


@dataclass(frozen=True, slots=True)
class LimitedFeedforward:
    """A command held within the envelope, and what that costs.

    Attributes
    ----------
    voltage : ndarray, shape (N,), V
    reached : ndarray, shape (N,), m
        What the model gives for it; the reference wherever nothing was clipped.
    clipped : ndarray of bool, shape (N,)
    memory : tuple of float
        Memory of the operator after the last sample.
    """

    voltage: FloatArray
    reached: FloatArray
    clipped: np.ndarray
    memory: tuple[float, ...]


def limited_inverse(
    operator: Invertible, wanted: Expression, memory: Memory, envelope: DriveLimits
) -> tuple[Expression, Expression, Expression, Memory]:
    """Return one step of the inverse whose memory follows the voltage that is really applied.

    An inverse that goes on with the voltage it asked for, not the one that was applied, is wrong
    ever after, because the actuator never turned where the inverse believes it did.

    Parameters
    ----------
    operator : Invertible
    wanted : expression
        Displacement asked for, m (CasADi).
    memory : tuple of expression
        Memory of `operator`, not of its inverse.
    envelope : DriveLimits

    Returns
    -------
    voltage, reached, excess : expression
        V, m, and by how many V the limits were exceeded.
    memory : tuple of expression
    """
    asked = operator.inverse().value(CASADI, wanted, operator.inverse_memory(memory))
    voltage = ca.fmin(ca.fmax(asked, envelope.low), envelope.high)
    reached = operator.value(CASADI, voltage, memory)
    return voltage, reached, asked - voltage, operator.advance(CASADI, voltage, memory)


def limited_feedforward(
    operator: Invertible,
    x_ref: ArrayLike,
    *,
    envelope: DriveLimits = UNIPOLAR,
) -> LimitedFeedforward:
    """Return the command of `feedforward` held within the envelope, with its clipped samples.

    The operator starts virgin at 0 V.

    Parameters
    ----------
    operator, x_ref, envelope
        As in `feedforward`.

    Returns
    -------
    LimitedFeedforward
        Exact again as soon as the reference can be reached again.

    Examples
    --------
    >>> model = PrandtlIshlinskii((0.0, 1.0), (50e-9, 10e-9))
    >>> limited = limited_feedforward(model, [0.0, 7e-6, 1e-6])
    >>> limited.clipped.tolist()
    [False, True, False]
    >>> round(1e9 * float(limited.reached[2]))
    1000
    """
    z, wanted = ca.SX.sym("z", operator.n_memory), ca.SX.sym("x")
    states = tuple(z[i] for i in range(operator.n_memory))
    voltage, reached, excess, after = limited_inverse(operator, wanted, states, envelope)
    step = ca.Function(
        "limited", [z, wanted], [ca.vertcat(*after), ca.vertcat(voltage, reached, excess)]
    )
    record = finite_record(x_ref)[:, None]
    start = np.asarray(operator.initial_memory(0.0), dtype=float)
    out, last = run_recursion(step, start, record)
    clipped = envelope.outside(out[:, 0] + out[:, 2])
    return LimitedFeedforward(out[:, 0], out[:, 1], clipped, tuple(last.tolist()))


def linear_operator(gain: float) -> PrandtlIshlinskii:
    """Return the actuator as a plain gain (m/V): compensation that knows of no hysteresis."""
    return PrandtlIshlinskii((0.0,), (gain,))
