"""Actuators that deviate from their model, and the ways of driving them that are compared."""

from __future__ import annotations

from dataclasses import replace

from actuators.compensation.adaptive_inverse import AdaptiveInverse
from actuators.compensation.closed_loop import ControlLoop
from actuators.compensation.feedforward import linear_operator
from actuators.compensation.margins import OPEN, ProportionalIntegral
from actuators.compensation.model_inverse import (
    BondGraphStack,
    LumpedStack,
    bond_graph_feedforward,
    field_law,
    lumped_feedforward,
)
from actuators.compensation.motion import AnalyticMotion
from actuators.compensation.sliding_mode import sliding_like
from actuators.compensation.virtual_actuator import VirtualActuator
from bondgraph.hysteresis import AlJanaideh, Ang, MaxwellResistiveCapacitor
from bondgraph.support.ops import FloatArray

CREEP_RATIOS, CREEP_TIMES = (0.02, 0.02, 0.02), (0.05, 0.5, 5.0)
AMPLIFIER_TIME = 80e-6
SLIP_RATE = 3e-4
"""C/A: at 50 Hz and full stroke the limits widen by 7 uC, about 10 % of the half stroke."""
REFITTED_TRANSDUCER = 3.83
"""N/V; with the printed 3.52 the Maxwell elements of table 6.4 miss the stroke by 8 %."""


def actuator_like(model: AlJanaideh) -> VirtualActuator:
    """Return the virtual actuator that has the loop of `model` at rest."""
    inverse = model.inverse()
    return VirtualActuator.from_loop(inverse.thresholds, inverse.weights)


def stack_of(actuator: VirtualActuator) -> BondGraphStack:
    """Return the electrics and the body of an actuator as the bond graph model has them."""
    a = actuator
    return BondGraphStack(
        transducer=a.transducer, stiffness=a.stiffness, mass=a.mass, damping=a.damping,
        resistance=a.resistance,
    )  # fmt: skip


def deviating(
    nominal: VirtualActuator, seed: int = 1, spread: float = 0.1
) -> dict[str, VirtualActuator]:
    """Return actuators by what they have and their model has not.

    Parameters
    ----------
    nominal : VirtualActuator
    seed : int
        Of the draw of weights and thresholds.
    spread : float
        Relative; 0.1 draws within +-10 %.

    Returns
    -------
    dict of str to VirtualActuator
        Nothing; other weights and thresholds; creep, 2 % of the stroke a unit at 0.05, 0.5 and
        5 s; an amplifier of 80 us (2 kHz); a loop that grows with the rate; all of these.
    """
    aged = nominal.aged(seed, spread)
    creeping = replace(nominal, creep_ratios=CREEP_RATIOS, creep_times=CREEP_TIMES)
    all_of_it = replace(
        aged,
        creep_ratios=CREEP_RATIOS,
        creep_times=CREEP_TIMES,
        amplifier_time=AMPLIFIER_TIME,
        slip_rate=SLIP_RATE,
    )
    return {
        "as modelled": nominal,
        f"+-{100.0 * spread:.3g} %": aged,
        "creep": creeping,
        "amplifier": replace(nominal, amplifier_time=AMPLIFIER_TIME),
        "rate": replace(nominal, slip_rate=SLIP_RATE),
        "all": all_of_it,
    }


def strategies(
    model: AlJanaideh,
    other: Ang,
    linear_gain: float,
    controller: ProportionalIntegral,
) -> dict[str, ControlLoop]:
    """Return the open and closed loops that are compared.

    Parameters
    ----------
    model, other : AlJanaideh, Ang
        Two models of the same actuator.
    linear_gain : float
        m/V, of the compensation that knows of no hysteresis.
    controller : ProportionalIntegral
    """
    linear, off = linear_operator(linear_gain), OPEN
    return {
        "linear feedforward": ControlLoop(linear, off),
        "Al Janaideh inverse": ControlLoop(model, off),
        "Ang inverse": ControlLoop(other, off),
        "PI alone": ControlLoop(linear, controller, False),
        "PI + linear": ControlLoop(linear, controller),
        "PI + inverse": ControlLoop(model, controller),
        "sliding + inverse": ControlLoop(model, sliding_like(controller)),
        "adaptive inverse": ControlLoop(AdaptiveInverse(model), off),
        "PI + adaptive": ControlLoop(AdaptiveInverse(model), controller),
    }


def model_voltages(
    model: AlJanaideh, nominal: VirtualActuator, motion: AnalyticMotion
) -> dict[str, FloatArray]:
    """Return the voltages, shape (N,), by which the inverses of whole models follow a motion.

    Parameters
    ----------
    model : AlJanaideh
        Gives the polarisation law of the bond graph model.
    nominal : VirtualActuator
        Gives the body, and the electrics of the bond graph model. The lumped model has the Maxwell
        elements of table 6.4, identified on another record, so it fits less well.
    motion : AnalyticMotion
    """
    stack = stack_of(nominal)
    lumped = LumpedStack(transducer=REFITTED_TRANSDUCER, mass=nominal.mass, damping=nominal.damping)
    maxwell = MaxwellResistiveCapacitor.stack_2hz()
    law = field_law(model, stack)
    return {
        "bond graph inverse": bond_graph_feedforward(motion, law, stack),
        "lumped inverse": lumped_feedforward(motion, maxwell, lumped),
    }
