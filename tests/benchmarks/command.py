"""Times and memory of the main jobs, printed as a table anyone can make."""

from __future__ import annotations

import resource
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from unittest.mock import patch

import numpy as np

from actuators import stack_bond_graph
from bondgraph.equations.derivation import equations
from bondgraph.laws import StopSum
from bondgraph.simulation import lure_kernel
from bondgraph.simulation.exact_run import run_record
from bondgraph.simulation.lure import compile_model
from bondgraph.simulation.start import equilibrium, inputs_of
from bondgraph.support.errors import UnusableInput, unknown_name
from bondgraph.support.native import vector_length
from tests.benchmarks.diagnosis import chain, diagnosis
from tests.benchmarks.fit import bench_fit
from tests.benchmarks.graphs import graphs
from tests.benchmarks.operators import operators


def bench(names: Sequence[str], quick: bool = False) -> int:
    """Run the named measurements, or all; `quick` shortens those that can be."""
    for n in names:
        if n not in MEASUREMENTS:
            raise UnusableInput(str(unknown_name("measurement", n, "bench", MEASUREMENTS)))
    for n in names or MEASUREMENTS:
        print(f"== {n}")
        (QUICK.get(n, MEASUREMENTS[n]) if quick else MEASUREMENTS[n])()
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    children = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
    print(f"peak memory: this process {peak:.0f} MiB, largest child {children:.0f} MiB")
    return 0


def _best(action: Callable[[], object], repeats: int = 3) -> float:
    times = []
    for _ in range(repeats):
        begin = time.perf_counter()
        action()
        times.append(time.perf_counter() - begin)
    return min(times)


def derivation() -> None:
    """Equations of the stack model."""
    graph = stack_bond_graph(sensors=("x", "i"))
    spent = _best(lambda: equations(graph))
    print(f"causality and equations of {graph.name}: {1e3 * spent:.1f} ms")


def simulation() -> None:
    """How the time of a simulation grows with samples, operators and derivatives."""
    for samples in (5_000, 50_000, 200_000):
        _simulate(samples, 8)
    for count in (1, 4, 16, 64):
        _simulate(20_000, count)


def _simulate(samples: int, operators: int) -> None:
    t = np.arange(samples) * 2e-4
    law = StopSum(tuple(1e-6 * np.linspace(0.05, 1, operators)), height=1e8, scale=1e8)
    compiled = compile_model(stack_bond_graph(law, sensors=("x", "i")))
    p = compiled.nominal()
    u = inputs_of(compiled, {"V_in": 50 - 50 * np.cos(4 * np.pi * t)}, t)
    x0 = equilibrium(compiled, p, u[0])
    directions = [
        i
        for i, n in enumerate(compiled.parameter_names)
        if n in ("T", "R_e", "C_nl", "k", "m", "R_nl")
    ]

    def plain() -> object:
        return run_record(compiled, p, u, 2e-4, x0)

    def gradients() -> object:
        return run_record(compiled, p, u, 2e-4, x0, directions=directions)

    begin = time.perf_counter()
    plain()
    gradients()
    first = time.perf_counter() - begin
    a, b = _best(plain), _best(gradients)
    print(
        f"{samples:7d} samples, {operators:3d} operators: {1e9 * a / samples:7.0f} ns a "
        "sample, with 6 "
        f"derivatives {1e9 * b / samples:7.0f} ns (first call {first:.2f} s)"
    )


def rows() -> None:
    """What a row of derivatives costs as long as the registers, and twice as long."""
    model = compile_model(chain(3, 3))
    p, samples = model.nominal(), 5_000
    u, x0 = np.zeros((samples, model.n_u)), np.zeros(model.n_x)
    u[:, 0] = np.sin(0.02 * np.arange(samples))
    directions = range(len(p))

    def run() -> object:
        return run_record(model, p, u, 1e-3, x0, directions=directions)

    length = vector_length()
    for what, lanes in (("as long as the registers", length), ("twice as long", 2 * length)):
        with patch("bondgraph.simulation.lure_march.vector_length", lambda n=lanes: n):
            lure_kernel._runner.cache_clear()
            run()
            spent = _best(run, 15) / samples / (1 + len(p))
        print(
            f"rows {what} ({lanes} numbers), {model.n_x} states, {len(p)} derivatives: "
            f"{1e9 * spent:.0f} ns a sample and number"
        )
    lure_kernel._runner.cache_clear()


