"""A hardening spring fitted by this package, by SciPy and by CasADi's multiple shooting."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from statistics import median
from typing import Any

import casadi as ca
import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import least_squares

from bondgraph import BondGraph, C, Dq, I, One, R, Se
from bondgraph.laws import Polynomial
from bondgraph.signals.recording import Recording, Split
from bondgraph.simulation.simulate import simulate
from bondgraph.support.arrays import Array
from identification.estimation import NO_NUISANCES, Study, estimate

RATE = 100.0
NOISE = 2e-4
START = {"m": 0.5, "d": 1.0, "k": 100.0, "a_3_k": 15.0}
TRUTH = {"m": 0.6, "d": 1.3, "k": 120.0, "a_3_k": 25.0}
HALF = 0.2
"""Displacement at which the cubic force is ``a_3_k``, m."""
TOLERANCE = 1e-7
"""Of solve_ivp, relative; absolute a thousandth of the noise; with 1e-5 it ends elsewhere."""
SCALE = np.array(list(START.values()))


@dataclass(frozen=True)
class Fitted:
    """What a tool found, in what time."""

    values: dict[str, float]
    rms: float
    wall: float
    processor: float
    iterations: int


def duffing() -> BondGraph:
    """Return ``m x'' + d x' + k x + a_3 (x / half)^3 = F`` with its start values."""
    with BondGraph("duffing") as g:
        body = One("v")
        Se("F", unit="N") >> body >> I("m", START["m"], unit="kg")
        body >> R("d", START["d"], unit="N*s/m")
        law = Polynomial(orders=(3,), half=HALF, size=START["a_3_k"], unit="N")
        body >> C("k", stiffness=START["k"], law=law, unit="N/m")
        body >> Dq("x", unit="m")
    return g.with_values({"a_3_k": START["a_3_k"]})


def duffing_record(samples: int, seed: int = 0, accuracy: float = 1e-7) -> Recording:
    """Return a virtual record from rest under a random force, linear between the samples."""
    rng = np.random.default_rng(seed)
    force = 20 * np.convolve(rng.standard_normal(samples), np.ones(12) / 6, "same")
    force -= force[0]
    t = np.arange(samples) / RATE
    x = np.asarray(
        simulate(duffing(), t, {"F": force}, TRUTH, accuracy=accuracy, x0="rest", hold="linear")[
            "x"
        ]
    )
    x = x + NOISE * rng.standard_normal(samples)
    return Recording.from_arrays("duffing", {"F[N]": force, "x[m]": x}, fs=RATE)


def _spent(action: Callable[[], Any], repeats: int) -> tuple[float, float, Any]:
    walls, processors, found = [], [], None
    for _ in range(repeats):
        wall, processor = time.perf_counter(), time.process_time()
        found = action()
        walls.append(time.perf_counter() - wall)
        processors.append(time.process_time() - processor)
    return median(walls), median(processors), found


def by_us(recording: Recording, repeats: int) -> Fitted:
    """Fit with `estimate`: sub-steps chosen by it, every sample scored."""
    everything = Split(slice(0, recording.n), slice(recording.n, recording.n), "all samples")
    study = Study(
        duffing(), recording, tuple(TRUTH), initial="rest", noise={"x": NOISE},
        nuisances=NO_NUISANCES, splits=everything, hold="linear",
    )  # fmt: skip
    estimate(study)  # compiles
    wall, processor, made = _spent(lambda: estimate(study), repeats)
    values = {n: made.values[n] for n in TRUTH}
    return Fitted(values, made.rmse()["x"], wall, processor, len(made.trace) - 1)


