"""What a diagnosis costs: seconds and memory, and how they grow with the record and the model.

The plant is a chain of masses of which one spring stiffens; SciPy integrates it from its equations
of motion. Every row is a process of its own, so that its peak memory is its own.
"""

from __future__ import annotations

import json
import math
import resource
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from bondgraph import BondGraph, C, Dq, I, One, R, Recording, Se, Zero
from bondgraph.support.arrays import Array
from tests.benchmarks.graphs import limit_line

STEP = 2e-3
MASS, DAMPING, DRAG, STIFFNESS, GROUND = 0.5, 1.5, 2.0, 1500.0, 1500.0
CONCEALED = ("hardening", "stop", "drag", "dry friction", "slack", "nothing")
"""What the last spring of the chain, or the last mass, has and the model lacks."""
SECONDS, CLEAN, MEMORY = 60.0, 10.0, 2048.0


@dataclass(frozen=True)
class Case:
    """One diagnosis to measure.

    Attributes
    ----------
    samples, masses, sensors : int
    catalogue : float
        Part of the catalogue that may be named; the concealed effect always may.
    jobs : int
        Processes.
    concealed : str
        One of `CONCEALED`.
    """

    samples: int = 20_000
    masses: int = 4
    sensors: int = 3
    catalogue: float = 1.0
    jobs: int = 2
    concealed: str = "hardening"


@dataclass(frozen=True)
class Cost:
    """What it took.

    Attributes
    ----------
    seconds : float
    memory : float
        MiB: peak of the process, and of the largest of its workers once for each.
    pairs, fitted : int
        Pairs of effect and place that were screened, and that were fitted.
    answer : str
    stages : dict
        Seconds between what was said while it ran: where the time went.
    """

    seconds: float
    memory: float
    pairs: int
    fitted: int
    answer: str
    stages: Mapping[str, float] = field(default_factory=dict)


def diagnosis(quick: bool = False) -> None:
    """Print the diagnosis of 20,000 samples of three channels, then the growth.

    Parameters
    ----------
    quick : bool
        Short records and one process: whether it works, not what it costs.
    """
    whole, families = cases(quick)
    for what in ("first time", "again"):
        made = cost(whole)
        print(_row(f"{what}: {_words(whole)}", made))
    if not quick:
        _limits({c: made if c == whole.concealed else cost(replace(whole, concealed=c))
                 for c in CONCEALED})  # fmt: skip
    for what, listed in families.items():
        found = {_size(what, c): made if c == whole else cost(c) for c in listed}
        for size, each in found.items():
            print(_row(f"{what} {size:g}", each))
        if len(found) > 1:
            print(f"growth of the time with {what}: exponent {exponent(found):.2f}")


def _limits(made: Mapping[str, Cost]) -> None:
    """Print what was concealed and what it took, beside the limits."""
    for what, each in made.items():
        print(_row(what, each))
        print("    " + ", ".join(f"{s:.1f} s {name}" for name, s in each.stages.items()))
    found = [c for what, c in made.items() if what != "nothing"]
    slow = float(np.quantile([c.seconds for c in found], 0.95))
    size = "20,000 samples, 3 sensors, whole catalogue"
    print(limit_line(f"{size}, 95th percentile, s", slow, SECONDS))
    print(limit_line(f"{size}, nothing missing, s", made["nothing"].seconds, CLEAN))
    print(limit_line(f"{size}, most MiB", max(c.memory for c in made.values()), MEMORY))


def cases(quick: bool = False) -> tuple[Case, Mapping[str, Sequence[Case]]]:
    """Return the main case, and the families in which one size grows."""
    if quick:
        base = Case(samples=1000, masses=2, sensors=1, catalogue=0.25, jobs=1)
        return base, {"sensors": (base, replace(base, sensors=2))}
    base = Case()
    small = replace(base, samples=5000)
    return base, {
        "samples": [replace(base, samples=n) for n in (2500, 5000, 10_000, 20_000)],
        "masses": [replace(small, masses=n, sensors=min(n, 3)) for n in (2, 4, 8)],
        "catalogue": [replace(small, catalogue=part) for part in (0.25, 0.5, 1.0)],
        "sensors": [replace(small, sensors=n) for n in (1, 2, 3)],
    }


