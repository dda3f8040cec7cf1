"""``bondsight compensate``: hysteresis compensation of the stack, with numbers and a figure."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bondgraph.support.errors import UnusableInput
from bondsight.cli.arguments import OUT, nonnegative

if TYPE_CHECKING:
    from actuators.compensation import VirtualActuator
    from bondgraph.support.ops import FloatArray

FORMATS = (".svg", ".png")


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
    from actuators.compensation import study as of
    from bondsight.cli.figures import save_figure
    from bondsight.cli.output import writable

    out = options.out or OUT / "compensation.svg"
    writable(out.parent)
    if out.suffix.lower() not in FORMATS:
        raise UnusableInput(f"compensate: figure {out} must end in {' or '.join(FORMATS)}")
    frequencies = tuple(options.frequencies or (1.0, 50.0))
    study = of.compensation_study(frequencies=frequencies, spread=options.spread, seed=options.seed)
    print(of.operator_table(of.inverse_operators(study.envelope, study.seed)))
    print(f"\n{of.model_table(of.inverse_models(study.envelope))}")
    print(f"\n{study.margin_table()}")
    low, high = study.envelope.low, study.envelope.high
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
    """Return the displacement (m) of the virtual bench, whose integrator is independent.

    Parameters
    ----------
    actuator : VirtualActuator
        Gives the numbers; creep and amplifier are not part of this plant.
    voltage : ndarray, shape (N,), V
        Linear between samples.
    sample_rate : float
        Hz.
    """
    import numpy as np

    from hardware.simulators.integrator import march
    from hardware.simulators.nonsmooth import MaxwellSlipPlant
    from hardware.simulators.plant import PlantParameters

    a = actuator
    numbers = PlantParameters(
        C_q=a.capacitance, T=a.transducer, k=a.stiffness, m=a.mass, b=a.damping, R_e=a.resistance
    )
    plant = MaxwellSlipPlant(numbers, "C_nl", a.slip_limits, a.slip_gains, 0.0)
    substeps = actuator.substeps(1.0 / sample_rate)
    n = (voltage.size - 1) * substeps
    drive = np.interp(np.arange(n + 1) / substeps, np.arange(voltage.size), voltage)
    path = march(plant, np.full(n, 1.0 / (sample_rate * substeps)), drive)
    return path.x[::substeps]