def by_scipy(recording: Recording) -> Fitted:
    """Fit with `least_squares` (differences) over `solve_ivp` (LSODA), as commonly written."""
    t, force, x = (np.asarray(v) for v in (recording.time, recording["F"], recording["x"]))

    def run(scaled: Array) -> Array:
        m, d, k, a = scaled * SCALE

        def rate(at: float, s: Array) -> list[float]:
            push = np.interp(at, t, force)
            return [s[1], (push - d * s[1] - k * s[0] - a * (s[0] / HALF) ** 3) / m]

        made = solve_ivp(
            rate, (t[0], t[-1]), [0.0, 0.0], "LSODA", t, rtol=TOLERANCE, atol=1e-3 * NOISE
        )
        return np.asarray((made.y[0] - x) / NOISE)

    # LSODA is not smooth in the parameters: differences larger than its errors
    wall, processor, found = _spent(
        lambda: least_squares(run, np.ones(4), diff_step=1e-4, x_scale="jac", xtol=1e-7), 1
    )
    values = dict(zip(TRUTH, found.x * SCALE, strict=True))
    rms = NOISE * float(np.sqrt(np.mean(found.fun**2)))
    return Fitted(values, rms, wall, processor, int(found.njev))


def by_casadi(recording: Recording, repeats: int, steps: int = 4) -> Fitted:
    """Fit as CasADi's example of system identification does.

    One interval a sample, fixed Runge-Kutta steps of order four by `map`, gaps as constraints,
    Gauss-Newton Hessian, IPOPT with mumps. Building the solver is not timed.
    """
    force, x = (np.asarray(v) for v in (recording["F"], recording["x"]))
    n = force.size
    state, u = ca.SX.sym("x", 2), ca.SX.sym("u", 2)
    p, part = ca.SX.sym("p", 4), ca.SX.sym("part")
    m, d, k, a = ca.vertsplit(p * SCALE)
    push = u[0] + part * (u[1] - u[0])
    speed = (push - d * state[1] - k * state[0] - a * (state[0] / HALF) ** 3) / m
    ode = ca.Function("ode", [state, u, p, part], [ca.vertcat(state[1], speed)])
    dt, now = 1.0 / (RATE * steps), state
    for i in range(steps):
        at = [i / steps, (i + 0.5) / steps, (i + 1) / steps]
        k1 = ode(now, u, p, at[0])
        k2 = ode(now + dt / 2 * k1, u, p, at[1])
        k3 = ode(now + dt / 2 * k2, u, p, at[1])
        k4 = ode(now + dt * k3, u, p, at[2])
        now = now + dt / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    step = ca.Function("step", [state, u, p], [now])
    values, states = ca.MX.sym("p", 4), ca.MX.sym("X", 2, n)
    pairs = np.stack([force[:-1], force[1:]])
    ends = step.map(n - 1)(states[:, :-1], pairs, ca.repmat(values, 1, n - 1))
    gaps = ca.vertcat(states[:, 0], ca.vec(ends - states[:, 1:]))
    e = (states[0, :].T - x) / NOISE
    w = ca.veccat(values, states)
    slope = ca.jacobian(e, w)
    lam_f, lam_g, empty = ca.MX.sym("f"), ca.MX.sym("g", gaps.numel()), ca.MX(0, 1)
    squares = lam_f * ca.triu(slope.T @ slope)
    hessian = ca.Function("squares", [w, empty, lam_f, lam_g], [squares])
    options: dict[str, Any] = {
        "hess_lag": hessian, "ipopt.print_level": 0, "ipopt.sb": "yes", "print_time": False,
        "ipopt.linear_solver": "mumps",
    }  # fmt: skip
    whole: dict[str, Any] = {"x": w, "f": 0.5 * ca.dot(e, e), "g": gaps}
    solver = ca.nlpsol("s", "ipopt", whole, options)
    rough = np.stack([x, np.gradient(x, 1.0 / RATE)])
    begin = np.concatenate([np.ones(4), rough.ravel(order="F")])
    wall, processor, found = _spent(lambda: solver(x0=begin, lbg=0.0, ubg=0.0), repeats)
    solved = found["x"].full().ravel()
    rms = float(np.sqrt(np.mean((solved[4::2] - x) ** 2)))
    named = dict(zip(TRUTH, solved[:4] * SCALE, strict=True))
    return Fitted(named, rms, wall, processor, int(solver.stats()["iter_count"]))