def exponent(found: Mapping[float, Cost]) -> float:
    """Slope of the logarithm of the time over that of the size, by least squares."""
    x = np.log([float(s) for s in found])
    y = np.log([c.seconds for c in found.values()])
    return float(np.polyfit(x, y, 1)[0])


def cost(case: Case) -> Cost:
    """Measure one case in a process of its own."""
    run = subprocess.run(
        [sys.executable, "-m", MODULE, _asked(case)],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    if run.returncode:
        last = (run.stderr.strip().splitlines() or ["no message"])[-1]
        return Cost(math.nan, math.nan, 0, 0, f"failed: {last}")
    return Cost(**json.loads(run.stdout.strip().splitlines()[-1]))


MODULE = "tests.benchmarks.diagnosis"


def chain(masses: int, sensors: int) -> BondGraph:
    """Linear model of a chain: a spring to the ground at its first mass, and between all masses.

    Raises
    ------
    ValueError
        If there are more sensors than masses.
    """
    if sensors > masses:
        raise ValueError(f"{sensors} sensors need as many masses; there are {masses}")
    read = places(masses, sensors)
    with BondGraph(f"chain_of_{masses}") as graph:
        before: One | None = None
        for i in range(1, masses + 1):
            body = One(f"v_{i}")
            if before is None:
                Se("F", unit="N") >> body >> C("g_1", stiffness=0.98 * GROUND, unit="N/m")
            else:
                link, rod = Zero(f"link_{i}"), One(f"rod_{i}")
                before >> link >> body
                link >> rod >> C(f"k_{i}", stiffness=0.97 * STIFFNESS, unit="N/m")
                rod >> R(f"d_{i}", 0.9 * DAMPING, unit="N*s/m")
            body >> I(f"m_{i}", 1.03 * MASS, unit="kg")
            body >> R(f"b_{i}", 1.1 * DRAG, unit="N*s/m")
            if i in read:
                body >> Dq(f"x_{i}", unit="m")
            before = body
    return graph


def places(masses: int, sensors: int) -> tuple[int, ...]:
    """Masses that are measured: the last one, then spread over the chain."""
    return tuple(
        sorted({round(masses - i * (masses - 1) / max(sensors, 1)) for i in range(sensors)})
    )


def record(case: Case, seed: int = 1) -> Recording:
    """Return a recording of the chain with what is concealed."""
    rng = np.random.default_rng(seed)
    t: Array = (STEP * np.arange(case.samples)).astype(np.float64)
    tones = np.linspace(0.3, 15.0, 60)
    force = np.cos(2 * np.pi * np.outer(t, tones) + rng.uniform(0, 2 * np.pi, 60)).sum(axis=1)
    force *= 25.0 / np.abs(force).max()
    force *= np.minimum(t / (100 * STEP), 1.0)  # it starts at rest
    n = case.masses

    def rates(time: float, state: Array) -> Array:
        x, v = state[:n], state[n:]
        stretch = np.diff(x)
        link = STIFFNESS * stretch + DAMPING * np.diff(v)
        spring, rubbing = _extra(case.concealed, stretch[-1], v[-1])
        link[-1] += spring
        total = -DRAG * v
        total[-1] -= rubbing
        total[0] += np.interp(time, t, force) - GROUND * x[0]
        total[:-1] += link
        total[1:] -= link
        return np.concatenate([v, total / MASS])

    run = solve_ivp(
        rates, (0.0, t[-1]), np.zeros(2 * n), "LSODA", t, rtol=1e-7, atol=1e-10, max_step=2 * STEP
    )
    channels = {"F": force}
    for i in places(n, case.sensors):
        channels[f"x_{i}"] = run.y[i - 1] + 1e-5 * rng.standard_normal(case.samples)
    units = {name: "N" if name == "F" else "m" for name in channels}
    return Recording(f"chain_of_{n}", t, channels, units)


def _extra(concealed: str, stretch: float, speed: float) -> tuple[float, float]:
    """Force that the last spring adds (N), and what brakes the last mass (N)."""
    if concealed == "hardening":
        return 1e7 * stretch**3, 0.0
    if concealed == "stop":
        return 4e3 * max(stretch - 4e-3, 0.0), 0.0
    if concealed == "slack":  # of 1 mm each way: the spring does not pull within
        return -STIFFNESS * float(np.clip(stretch, -1e-3, 1e-3)), 0.0
    if concealed == "drag":
        return 0.0, 20.0 * speed * abs(speed)
    if concealed == "dry friction":
        return 0.0, 0.4 * math.tanh(speed / 2e-3)
    return 0.0, 0.0


def measured(case: Case) -> Cost:
    """Diagnose in this process."""
    from identification.diagnosis.diagnose import diagnose
    from identification.diagnosis.search.candidates import DiagnosisOptions

    recording = record(case)
    graph = chain(case.masses, case.sensors)
    begin = time.perf_counter()
    options = DiagnosisOptions(jobs=case.jobs, without=_left_out(case.catalogue))
    said: list[tuple[float, str]] = []
    d = diagnose(
        graph, recording, options=options,
        progress=lambda what, _: said.append((time.perf_counter() - begin, what)),
    )  # fmt: skip
    seconds = time.perf_counter() - begin
    own = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    worker = _largest_worker() if case.jobs > 1 else 0.0
    named = ", ".join(s.chosen.label for s in d.findings if s.chosen) or d.kind
    return Cost(
        seconds,
        own + case.jobs * worker,
        len(d.ranking),
        sum(len(s.trials) for s in d.steps),
        named,
        _stages(said, seconds),
    )


def _stages(said: Sequence[tuple[float, str]], end: float) -> dict[str, float]:
    """Seconds that followed each thing said, all fits of the search together.

    What is said of a fit is said when it is done.
    """
    found: dict[str, float] = {}
    last, doing = 0.0, "reading the recording"
    for now, what in [*said, (end, "")]:
        fitted = what.startswith("fitting ") and " at " in what
        name = SEARCH if fitted and doing == "deciding" else doing
        found[name] = found.get(name, 0.0) + now - last
        last, doing = now, "deciding" if fitted else what
    return {name: s for name, s in found.items() if s >= 0.05}


SEARCH = "fitting effects"


def _largest_worker() -> float:
    """Peak of the largest worker process, MiB, without what it had of its parent when forked."""
    children = " ".join(p.read_text() for p in Path("/proc/self/task").glob("*/children")).split()
    if children:
        return max(_peak(Path(f"/proc/{child}/status")) for child in children)
    from joblib.externals.loky import get_reusable_executor

    get_reusable_executor().shutdown(wait=True)
    return resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024


def _peak(status: Path) -> float:
    """Peak of a process, MiB; zero where the system does not tell."""
    try:
        lines = status.read_text().splitlines()
    except OSError:
        return 0.0
    return next((float(s.split()[1]) / 1024 for s in lines if s.startswith("VmHWM:")), 0.0)


def _left_out(part: float) -> tuple[str, ...]:
    """Effects to leave out so that about `part` of the catalogue is left, spread over families."""
    from identification.diagnosis.catalogue import CATALOGUE

    names = [e.name for e in CATALOGUE]
    kept = {"nonlinear_stiffness", *names[:: max(1, round(1 / part))]}
    return tuple(n for n in names if n not in kept)


def _size(what: str, case: Case) -> float:
    return float(getattr(case, what))


def _words(case: Case) -> str:
    part = "whole catalogue" if case.catalogue == 1 else f"{case.catalogue:g} of the catalogue"
    return (
        f"{case.samples} samples, {case.masses} masses, {case.sensors} sensors, {part}, "
        f"{case.jobs} processes"
    )


def _row(what: str, c: Cost) -> str:
    return (
        f"{what}: {c.seconds:.1f} s, {c.memory:.0f} MiB, {c.pairs} pairs screened, "
        f"{c.fitted} fitted: {c.answer}"
    )


def _asked(case: Case) -> str:
    return json.dumps(asdict(case))


def _main(arguments: Sequence[str]) -> int:
    asked: dict[str, Any] = json.loads(arguments[0])
    print(json.dumps(asdict(measured(Case(**asked)))))
    return 0


if __name__ == "__main__":
    sys.exit(_main(sys.argv[1:]))