def compilation() -> None:
    """Diagnose a draw of the virtual plants on an empty cache: programs, and seconds in gcc."""
    from bondsight.cli.demonstration import Wish, conceal, run

    with tempfile.TemporaryDirectory() as folder:
        made = conceal(1, Wish("chain", "nonlinear_stiffness"), Path(folder) / "recording.csv")
        with patch.dict("os.environ", {"XDG_CACHE_HOME": folder}):
            lure_kernel._runner.cache_clear()
            before, begin = _children(), time.process_time()
            run(made, 1, None)
            own, gcc = time.process_time() - begin, _children() - before
            programs = len(list((Path(folder) / "bondsight" / "kernels").iterdir()))
    lure_kernel._runner.cache_clear()
    print(
        f"a chain of masses, {made.recording.n} samples, empty cache: {programs} programs, "
        f"{gcc:.1f} s of processor time in gcc, {own:.1f} s elsewhere"
    )


def _children() -> float:
    spent = resource.getrusage(resource.RUSAGE_CHILDREN)
    return spent.ru_utime + spent.ru_stime


def demonstration() -> None:
    """Diagnose one draw of the virtual stack."""
    from bondsight.cli.demonstration import Wish, conceal, run

    with tempfile.TemporaryDirectory() as folder:
        made = conceal(7, Wish("stack", "hysteresis"), Path(folder) / "recording.csv")
        for what in ("first time", "again"):
            d = run(made, 1, None)
            print(
                f"virtual stack, {made.recording.n} samples, 2 readings, {len(d.trials)} "
                f"candidates, {what}: {d.seconds:.1f} s"
            )


def piezo() -> None:
    """Diagnose the 50,001-sample piezo recording when it is here."""
    from identification.datasets import available, load
    from identification.datasets.opening import match_by_unit
    from identification.diagnosis.diagnose import diagnose

    if not available("piezo-actuator-sine"):
        print("piezo-actuator-sine is absent; set BONDSIGHT_RECORDINGS to measure it")
        return
    recording, split = load("piezo-actuator-sine")
    graph = stack_bond_graph()
    recording, _ = match_by_unit(recording, graph)
    for what in ("first time", "again"):
        d = diagnose(graph, recording, split, model="stack_bond_graph")
        print(
            f"piezo-actuator-sine, {recording.n} samples, {len(d.trials)} candidates, "
            f"{what}: {d.seconds:.1f} s"
        )


def fits() -> None:
    """Fits: the stack with operators, other tools beside, growth."""
    bench_fit(print)


def interferometer() -> None:
    """Measure blocks and streams of the interferometer, through the stub library."""
    from tests.benchmarks.interferometer import measure

    print("\n".join(measure().lines()))


def recorder() -> None:
    """Measure a take over the wire of a virtual bench, and what storing it costs."""
    from tests.benchmarks.recorder import bench_recorder

    bench_recorder(print)


def integrators() -> None:
    """Hold CVODES, IDAS and our steps against one another, and IPOPT against Gauss-Newton."""
    from tests.benchmarks.integrators import bench_integrators

    bench_integrators(print)


def players() -> None:
    """Measure how well the players of a card keep time, over plain memory and by wire."""
    from tests.benchmarks.players import bench_players

    bench_players()


def loops() -> None:
    """Measure rate and jitter of feedback loops in real time, the runner alone and by wire."""
    from tests.benchmarks.loops import bench_loops

    bench_loops(print)


MEASUREMENTS: dict[str, Callable[[], None]] = {
    "derivation": derivation,
    "simulation": simulation,
    "rows": rows,
    "compilation": compilation,
    "operators": operators,
    "integrators": integrators,
    "graphs": graphs,
    "interferometer": interferometer,
    "recorder": recorder,
    "loops": loops,
    "players": players,
    "demo": demonstration,
    "diagnosis": diagnosis,
    "piezo": piezo,
    "fit": fits,
}

QUICK: dict[str, Callable[[], None]] = {"diagnosis": lambda: diagnosis(quick=True)}
