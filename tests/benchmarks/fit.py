"""Time of fits: the stack with operators, other tools on one problem, and how time grows."""

from __future__ import annotations

import os
import platform
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from statistics import median

import numpy as np

from actuators import stack_bond_graph
from bondgraph.graph.bond_graph import BondGraph
from bondgraph.laws import StopSum
from bondgraph.signals.recording import Recording
from bondgraph.simulation.simulate import simulate
from identification.estimation import NO_NUISANCES, Estimation, Study, Vary, estimate
from identification.estimation.starts import many_starts
from tests.benchmarks.fit_peers import (
    NOISE,
    TRUTH,
    Fitted,
    by_casadi,
    by_scipy,
    by_us,
    duffing,
    duffing_record,
)
from tests.spring import spring

Printer = Callable[[str], None]
RATE = 1e5
LIMIT = 10.0
SAMPLES = 32_768
CAPACITANCE, LENGTH = 1.65e-6, 18e-3
DIPOLE = CAPACITANCE * 100.0 * LENGTH
"""Dipole at 100 V, C m: the operators' thresholds lie below half of it."""
STIFFNESS = 1.0 / (CAPACITANCE * LENGTH**2)
REPEATS = 3
ROUGH = 1e-4
"""Accuracy of the virtual records whose fits are only timed."""


@dataclass(frozen=True)
class Spent:
    """Median wall and processor seconds of some runs, and the last result."""

    wall: float
    processor: float
    result: Estimation


def timed(action: Callable[[], Estimation], repeats: int = REPEATS) -> Spent:
    """Run once to compile, then take medians."""
    action()
    walls, processors = [], []
    for _ in range(repeats):
        wall, processor = time.perf_counter(), time.process_time()
        result = action()
        walls.append(time.perf_counter() - wall)
        processors.append(time.process_time() - processor)
    return Spent(median(walls), median(processors), result)


def exponent(sizes: Sequence[float], seconds: Sequence[float]) -> float:
    """Slope of the logarithms by least squares.

    >>> round(exponent([1, 2, 4], [3, 6, 12]), 6)
    1.0
    """
    return float(np.polyfit(np.log(sizes), np.log(seconds), 1)[0])


def bench_fit(
    say: Printer = print,
    *,
    samples: int = SAMPLES,
    operators: int = 12,
    peer_samples: int = 4000,
    largest: float = 1.0,
    repeats: int = REPEATS,
) -> None:
    """Print all measurements.

    Parameters
    ----------
    say : callable
        Takes each line.
    samples, operators : int
        Of the stack's fit.
    peer_samples : int
        Of the problem that other tools solve too.
    largest : float
        Share of the full sizes in the growth measurements.
    repeats : int
        Timed runs; the median counts.
    """
    say(
        f"machine: {platform.processor() or platform.machine()}, {os.cpu_count()} cores, "
        f"load {os.getloadavg()[0]:.1f}; medians of {repeats} after a first run that compiles"
    )
    _stack(say, samples, operators, repeats)
    _small(say)
    _peers(say, peer_samples, repeats)
    _growth(say, largest, repeats)


def operator_stack(count: int, height: float) -> BondGraph:
    """Return the stack model with `count` operators of one relative height, reading x and i."""
    thresholds = tuple(DIPOLE * np.arange(1, count + 1) / (count + 1) * 0.5)
    law = StopSum(thresholds, height=height * STIFFNESS, scale=0.02 * STIFFNESS, unit="1")
    return stack_bond_graph(law, sensors=("x", "i"))


