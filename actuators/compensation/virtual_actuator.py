"""A virtual stack to try controllers on, in its own equations and compiled.

It shares nothing with the compensators but physics: its hysteresis is a bank of slipping elements
in the charge, not plays on the voltage; creep, lead, amplifier and body are differential equations.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, Self

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from actuators.compensation.recursion import run_recursion
from bondgraph.hysteresis.checks import finite_record
from bondgraph.support.errors import UnusableInput
from bondgraph.support.ops import FloatArray

PAYLOAD = 0.108
RATE_MEMORY = 1e-3
LONGEST = 2.5
"""Sub-step times fastest pole; the method is unstable from 2.8 on."""


@dataclass(frozen=True, slots=True)
class VirtualActuator:
    """A stack behind an amplifier and a lead, moving a payload.

    ::

        V_C    = (q - sum s_j)/C + sum g_i z_i      z_i: stretch in q, slips at its limit
        tau_j s_j' = ratio_j (q - sum s_j) - s_j    Kelvin-Voigt units in the dielectric
        R_e q' = w - V_C + T F,   F = k (x - T q)   tau w' = V_in - w
        m x''  = -F - b x'

    With `slip_rate` the limits widen with the current, ``limit_i + slip_rate |q'|`` smoothed over
    `RATE_MEMORY`, so the loop itself grows with the rate. Without it the slipping elements know no
    rate; creep, lead, amplifier and body do.

    Parameters
    ----------
    capacitance : float
        C, of the part that never slips, F.
    slip_gains : tuple of float
        g_i, V/C.
    slip_limits : tuple of float
        Charges at which the elements slip, C.
    transducer : float
        T, m/C.
    stiffness : float
        Open circuit, N/m.
    mass : float
        With payload, kg.
    damping : float
        N s/m.
    resistance : float
        ohm.
    creep_ratios : tuple of float
        Slow charge per fast charge in the end.
    creep_times : tuple of float
        s.
    amplifier_time : float
        Time constant of the amplifier, s; 0 leaves it out.
    slip_rate : float
        Widening of the limits per current, C/A.
    """

    capacitance: float
    slip_gains: tuple[float, ...]
    slip_limits: tuple[float, ...]
    transducer: float = 0.036
    stiffness: float = 60e6
    mass: float = PAYLOAD
    damping: float = 200.0
    resistance: float = 20.0
    creep_ratios: tuple[float, ...] = ()
    creep_times: tuple[float, ...] = ()
    amplifier_time: float = 0.0
    slip_rate: float = 0.0

    def __post_init__(self) -> None:
        """Check the lengths."""
        for a, b in (("slip_gains", "slip_limits"), ("creep_ratios", "creep_times")):
            if len(getattr(self, a)) != len(getattr(self, b)):
                raise UnusableInput(f"VirtualActuator: {a} and {b} differ in length")

    @classmethod
    def from_loop(
        cls, thresholds: tuple[float, ...], weights: tuple[float, ...], transducer: float = 0.036
    ) -> Self:
        """Return the actuator whose voltage from displacement at rest is a given sum of plays.

        ``sum w_i play_(r_i)[x]`` with negative w_i from i = 1 on is a spring ``sum w_i`` beside
        slipping elements ``-w_i``.

        Parameters
        ----------
        thresholds, weights : tuple of float
            m and V/m, shape (n + 1,), the first threshold 0: an inverse operator's parameters.
        transducer : float
            m/C.
        """
        return cls(
            capacitance=1.0 / (sum(weights) * transducer),
            slip_gains=tuple(-w * transducer for w in weights[1:]),
            slip_limits=tuple(r / transducer for r in thresholds[1:]),
            transducer=transducer,
        )

    def aged(self, seed: int, spread: float) -> VirtualActuator:
        """Return a sibling with capacitance, gains and limits drawn within +- `spread`."""
        n = len(self.slip_gains)
        d = 1.0 + np.random.default_rng(seed).uniform(-spread, spread, 2 * n + 1)
        return replace(
            self,
            capacitance=self.capacitance * float(d[-1]),
            slip_gains=tuple(float(v) for v in d[:n] * self.slip_gains),
            slip_limits=tuple(float(v) for v in d[n:-1] * self.slip_limits),
        )

    @property
    def n_states(self) -> int:
        """Number of states: q, x, v, w, s_j, smoothed current, z_i."""
        return 5 + len(self.creep_ratios) + len(self.slip_gains)

    @property
    def fastest(self) -> float:
        """Largest modulus of the poles for small signals, 1/s."""
        return float(np.abs(np.linalg.eigvals(self.linear_model(slipping=False)[0])).max())

    def substeps(self, duration: float) -> int:
        """Return how many integrator steps a sample of `duration` s takes by default.

        None is longer than the fastest time constant.
        """
        return math.ceil(duration * self.fastest)

    def step(self, state: Any, voltage: Any, duration: float, substeps: int | None = None) -> Any:
        """Return the state after a held voltage, CasADi in and out, by Runge and Kutta's method.

        Parameters
        ----------
        state : casadi expression, shape (n_states,)
        voltage : casadi expression
            V.
        duration : float
            s.
        substeps : int, optional
            Steps of the integrator; `substeps` of `duration` when not given.

        Raises
        ------
        UnusableInput
            If the sub-steps are too long for the fastest time constant.
        """
        count = self.substeps(duration) if substeps is None else substeps
        h = duration / count
        if h * self.fastest > LONGEST:
            raise UnusableInput(
                f"VirtualActuator: {count} sub-steps of {duration:.3g} s are too long for its "
                f"{1.0 / self.fastest:.2g} s; take {self.substeps(duration)}"
            )
        for _ in range(count):
            state = self._substep(state, voltage, h)
        return state

    def _substep(self, y: Any, u: Any, h: float) -> Any:
        n = 5 + len(self.creep_ratios)
        flow, stretch = y[:n], y[n:]
        limits = ca.DM(self.slip_limits) + self.slip_rate * y[n - 1]

        def slipped(q: Any) -> Any:
            return ca.fmin(ca.fmax(stretch + (q - y[0]), -limits), limits)

        def rate(f: Any) -> Any:
            slow = f[4 : n - 1]
            fast = f[0] - ca.sum1(slow)
            effort = fast / self.capacitance + ca.dot(ca.DM(self.slip_gains), slipped(f[0]))
            force = self.stiffness * (f[1] - self.transducer * f[0])
            drive = f[3] if self.amplifier_time else u
            current = (drive - effort + self.transducer * force) / self.resistance
            lag = (u - f[3]) / self.amplifier_time if self.amplifier_time else 0.0
            creep = (ca.DM(self.creep_ratios) * fast - slow) / ca.DM(self.creep_times)
            body = -(force + self.damping * f[2]) / self.mass
            smoothed = (ca.fabs(current) - f[n - 1]) / RATE_MEMORY
            return ca.vertcat(current, f[2], body, lag, creep, smoothed)

        a = rate(flow)
        b = rate(flow + 0.5 * h * a)
        c = rate(flow + 0.5 * h * b)
        d = rate(flow + h * c)
        end = flow + h / 6.0 * (a + 2.0 * b + 2.0 * c + d)
        return ca.vertcat(end, slipped(end[0]))

    def run(
        self, voltage: ArrayLike, sample_rate: float, *, substeps: int | None = None
    ) -> FloatArray:
        """Return the displacement at the samples, from rest at 0 V and virgin.

        Parameters
        ----------
        voltage : array, shape (N,), V
            Held from each sample to the next.
        sample_rate : float
            Hz.
        substeps : int, optional
            Steps of the integrator per sample.

        Returns
        -------
        ndarray, shape (N,), m
        """
        y, u = ca.SX.sym("y", self.n_states), ca.SX.sym("u")
        after = self.step(y, u, 1.0 / sample_rate, substeps)
        record = finite_record(voltage)[:, None]
        x, _ = run_recursion(
            ca.Function("plant", [y, u], [after, y[1]]), np.zeros(self.n_states), record
        )
        return x[:, 0]

    def linear_model(self, *, slipping: bool) -> tuple[FloatArray, FloatArray]:
        """Return A and b of the model for small signals, states q, x, v; creep left out.

        Parameters
        ----------
        slipping : bool
            True: every element slips, as deep in a stroke; False: none does, as after a reversal.

        Returns
        -------
        A : ndarray, shape (3, 3) or (4, 4) with the amplifier as last state
        b : ndarray, shape (3,) or (4,)
        """
        elastance = 1.0 / self.capacitance + (0.0 if slipping else sum(self.slip_gains))
        t, k, r, m = self.transducer, self.stiffness, self.resistance, self.mass
        a = np.array(
            [
                [-(elastance + k * t * t) / r, t * k / r, 0.0],
                [0.0, 0.0, 1.0],
                [k * t / m, -k / m, -self.damping / m],
            ]
        )
        b = np.array([1.0 / r, 0.0, 0.0])
        if not self.amplifier_time:
            return a, b
        pole = 1.0 / self.amplifier_time
        wide = np.block([[a, b[:, None]], [np.zeros((1, 3)), np.array([[-pole]])]])
        return wide, np.array([0.0, 0.0, 0.0, pole])
