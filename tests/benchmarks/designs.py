"""Print measured numbers of the design tools: ``python -m tests.benchmarks.designs``.

Crest factors of flat multisines; optimal multisines for a spring beside flat ones; candidates for
a spring with memory; and how simulated fits keep the expected intervals.
"""

from __future__ import annotations

import sys

import numpy as np

from bondgraph import BondGraph, C, Dq, I, One, R, Se
from bondgraph.hysteresis import MaxwellResistiveCapacitor
from bondgraph.laws import Hysteretic
from identification.experiments.design.candidates import rank_signals
from identification.experiments.design.crest import PHASES, crest_factor, phases_of
from identification.experiments.design.loops import reversal_curves
from identification.experiments.design.multisine import multisine
from identification.experiments.design.optimal import optimal_multisine
from identification.experiments.design.sweep import sweep
from tests.identification.experiments.design.verification import verify
from tests.spring import spring


def _stage() -> BondGraph:
    with BondGraph("stage") as g:
        body = One("v")
        Se("F", unit="N") >> body >> I("m", 0.1, unit="kg", fixed=True)
        body >> R("d", 40.0, unit="N*s/m", fixed=True)
        memory = MaxwellResistiveCapacitor((2e4, 1e4, 5e3), (6.0, 9.0, 10.0))
        body >> C("k", law=Hysteretic(memory, ("stiffnesses", "breakaways")))
        body >> C("guide", stiffness=1e4, unit="N/m")
        body >> Dq("x", unit="m")
    return g


def _crest() -> None:
    print("crest factors (bounds of the continuous course):")
    for count in (31, 100, 390, 1500):
        lines, a, rng = np.arange(1, count + 1), np.ones(count), np.random.default_rng(0)
        told = (
            f"{k.replace('_', ' ')} {crest_factor(lines, a, phases_of(k, lines, a, rng)):.3f}"
            for k in PHASES
        )
        print(f"  {count} lines: {', '.join(told)}")


def _linear(fits: int) -> None:
    noise = {"x": 2e-4}
    for criterion in ("D", "A"):
        made = optimal_multisine(
            spring(), "F", noise, rate=50.0, period=1000, band=(0.05, 15.0), periods=3,
            criterion=criterion,
        )  # fmt: skip
        print(made)
        for signal, reference in ((made.signal, False), (made.flat, True)):
            done = verify(
                spring(), signal, noise, made.expected, fits=fits, offsets=False,
                reference=reference,
            )  # fmt: skip
            print(f"{signal.kind}: {done}")


def _memory(fits: int) -> None:
    rate, noise = 2000.0, {"x": 2e-6}
    tour = reversal_curves(60.0, 6, rate, slew=400.0, lowest=-60.0, name="F", unit="N")
    n = tour.values.size
    others = [
        multisine(
            rate, n, band=(0.3, 30.0), peak=p, phases="low_crest", name="F", unit="N"
        )
        for p in (60.0, 10.0)
    ]  # fmt: skip
    run = sweep(rate, 0.3, 30.0, (n - 1) / rate, amplitude=60.0, name="F", unit="N")
    found = rank_signals(_stage(), [tour, *others, run], noise, initial="rest")
    print(found)
    done = verify(_stage(), found.best, noise, found.expected, initial="rest", fits=fits)
    print(f"{found.best.kind}: {done}")


def main(arguments: list[str]) -> None:
    """Print everything; the one argument is the number of simulated fits."""
    fits = int(arguments[0]) if arguments else 100
    _crest()
    _linear(fits)
    _memory(fits)


if __name__ == "__main__":
    main(sys.argv[1:])