def stack_study(
    samples: int, operators: int, free: Sequence[str] | None = None, seed: int = 0
) -> tuple[Study, dict[str, float]]:
    """Study of a virtual recording of the stack at 100 kHz, and its true values, SI."""
    rng = np.random.default_rng(seed)
    t = np.arange(samples) / RATE
    sweep = 3 * np.sin(2 * np.pi * (200 + 12_000 * t / t[-1]) * t)
    steady = np.convolve(rng.standard_normal(samples), np.ones(3) / 3, "same")
    slow = 2 * np.pi * max(25.0, 3.0 * RATE / samples)
    drive = 50 * (1 - np.cos(slow * t)) * np.minimum(1.0, t / (0.75 * t[-1])) + sweep + 2 * steady
    drive -= drive[0]
    made = operator_stack(operators, 0.01)
    nominal = {n: p.value for n, p in made.parameters.items()}
    truth = {n: nominal[n] * f for n, f in (("T", 1.1), ("R_e", 1.12), ("C_nl", 0.9), ("k", 1.08))}
    truth |= {"m": 1.1 * nominal["m"], "R_nl": 1.19 * nominal["R_nl"]}
    truth |= {
        f"h_{i}_C_nl": 0.03 * (1 - 0.6 * i / operators) * STIFFNESS for i in range(1, operators + 1)
    }
    seen = simulate(made, t, {"V_in": drive}, truth, accuracy=1e-6, x0="rest", hold="linear")
    r = Recording(
        "virtual",
        t,
        {
            "V_in": drive,
            "x": np.asarray(seen["x"]) + 2e-9 * rng.standard_normal(samples),
            "i": np.asarray(seen["i"]) + 1e-4 * rng.standard_normal(samples),
        },
        {"V_in": "V", "x": "m", "i": "A"},
    )
    if free is None:
        return Study(made, r, hold="linear"), truth
    held = {n: v for n, v in truth.items() if n not in free}
    return Study(made, r, tuple(free), held, hold="linear"), truth


def worst_miss(result: Estimation, truth: dict[str, float]) -> float:
    """Return the largest distance of an estimate to the truth, in standard errors."""
    worst = 0.0
    for e in result.estimates:
        if e.name in truth:
            error = (e.ci95[1] - e.ci95[0]) / (2 * 1.96)
            worst = max(worst, abs(e.value - truth[e.name]) / error)
    return worst


def _stack(say: Printer, samples: int, operators: int, repeats: int) -> None:
    study, truth = stack_study(samples, operators)
    spent = timed(lambda: estimate(study), repeats)
    verdict = "yes" if spent.wall < LIMIT else "NO"
    say(
        f"stack with {operators} operators, {samples} samples at 100 kHz, {len(study.free)} "
        f"unknowns: {spent.wall:.2f} s (processor {spent.processor:.2f} s), "
        f"{len(spent.result.trace) - 1} iterations, worst miss "
        f"{worst_miss(spent.result, truth):.1f} standard errors, {spent.result.status.value}; "
        f"limit {LIMIT:.0f} s: {verdict}"
    )


def small_record(samples: int) -> Recording:
    """Return a virtual record of a spring under a random force."""
    rng = np.random.default_rng(0)
    t = 0.01 * np.arange(samples)
    force = 10.0 * np.convolve(rng.standard_normal(samples), np.ones(4) / 2, "same")
    x = np.asarray(simulate(spring(), t, {"F": force}, x0="rest", hold="linear")["x"])
    x = x + 1e-3 * float(x.std()) * rng.standard_normal(samples)
    return Recording.from_arrays("small", {"F[N]": force, "x[m]": x}, fs=100.0)


def _small(say: Printer, samples: int = 200, repeats: int = 15) -> None:
    """Print the time of a small fit, its study stated anew each time."""
    recording, graph = small_record(samples), spring().with_values(OFF)
    spent = timed(lambda: estimate(Study(graph, recording)), repeats)
    verdict = "yes" if spent.wall < SMALL else "NO"
    say(
        f"spring, 3 parameters, {samples} samples: {1e3 * spent.wall:.1f} ms (processor "
        f"{1e3 * spent.processor:.1f} ms), {len(spent.result.trace) - 1} iterations, "
        f"{spent.result.status.value}; limit {1e3 * SMALL:.0f} ms: {verdict}"
    )


SMALL = 0.02
OFF = {"m": 0.6, "d": 1.5, "k": 230.0}
"""Where the small fit starts."""


def _peers(say: Printer, samples: int, repeats: int) -> None:
    recording = duffing_record(samples)
    ours = by_us(recording, repeats)
    say(f"hardening spring, 4 parameters, {samples} samples; ours: {_told(ours)}")
    scipy = by_scipy(recording)
    casadi = by_casadi(recording, repeats)
    for name, peer, wanted in (
        ("SciPy least_squares over solve_ivp (LSODA), one run", scipy, 50.0),
        (
            "CasADi multiple shooting (RK4, map, Gauss-Newton, IPOPT), building left out",
            casadi,
            2.0,
        ),
    ):
        ratio = peer.wall / ours.wall
        apart = max(abs(peer.values[n] / ours.values[n] - 1) for n in TRUTH)
        say(
            f"{name}: {_told(peer)}; ratio {ratio:.1f}, of processor time "
            f"{peer.processor / ours.processor:.1f} (wanted {wanted:.0f}: "
            f"{'yes' if ratio >= wanted else 'NO'}), rms misfit {peer.rms / ours.rms:.6f} of ours, "
            f"values apart by at most {apart:.1e}"
        )
    say("opty: not measured, its cyipopt has no wheel for this platform")


