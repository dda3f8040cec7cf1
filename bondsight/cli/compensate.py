"""``bondsight compensate``: hysteresis compensation of the stack, with numbers and a figure."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bondgraph.support.errors import UnusableInput
from bondsight.cli.arguments import OUT, nonnegative

if TYPE_CHECKING:
    from actuators.compensation import VirtualActuator
    from bondgraph.graph.bond_graph import BondGraph
    from bondgraph.support.ops import FloatArray

FORMATS = (".svg", ".png")

FINER = 4
"""Steps of the bench in one of the actuator's."""


def add_compensate_command(verbs: Any) -> None:
    """Add ``compensate`` to the sub-parsers of ``bondsight``."""
    p = verbs.add_parser(
        "compensate", help="the voltage that makes a stack follow a target; compensations compared"
    )
    p.add_argument(
        "source", nargs="*", type=Path, metavar="FIT|RECORDING",
        help="what bondsight stack identify wrote, or recordings to identify; without one "
        "compensations of simulated stacks are compared",
    )  # fmt: skip
    p.add_argument(
        "--target", metavar="FILE|TEXT",
        help="with a source: displacement from rest in a file, or as bondsight regulate takes it",
    )  # fmt: skip
    p.add_argument(
        "--station", type=Path, metavar="FILE",
        help="then play it on this bench, and measure loop and error before and after",
    )  # fmt: skip
    p.add_argument(
        "--closed", type=float, metavar="HZ",
        help="and close the loop there, PI behind the inverse, at so many ticks a second",
    )  # fmt: skip
    p.add_argument(
        "--controller", type=Path, metavar="FILE",
        help="also write PI behind this stack's inverse, .toml, for a loop on a bench",
    )  # fmt: skip
    p.add_argument("--rate", type=float, default=3125.0, help="of the voltage, samples a second")
    p.add_argument(
        "--out", type=Path, default=None,
        help="figure, .svg or .png; with a source the voltage, .npz or .csv",
    )  # fmt: skip
    p.add_argument("--frequency", type=float, action="append", metavar="HZ", dest="frequencies")
    p.add_argument("--spread", type=float, default=0.1, help="deviation of the virtual actuator")
    p.add_argument("--seed", type=nonnegative, default=1)
    p.set_defaults(run=_compensate)


def _compensate(options: argparse.Namespace) -> int:
    if options.source:
        from bondsight.cli.compensate_stack import compensate_stack

        return compensate_stack(options)
    asked = {
        "--target": options.target, "--station": options.station,
        "--closed": options.closed is not None, "--controller": options.controller,
    }  # fmt: skip
    if idle := [name for name, given in asked.items() if given]:
        raise UnusableInput(
            f"compensate: {' and '.join(idle)} need an identified stack first: what bondsight "
            "stack identify wrote, or recordings"
        )
    from actuators.compensation import UNIPOLAR
    from actuators.compensation import study as of
    from bondsight.cli.figures import save_figure
    from bondsight.cli.output import writable

    out = options.out or OUT / "compensation.svg"
    writable(out.parent)
    if out.suffix.lower() not in FORMATS:
        raise UnusableInput(f"compensate: figure {out} must end in {' or '.join(FORMATS)}")
    frequencies = tuple(options.frequencies or (1.0, 50.0))
    study = of.compensation_study(frequencies=frequencies, spread=options.spread, seed=options.seed)
    print(of.operator_table(of.inverse_operators(study.seed)))
    print(f"\n{of.model_table(of.inverse_models())}")
    print(f"\n{study.margin_table()}")
    low, high = UNIPOLAR.low, UNIPOLAR.high
    for f in frequencies:
        table = study.tracked(f)
        print(f"\n{table}")
        print(f"samples held at {low:g} or {high:g} V, all runs together: {table.held}")
    print(f"\n{study.open_loop('virtual bench', max(frequencies), bench_response)}")
    print(f"\nfigure: {save_figure(out, lambda: study.figure(frequencies[0]))}")
    return 0


def bench_response(
    actuator: VirtualActuator, voltage: FloatArray, sample_rate: float
) -> FloatArray:
    """Return the displacement (m) of the stack model on the virtual bench.

    Its equations follow from a bond graph and its steps are exact: it shares neither with the
    actuator, whose method is Runge's and Kutta's.

    Parameters
    ----------
    actuator : VirtualActuator
        Gives the numbers; creep and amplifier are not part of this model.
    voltage : ndarray, shape (N,), V
        Linear between samples.
    sample_rate : float
        Hz.
    """
    import numpy as np

    from hardware.virtual import ModelPlant

    n = (voltage.size - 1) * FINER * actuator.substeps(1.0 / sample_rate)
    per = n // (voltage.size - 1)
    plant = ModelPlant(bench_model(actuator), "V_in", "x", step=1.0 / (sample_rate * per))
    middles = (np.arange(n) + 0.5) / per
    x = plant.advance(np.interp(middles, np.arange(voltage.size), voltage)).x
    return np.concatenate([[0.0], x[per - 1 :: per]])


def bench_model(actuator: VirtualActuator) -> BondGraph:
    """Return the stack with the actuator's numbers: its slipping elements in the dielectric."""
    from actuators.stack.bond_graph import stack_bond_graph
    from bondgraph.hysteresis import MaxwellResistiveCapacitor
    from bondgraph.laws import Hysteretic

    a = actuator
    # what never slips is an element that would slip a thousand times beyond all voltages
    slipping = MaxwellResistiveCapacitor.from_table(
        [*(1.0 / g for g in a.slip_gains), a.capacitance],
        [*(g * r for g, r in zip(a.slip_gains, a.slip_limits, strict=True)), 1e5],
    )
    return stack_bond_graph(
        Hysteretic(slipping), capacitance=a.capacitance, transducer=a.transducer,
        stiffness=a.stiffness, mass=a.mass, damping=a.damping, resistance=a.resistance, length=1.0,
    )  # fmt: skip
