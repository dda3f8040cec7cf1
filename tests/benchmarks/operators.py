"""Speed of the operators with memory, beside a plain C loop compiled in the same run."""

from __future__ import annotations

import ctypes
import os
import resource
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np

from actuators import stack_bond_graph
from bondgraph.equations.codegen import program_of
from bondgraph.equations.derivation import equations
from bondgraph.hysteresis import Ang, MaxwellResistiveCapacitor, PrandtlIshlinskii
from bondgraph.hysteresis.plays.play import weighted_plays
from bondgraph.laws import Hysteretic
from bondgraph.simulation.exact_run import KernelRun, run_record
from bondgraph.simulation.lure import compile_model
from bondgraph.simulation.radau.native import prepare_general, run_general
from bondgraph.simulation.simulate import simulate
from bondgraph.simulation.start import equilibrium, inputs_of
from bondgraph.support.native import build

SAMPLES = 1_000_000
RECORD = 32_768
RATE = 3125.0

PLAIN_LOOP = """
void plain_loop(const double *x, long n, const double *r, const double *w, long m, double *state,
                double *y) {
  for (long k = 0; k < n; ++k) {
    double sum = 0.0;
    for (long j = 0; j < m; ++j) {
      double q = state[j], low = x[k] - r[j], high = x[k] + r[j];
      if (q < low) q = low;
      if (q > high) q = high;
      state[j] = q;
      sum += w[j] * q;
    }
    y[k] = sum;
  }
}
"""


def best(action: Callable[[], object], repeats: int = 5) -> float:
    """Shortest of some runs, s of the processor."""
    times = []
    for _ in range(repeats):
        begin = time.process_time()
        action()
        times.append(time.process_time() - begin)
    return min(times)


def operators() -> None:
    """Plays, turning points, weight fitting and the stack with Ang's element."""
    _plays()
    _fitting()
    _stack()
    _growth()


def _signals(n: int) -> dict[str, Any]:
    rng = np.random.default_rng(0)
    t = np.arange(n)
    sines = np.sin(1.4e-3 * t) * np.sin(1e-5 * t)
    return {
        "two sines": sines,
        "two sines and 1 % noise": sines + 0.01 * rng.standard_normal(n),
        "white noise": 0.3 * rng.standard_normal(n),
    }


def _plays() -> None:
    rng = np.random.default_rng(1)
    signals = _signals(SAMPLES)
    r, w = np.linspace(0.01, 1.0, 100), rng.uniform(0.1, 1.0, 100)
    x = signals["two sines and 1 % noise"]
    share = 1e9 / SAMPLES / r.size
    bank = best(lambda: weighted_plays(x, r, w, np.zeros(r.size)))
    print(f"Prandtl-Ishlinskii, {r.size} operators, {SAMPLES} samples:")
    print(f"  all operators, every sample: {share * bank:.3f} ns an operator and sample")
    for flags in (("-O3", "-march=native"), ("-O3", "-march=native", "-ffast-math")):
        loop = plain_loop(flags)
        if loop is None:
            print("  no gcc: the plain C loop is left out")
            break
        seconds = best(lambda loop=loop: loop(x, r, w))  # type: ignore[misc]
        print(f"  plain C loop, gcc {' '.join(flags)}: {share * seconds:.3f} ns")
    past = np.cumsum(rng.standard_normal(5000)) * 0.05
    for count in (10, 100, 1000):
        widths = tuple(np.linspace(1.0 / count, 1.0, count))
        operator = PrandtlIshlinskii((0.0, *widths), tuple(rng.uniform(0.1, 1.0, count + 1)))
        memory = operator.run(past)[1]
        parts = []
        for name, signal in signals.items():
            seconds = best(lambda s=signal, o=operator, m=memory: o.run(s, m), 3)  # type: ignore[misc]
            parts.append(f"{name} {1e9 * seconds / SAMPLES:.1f}")
        row = "; ".join(parts)
        print(f"  turning points, {count} operators, stored memory, ns a sample: {row}")


def plain_loop(flags: tuple[str, ...]) -> Callable[[Any, Any, Any], Any] | None:
    """Compile the loop anyone would write; None without gcc."""
    built = build(PLAIN_LOOP, (*flags, "-fPIC", "-shared"))
    if built is None:
        return None
    library = ctypes.CDLL(str(built))
    pointer, long = ctypes.POINTER(ctypes.c_double), ctypes.c_long
    library.plain_loop.restype = None

    def run(x: Any, r: Any, w: Any) -> Any:
        state, y = np.zeros(r.size), np.empty(x.size)
        at = [v.ctypes.data_as(pointer) for v in (x, r, w, state, y)]
        library.plain_loop(at[0], long(x.size), at[1], at[2], long(r.size), at[3], at[4])
        return y

    return run


