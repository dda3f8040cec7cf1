"""One page: every integrator and every way of fitting gives the same answer.

On the stack with memory, on a stack whose memory sits in an algebraic loop, and on a drive against
two hardening springs of which one depends on the other: differences, steps, times; then parameters
by single shooting (Gauss-Newton, IPOPT), multiple shooting and collocation.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator

import numpy as np

from actuators.models.catalogue import MODELS
from bondgraph import TF, BondGraph, C, Df, Dq, I, One, R, Se, Zero
from bondgraph.equations.codegen import program
from bondgraph.hysteresis import MaxwellResistiveCapacitor
from bondgraph.laws import Hysteretic, Polynomial
from bondgraph.signals.recording import Recording
from bondgraph.simulation.posing import pose
from bondgraph.simulation.simulate import simulate_general
from bondgraph.simulation.sundials.record import begun, march, stepper_of
from bondgraph.simulation.trajectory import Trajectory
from bondgraph.support.arrays import Array
from bondgraph.support.errors import BondsightError
from identification.estimation import NO_NUISANCES, Study, Vary, estimate
from tests.settled import simulate

STEP = 1e-4
FINE = 1e-7
"""Accuracy of the run that all are held against."""
RUNS = (
    ("single_shooting", "gauss_newton"), ("single_shooting", "ipopt"),
    ("multiple_shooting", "gauss_newton"), ("collocation", "ipopt"),
)  # fmt: skip


def contact() -> BondGraph:
    """Return a drive that moves two masses as one against two hardening springs in series."""
    hard = Polynomial(orders=(3,), half=5e-6, size=20.0, unit="N")
    with BondGraph("drive_on_contact") as g:
        loop, body, series = One("loop"), One("body"), Zero("series")
        Se("V_in", unit="V") >> loop >> R("R_e", 50.0, unit="ohm")
        loop >> C("C_p", 1e-6, unit="F")
        loop >> TF("T", ratio=1 / 3.5) >> body
        body >> I("m", 0.02, unit="kg")
        body >> I("payload", 0.05, unit="kg")
        body >> R("d", 60.0, unit="N*s/m")
        body >> C("k", stiffness=6e6, unit="N/m")
        body >> series
        series >> C("a", stiffness=2e6, law=hard, unit="N/m")
        series >> C("b", stiffness=1e6, law=hard, unit="N/m")
        body >> Dq("x", unit="m")
        loop >> Df("i", unit="A")
    return g.with_values({"a_3_a": 20.0, "a_3_b": 20.0})


def volts(n: int) -> tuple[Array, Array]:
    """Return times and a command with turns of many sizes, zero at the start."""
    t = STEP * np.arange(n)
    return t, 50 - 50 * np.cos(2 * np.pi * 50 * t) + 15 * np.sin(2 * np.pi * 330 * t)


def bench_integrators(say: Callable[[str], None] = print, samples: int = 201) -> None:
    """Print differences, steps and times of all integrators on three graphs, then fits."""
    t, volt = volts(samples)
    for graph in (
        MODELS["stack_bond_graph_ang"](), MODELS["stack_lumped_maxwell"](), contact(),
    ):  # fmt: skip
        made = program(graph)
        say(
            f"{graph.name}: {len(made.states)} states, {len(made.memory)} of memory, "
            f"{len(made.algebraic)} algebraic; {samples} samples"
        )
        for line in compared(graph, t, {"V_in": volt}):
            say("  " + line)
    say(f"accepted steps a sample, error of {MODELS['stack_bond_graph_ang']().name}")
    say("  " + ", ".join(f"{n}: {e:.2g}" for n, e in memory_errors(t, volt)))
    for line in fits():
        say(line)


def compared(graph: BondGraph, t: Array, given: dict[str, Array]) -> Iterator[str]:
    """Yield a line for every integrator: difference from a fine run of ours, steps, seconds."""
    right = _fine(graph, t, given)
    yield f"held against ours at accuracy {FINE:g}, {right.steps_per_sample} steps a sample"
    runs: dict[str, Callable[[], Trajectory]] = {
        "ours": lambda: simulate(graph, t, given),
        "Radau IIA": lambda: simulate_general(graph, t, given, x0="rest", hold="linear"),
        "CVODES": lambda: simulate(graph, t, given, integrator="cvodes"),
        "IDAS": lambda: simulate(graph, t, given, integrator="idas"),
        "CVODES, 1e-6": lambda: simulate(graph, t, given, integrator="cvodes", accuracy=1e-6),
        "IDAS, 1e-6": lambda: simulate(graph, t, given, integrator="idas", accuracy=1e-6),
    }
    for name, run in runs.items():
        run()  # compiles
        began = time.process_time()
        found = run()
        spent = time.process_time() - began
        inner = f", {found.inner_steps} inside" if found.inner_steps else ""
        yield (
            f"{name:13s} {difference(found, right):8.2g} of the range, "
            f"{found.steps_per_sample:3d} steps a sample{inner}, {spent:.3f} s"
        )


def difference(found: Trajectory, right: Trajectory) -> float:
    """Return the largest difference of an output over its range."""
    return max(float(np.abs(found[n] - y).max() / np.ptp(y)) for n, y in right.outputs.items())


def _fine(graph: BondGraph, t: Array, given: dict[str, Array]) -> Trajectory:
    return simulate(graph, t, given, accuracy=FINE)


def memory_errors(t: Array, volt: Array) -> Iterator[tuple[int, float]]:
    """Yield accepted steps a sample and what they leave of twelve plays, beside eight steps."""
    asked = pose(MODELS["stack_bond_graph_ang"](), t, {"V_in": volt}, {}, ())
    stepper, begin = stepper_of(asked, begun(asked, None, None), "cvodes", 1e-12, "linear")
    y = {n: march(stepper, asked, begin, "linear", n)[0][:, 0] for n in (1, 2, 4, 8)}
    for n in (1, 2, 4):
        yield n, float(np.sqrt(np.mean((y[n] - y[8]) ** 2)) / np.ptp(y[8]))


def rubbing() -> BondGraph:
    """Return a positioner whose spring keeps a memory: two springs that slip beside it."""
    slips = Hysteretic(MaxwellResistiveCapacitor((40.0, 20.0, 60.0), (0.1, 0.2, 30.0)))
    with BondGraph("with_memory") as g:
        body = One("body")
        Se("F", unit="N") >> body >> I("m", 0.5, unit="kg")
        body >> R("d", 4.0, unit="N*s/m")
        body >> C("k", stiffness=100.0, unit="N/m")
        body >> C("slips", law=slips, unit="N/m")
        body >> Dq("x", unit="m")
    return g


def hardening() -> BondGraph:
    """Return a positioner on two hardening springs in series, of which one depends."""
    hard = Polynomial(orders=(3,), half=0.02, size=2.0, unit="N")
    with BondGraph("dae") as g:
        body, series = One("body"), Zero("series")
        Se("F", unit="N") >> body >> I("m", 0.5, unit="kg")
        body >> R("d", 4.0, unit="N*s/m")
        body >> series
        series >> C("a", stiffness=400.0, law=hard, unit="N/m")
        series >> C("b", stiffness=600.0, law=hard, unit="N/m")
        body >> Dq("x", unit="m")
    return g.with_values({"a_3_a": 4.0, "a_3_b": 4.0})


def fits(samples: int = 300) -> Iterator[str]:
    """Yield what every way of fitting finds, on a record with memory and on one of a DAE."""
    t = 0.01 * np.arange(samples)
    force = 6 * np.sin(2 * np.pi * (0.5 + 0.6 * t) * t)
    for graph, free in ((rubbing(), ("m", "d", "k")), (hardening(), ("m", "d", "a"))):
        x = simulate(graph, t, {"F": force}, accuracy=1e-7)["x"]
        x = x + 1e-5 * np.random.default_rng(1).standard_normal(samples)
        recording = Recording.from_arrays(graph.name, {"F[N]": force, "x[m]": x}, fs=100.0)
        truth = {n: graph.parameters[n].value for n in free}
        study = Study(
            graph, recording, tuple(Vary(n, start=1.3 * v) for n, v in truth.items()),
            initial="rest", hold="linear", nuisances=NO_NUISANCES,
        )  # fmt: skip
        yield f"{graph.name}, fitted; true " + _values(truth)
        first = None
        for method, optimiser in RUNS:
            began = time.process_time()
            try:
                made = estimate(study, method, optimiser=optimiser)
            except BondsightError as error:
                yield f"  {method}, {optimiser}: {error}"
                continue
            first = first or made
            apart = max(
                abs(made.values[n] - first.values[n]) / np.ptp(first.estimate_of(n).ci95)
                for n in free
            )
            yield (
                f"  {method}, {optimiser}: {_values({n: made.values[n] for n in free})}, "
                f"{apart:.1g} of a 95 % interval from the first, {made.status.value}, "
                f"{time.process_time() - began:.2f} s"
            )


def _values(found: dict[str, float]) -> str:
    return ", ".join(f"{n} = {v:.6g}" for n, v in found.items())
