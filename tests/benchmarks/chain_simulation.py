"""A forced chain over a record: `bondgraph.simulate` beside the solvers of `solve_ivp`.

The force is linear between samples for all. Each solver gets the loosest tolerance that meets the
accuracy, against a Taylor series of its own in every sample, which is exact to rounding.

Runs alone: ``python -m tests.benchmarks.chain_simulation FORCE``, so that NumPy
can be kept to one thread for all.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from bondgraph import BondGraph, Df
from bondgraph.simulation.lure import Compiled, compile_model
from bondgraph.simulation.simulate import simulate
from bondgraph.support.arrays import Array
from tests.benchmarks.chain import chain

STEP = 0.01  # s; the fastest mode of the chain has 10 Hz
SOLVERS = ("DOP853", "RK45", "LSODA", "BDF", "Radau")
TERMS = 20
ACCURACY = 1e-4
"""Root mean square of the error over that of the reading: what `simulate` promises."""


def _noise(t: Array) -> Array:
    return np.random.default_rng(0).standard_normal(t.size)


def _sine(t: Array) -> Array:
    return np.sin(2 * np.pi * t)


FORCES: dict[str, Callable[[Array], Array]] = {"white noise": _noise, "1 Hz sine": _sine}
"""A force as identification wants it, and one that spares a solver with variable steps."""


@dataclass(frozen=True)
class Comparison:
    """Seconds at equal accuracy.

    Attributes
    ----------
    first, ours : float
        Seconds of the first and of a later call of `simulate`.
    error : float
        Its error against the reference.
    solver, theirs : str, float
        The fastest that is accurate and its seconds; empty and infinite if none is.
    """

    force: str
    states: int
    samples: int
    first: float
    ours: float
    error: float
    solver: str
    theirs: float

    @property
    def ratio(self) -> float:
        """How many times faster `simulate` is; NaN if it misses the accuracy itself."""
        return self.theirs / self.ours if self.error <= ACCURACY else float("nan")


def compare(segments: int = 100, samples: int = 5001, force: str = "white noise") -> Comparison:
    """Measure one chain, read at its last mass, from rest."""
    graph = _read_at_the_end(segments)
    compiled = compile_model(graph)
    t = STEP * np.arange(samples)
    u = FORCES[force](t)
    x0 = np.zeros(compiled.n_x)
    seconds = []
    for _ in range(9):
        begin = time.perf_counter()
        made = simulate(compiled, t, {"F": u}, x0=x0, hold="linear")
        seconds.append(time.perf_counter() - begin)
    problem = _Problem(compiled, t, u)
    reference = problem.taylor()
    scale = np.abs(reference).max(axis=1)
    reading = problem.c @ reference
    level = float(np.sqrt(np.mean(reading**2)))

    def error(y: Array) -> float:
        return float(np.sqrt(np.mean((y - reading) ** 2))) / level

    fastest, least = "", float("inf")
    for solver in SOLVERS:
        spent = problem.loosest(solver, scale, error, least)
        if spent is not None:
            fastest, least = solver, spent
    own = error(made["end"])
    return Comparison(
        force, compiled.n_x, samples, seconds[0], min(seconds[1:]), own, fastest, least
    )


def _read_at_the_end(segments: int) -> BondGraph:
    graph = chain(segments)
    return graph.with_branch(f"v_{segments}", [Df("end")])


class _TooSlow(Exception):
    """A solver has taken longer than the fastest."""


class _Problem:
    """``dx/dt = A x + b u(t)`` as a user of SciPy writes it."""

    def __init__(self, compiled: Compiled, t: Array, u: Array) -> None:
        block = np.asarray(compiled.matrices(compiled.nominal()).full(), float)
        n = compiled.n_x
        self.a, self.b, self.c = block[:n, :n].copy(), block[:n, n].copy(), block[n, :n].copy()
        self.t, self.u = t, u

    def taylor(self) -> Array:
        """Return the states at the samples, shape (n_x, n), by ``x' = A x + b u`` term by term."""
        states = np.zeros((self.a.shape[0], self.u.size))
        for k in range(self.u.size - 1):
            slope = self.u[k + 1] - self.u[k]
            term = total = states[:, k]
            for j in range(1, TERMS):
                term = self.a @ term
                if j <= 2:
                    term = term + self.b * (self.u[k] if j == 1 else slope)
                term = term * (STEP / j)
                total = total + term
            states[:, k + 1] = total
        return states

    def solve(self, solver: str, rtol: float, scale: Array, limit: float) -> Array:
        """Return the states at the samples, shape (n_x, n); `_TooSlow` beyond `limit` seconds."""
        a, b, u, last = self.a, self.b, self.u, self.u.size - 2
        begin = time.perf_counter()

        def rhs(t: float, x: Array) -> Array:
            at = t / STEP
            k = min(int(at), last)
            if time.perf_counter() - begin > limit:
                raise _TooSlow
            force = u[k] + (u[k + 1] - u[k]) * (at - k)
            return np.asarray(a @ x + b * force)

        more: dict[str, Any] = {}
        if solver == "LSODA":
            more["jac"] = lambda t, x: a
        elif solver in ("BDF", "Radau"):
            more["jac"] = a
        made = solve_ivp(
            rhs, (0.0, self.t[-1]), np.zeros(a.shape[0]), method=solver, t_eval=self.t,
            rtol=rtol, atol=rtol * scale, **more,
        )  # fmt: skip
        return np.asarray(made.y)

    def loosest(
        self,
        solver: str,
        scale: Array,
        error: Callable[[Array], float],
        limit: float,
    ) -> float | None:
        """Return the seconds at the loosest tolerance that is accurate; None beyond `limit`."""
        for power in range(3, 13):
            begin = time.perf_counter()
            try:
                states = self.solve(solver, 10.0**-power, scale, limit)
            except _TooSlow:
                if solver == "LSODA":
                    continue  # loose tolerances send it to its slow stiff method
                return None
            spent = time.perf_counter() - begin
            if states.shape[1] == self.t.size and error(self.c @ states) <= ACCURACY:
                return spent if spent < limit else None
        return None


if __name__ == "__main__":
    print(json.dumps(asdict(compare(force=sys.argv[1]))))