def _fitting() -> None:
    from bondgraph.hysteresis.fitting import fit_weights

    t = np.arange(RECORD) / RATE
    x = 50.0 - 50.0 * np.cos(4.0 * np.pi * t) * np.linspace(0.2, 1.0, RECORD)
    thresholds = (0.0, *np.linspace(1.0, 49.0, 39))
    true = PrandtlIshlinskii(thresholds, tuple(np.linspace(20.0, 1.0, 40)))
    y = true.run(x)[0] + np.random.default_rng(2).standard_normal(RECORD)
    seconds = best(lambda: fit_weights(thresholds, x, y), 3)
    print(f"fit of 40 weights, {RECORD} samples, every slope positive: {seconds:.3f} s")


def _stack() -> None:
    from actuators.stack.conversions import paired

    t = np.arange(RECORD) / RATE
    voltage = 50.0 - 50.0 * np.cos(4.0 * np.pi * t)
    compiled = compile_model(paired("bond_graph", Ang.stack_2hz()))
    simulate(compiled, t, {"V_in": voltage}, x0="rest", hold="linear")
    seconds = best(lambda: simulate(compiled, t, {"V_in": voltage}, x0="rest", hold="linear"), 3)
    print(f"bond graph stack with Ang's 12 operators, {RECORD} samples: {seconds:.3f} s")


def _growth() -> None:
    """A graph beside the same operators alone and beside the plain loop, all in processor time."""
    t = np.arange(RECORD) / RATE
    voltage = 50.0 - 50.0 * np.cos(4.0 * np.pi * t)
    for count in (10, 100, 1000):
        with tempfile.TemporaryDirectory() as fresh, environment("XDG_CACHE_HOME", fresh):
            _in_a_graph(count, t, voltage)


def _in_a_graph(count: int, t: Any, voltage: Any) -> None:
    reach = 5e-6 * 18e-3 / 0.0327  # dipole at 5 um
    stiff = 100.0 / 18e-3 / reach
    slips = reach * np.linspace(1.0 / count, 1.0, count)
    share = 0.3 * stiff / count
    plays = MaxwellResistiveCapacitor((share,) * count, tuple(share * slips))
    weights = plays.as_prandtl_ishlinskii()
    law = PrandtlIshlinskii(weights.thresholds, (weights.weights[0] + stiff, *weights.weights[1:]))

    def record(samples: int, directions: Sequence[int] = ()) -> KernelRun:
        return run_record(compiled, p, u[:samples], 1.0 / RATE, x0, directions=directions)

    def general(samples: int, directions: Sequence[int] = ()) -> KernelRun:
        ready = prepare_general(model, p_general, 1.0 / RATE, 1, directions)
        return run_general(ready, u_general[:samples], x_general)

    begin = spent()
    compiled = compile_model(stack_bond_graph(Hysteretic(law)))
    p, u = compiled.nominal(), inputs_of(compiled, {"V_in": voltage}, t)
    x0 = equilibrium(compiled, p, u[0])
    record(2)
    first = spent() - begin
    begin = spent()
    model = program_of(equations(stack_bond_graph(Hysteretic(law))))
    p_general, x_general = np.array(model.nominal), np.zeros(len(model.states))
    u_general = np.zeros((RECORD, len(model.inputs)))
    u_general[:, model.inputs.index("V_in")] = voltage
    general(2)
    first_general = spent() - begin
    s = record(RECORD).s[:, 0].copy()
    r, w = np.array(law.thresholds[1:]), np.array(law.weights[1:])
    loop = plain_loop(("-O3", "-march=native"))
    times = {
        "in the graph": best(lambda: record(RECORD), 3),
        "with 6 derivatives": best(lambda: record(RECORD, range(6)), 3),
        "general step": best(lambda: general(RECORD), 2),
        "with 6 derivatives by it": best(lambda: general(RECORD, range(6)), 2),
        "all of them alone": best(lambda: weighted_plays(s, r, w, np.zeros(count))),
        "by turning points": best(lambda: law.run(s)),
        "plain C loop": best(lambda: loop(s, r, w)) if loop else float("nan"),
    }
    each = ", ".join(f"{k} {1e9 * v / RECORD / count:.2f}" for k, v in times.items())
    print(f"stack, {count} operators, ns an operator and sample: {each}")
    print(
        f"  first call from the graph on: {first:.2f} s, of the general step {first_general:.2f} s"
    )


def spent() -> float:
    """Processor time of this process and of its children, s."""
    used = map(resource.getrusage, (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(u.ru_utime + u.ru_stime for u in used)


@contextmanager
def environment(name: str, value: str) -> Iterator[None]:
    """Set a variable for a while."""
    before = os.environ.get(name)
    os.environ[name] = value
    try:
        yield
    finally:
        os.environ.pop(name)
        if before is not None:
            os.environ[name] = before