def _told(f: Fitted) -> str:
    return (
        f"{f.wall:.3f} s (processor {f.processor:.3f} s), {f.iterations} iterations, rms misfit "
        f"{f.rms / NOISE:.4f} of the noise"
    )


def _growth(say: Printer, share: float, repeats: int) -> None:
    for what, sizes, action in (
        ("samples", (4096, 16_384, 65_536, 262_144), _by_samples),
        ("free parameters of a stack with 14 operators", (2, 5, 10, 20), _by_parameters),
        ("operators with 6 free parameters", (1, 4, 16, 64), _by_operators),
        ("records of 4096 samples", (1, 2, 4, 8, 16), _by_records),
    ):
        wanted = sorted({max(sizes[0], int(n * share)) for n in sizes})
        rows = []
        for n in wanted:
            study = action(n)
            rows.append(timed(lambda s=study: estimate(s), repeats))  # type: ignore[misc]
        _row(say, what, wanted, [r.wall for r in rows], [r.processor for r in rows], [
            len(r.result.trace) - 1 for r in rows
        ])  # fmt: skip
    _starts(say, share)


def _row(
    say: Printer,
    what: str,
    sizes: Sequence[int],
    wall: Sequence[float],
    processor: Sequence[float],
    iterations: Sequence[int],
) -> None:
    cells = ", ".join(
        f"{n}: {w:.2f} s ({c:.2f} s, {i})"
        for n, w, c, i in zip(sizes, wall, processor, iterations, strict=True)
    )
    steps = [c / max(i, 1) for c, i in zip(processor, iterations, strict=True)]
    grown = ""
    if len(sizes) > 1:
        grown = (
            f"; exponent {exponent(sizes, wall):.2f}, of the processor time an iteration "
            f"{exponent(sizes, steps):.2f}"
        )
    say(f"{what} - wall (processor, iterations): {cells}{grown}")


def _by_samples(n: int) -> Study:
    return Study(
        duffing(), duffing_record(n, accuracy=ROUGH), tuple(TRUTH), initial="rest",
        noise={"x": NOISE}, nuisances=NO_NUISANCES, n_sub=1, hold="linear",
    )  # fmt: skip


def _by_parameters(n: int) -> Study:
    first = ["C_nl", "R_e", "T", "k", "m", "R_nl"]
    names = [*first[: min(n, 6)], *(f"h_{i}_C_nl" for i in range(1, n - 5))]
    return _plain(stack_study(4096, 14, names)[0])


def _by_operators(n: int) -> Study:
    return _plain(stack_study(4096, n, ("T", "R_e", "C_nl", "k", "m", "R_nl"))[0])


def _plain(study: Study) -> Study:
    return study.changed(n_sub=1, nuisances=NO_NUISANCES, noise={"x": 2e-9, "i": 1e-4})


def _by_records(n: int) -> Study:
    return Study(
        duffing(), [duffing_record(4096, k, ROUGH) for k in range(n)], tuple(TRUTH),
        initial="rest", noise={"x": NOISE}, nuisances=NO_NUISANCES, n_sub=1, hold="linear",
    )  # fmt: skip


def _starts(say: Printer, share: float) -> None:
    """Print starts on all cores; the first call pays for the workers and is left out."""
    free = tuple(Vary(n, lower=v / 4, upper=v * 4) for n, v in TRUTH.items())
    study = Study(
        duffing(), duffing_record(4096, accuracy=ROUGH), free, initial="rest", noise={"x": NOISE},
        nuisances=NO_NUISANCES, n_sub=1, hold="linear",
    )  # fmt: skip
    sizes = sorted({max(1, int(n * share)) for n in (1, 2, 4, 8, 16, 32)})
    many_starts(study, 2, max_iterations=4)
    walls = []
    for n in sizes:
        begin = time.perf_counter()
        many_starts(study, n)
        walls.append(time.perf_counter() - begin)
    cells = ", ".join(f"{n}: {w:.2f} s" for n, w in zip(sizes, walls, strict=True))
    grown = f"; exponent {exponent(sizes, walls):.2f}" if len(sizes) > 1 else ""
    say(f"starts on {os.cpu_count()} cores, 4096 samples, one run each: {cells}{grown}")
