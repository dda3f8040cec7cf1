"""Compensation by the inverse of a whole stack model: hysteresis, electrics and body.

The derivatives of the reference enter analytically. Forming them by differences of samples, let
alone of a measured signal, would put peaks far above the signal into the voltage.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np

from actuators.compensation.motion import AnalyticMotion
from actuators.stack.bond_graph import stack_bond_graph
from actuators.stack.conversions import Lumped, Polarised, Pure, polarisation_operator
from actuators.stack.lumped import stack_lumped
from actuators.stack.voltage_limits import UNIPOLAR
from bondgraph import BondGraph
from bondgraph.hysteresis import AngInverse, Operator, PrandtlIshlinskii
from bondgraph.laws import Hysteretic
from bondgraph.signals.drive_limits import DriveLimits
from bondgraph.support.ops import FloatArray


@dataclass(frozen=True, slots=True)
class LumpedStack(Lumped):
    """Parameters of `actuators.stack.lumped`, with its defaults; a resistance of 0 leaves it out.

    Parameters
    ----------
    capacitance, transducer, stiffness : float
        F; N/V = C/m; short circuit, N/m.
    mass, damping, resistance : float
        kg, N s/m, ohm.
    """

    mass: float = 16e-3 / 3.0
    damping: float = 80.0
    resistance: float = 0.0

    def graph(self, hysteresis: Operator) -> BondGraph:
        """Return the model as a bond graph, with `hysteresis` (C to V) in the electrical loop."""
        values = asdict(self) | {"resistance": self.resistance or None}
        return stack_lumped(Hysteretic(hysteresis), **values)


@dataclass(frozen=True, slots=True)
class BondGraphStack(Polarised):
    """Parameters of `actuators.stack.bond_graph`, with its defaults.

    Parameters
    ----------
    transducer, length, stiffness : float
        Displacement from charge, m/C; m, a gauge; open circuit, N/m.
    mass, damping, resistance : float
        kg, N s/m, ohm.
    """

    stiffness: float = 65e6
    mass: float = 5.3e-3
    damping: float = 80.0
    resistance: float = 5.0

    def graph(self, law: Operator) -> BondGraph:
        """Return the model as a bond graph with the law ``E = law(p)``, see `field_law`."""
        return stack_bond_graph(Hysteretic(law), **asdict(self))


def lumped_feedforward(
    motion: AnalyticMotion,
    hysteresis: Operator | None,
    stack: LumpedStack | None = None,
    *,
    force: float = 0.0,
    envelope: DriveLimits = UNIPOLAR,
) -> FloatArray:
    """Return the voltage for which the lumped-parameter model follows a motion.

    ``V_t = (m x'' + b x' + k x - F_e) / T``, ``q = T x + C V_t``, ``V_in = V_t + H(q) + R_e q'``.
    The hysteresis is evaluated forward, in charge: nothing has to be inverted.

    Parameters
    ----------
    motion : AnalyticMotion
        With a resistance its jerk enters through q', so the acceleration must be continuous.
    hysteresis : Operator or None
        H, charge (C) to voltage (V), such as ``MaxwellResistiveCapacitor.stack_2hz()``.
        Virgin at the first charge.
    stack : LumpedStack, optional
    force : float
        Constant external force F_e, N.
    envelope : DriveLimits

    Returns
    -------
    ndarray, shape (N,), V
        Where the acceleration jumps by A it steps by ``(m A / T) (1 + C dH/dq)``.

    Raises
    ------
    VoltageLimit
        If the motion asks for a voltage outside the envelope.

    References
    ----------
    Stack actuator thesis, section 7.3 and eq. (5.1).
    """
    s = stack or LumpedStack()
    v_t = (s.mass * motion.a + s.damping * motion.v + s.stiffness * motion.x - force) / s.transducer
    charge = s.transducer * motion.x + s.capacitance * v_t
    rate = (s.mass * motion.j + s.damping * motion.a + s.stiffness * motion.v) / s.transducer
    current = s.transducer * motion.v + s.capacitance * rate
    v_h = np.zeros_like(v_t) if hysteresis is None else hysteresis.run(charge)[0]
    return envelope.require(v_t + v_h + s.resistance * current, "lumped feedforward")


def bond_graph_feedforward(
    motion: AnalyticMotion,
    law: Operator,
    stack: BondGraphStack | None = None,
    *,
    envelope: DriveLimits = UNIPOLAR,
) -> FloatArray:
    """Return the voltage for which the general bond graph model follows a motion.

    With ``p = (l/T) (x + (m x'' + R x')/k)``::

        V_in = l E_C(p) + T (m x'' + R x') + (R_e/l) p'

    Parameters
    ----------
    motion : AnalyticMotion
        Its jerk enters through p'. If the acceleration jumps, p jumps too, which takes an impulse
        of voltage as long as R_e > 0: use `smooth_reference`.
    law : Operator
        E_C, dipole (C m) to field (V/m), see `field_law`; virgin at the first dipole.
    stack : BondGraphStack, optional
    envelope : DriveLimits

    Returns
    -------
    ndarray, shape (N,), V

    References
    ----------
    Stack actuator thesis, eq. (5.4).
    """
    s = stack or BondGraphStack()
    load = s.mass * motion.a + s.damping * motion.v
    load_rate = s.mass * motion.j + s.damping * motion.a
    per_metre = s.length / s.transducer
    dipole = per_metre * (motion.x + load / s.stiffness)
    dipole_rate = per_metre * (motion.v + load_rate / s.stiffness)
    field, _ = law.run(dipole)
    voltage = s.length * field + s.transducer * load + s.resistance / s.length * dipole_rate
    return envelope.require(voltage, "bond graph feedforward")


def field_law(
    operator: Pure, stack: BondGraphStack | None = None
) -> PrandtlIshlinskii | AngInverse:
    """Return ``E_C(p)`` for which the free stack at rest is `operator`: `polarisation_operator`.

    `stack` gives T and l.
    """
    return polarisation_operator(operator, stack)
