"""``bondsight compensate FIT --target FILE``: the voltage for one stack, tried on its bench."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bondgraph.support.errors import UnusableInput, real_number
from bondsight.cli.arguments import OUT, fitting
from bondsight.cli.output import writable
from bondsight.cli.target import target_of

if TYPE_CHECKING:
    from actuators.compensation.identified_tracking import Compensation
    from actuators.stack.identified import IdentifiedStack
    from bondgraph.support.ops import FloatArray
    from hardware.regulation import LoopPlan

INTEGRAL = 0.3
"""Integral gain over the rate of a loop; with a sample and a half of delay 60 degrees are left."""
MARGIN = 0.2
"""Rest that is recorded before the target (s)."""


def compensate_stack(options: argparse.Namespace) -> int:
    """Write the voltage; on a bench, measure before and after."""
    import numpy as np

    from actuators.compensation import UNIPOLAR, tracking
    from actuators.compensation.identified_tracking import compensation, tracking_table
    from bondgraph.signals.recording import Recording

    if not options.target:
        raise UnusableInput("compensate: give --target, the displacement that is wanted")
    out = options.out or OUT / "voltage.npz"
    if out.suffix not in (".npz", ".csv"):
        raise UnusableInput(f"compensate --out {out}: write the voltage to .npz or .csv")
    if options.closed is not None:
        _ticks_a_second(options.closed)
    settings = None
    if options.station is not None:
        from hardware.station import read_settings

        settings = read_settings(options.station)
    elif options.closed is not None:
        raise UnusableInput("--closed: a loop needs a bench; give --station FILE")
    limits = UNIPOLAR if settings is None else settings.envelope.limits
    stack = _stack_of(options.source)
    rate = real_number("--rate", options.rate)
    target = target_of(options.target, rate, "m")
    made = compensation(stack, target, rate, limits)
    before = stack.response(made.linear, rate, made.history)
    after = stack.response(made.inverse, rate, made.history)
    rows = {
        "model, plain gain": tracking(target, before),
        "model, inverse": tracking(target, after),
    }
    files = [out, *([options.controller] if options.controller is not None else [])]
    for file in files:
        writable(file.parent)
    if settings is not None:
        _check_bench(options, settings, out.parent)
    time = np.arange(target.size) / rate
    voltage = Recording(
        out.stem, time, {"V": made.inverse, "x_ref": target}, {"V": "V", "x_ref": "m"}
    )
    print(
        f"stack:      {stack.name}, {stack.operator.kind}, held out {1e9 * stack.held_out:.2f} nm; "
        f"{1e6 * stack.stroke(made.history):.3f} um up to {stack.high:g} V"
    )
    if settings is not None:
        # a bench may refuse too, and what is refused leaves no file
        with_bench = _measured(options, settings, made, stack)
        rows |= {name: tracking(target, x) for name, x in with_bench.items()}
    written = voltage.save(out) if out.suffix == ".npz" else voltage.write_csv(out)
    print(f"voltage:    {written}, {made.inverse.min():.2f} to {made.inverse.max():.2f} V")
    if options.controller is not None:
        from bondgraph.support.whole_file import write_atomically

        write_atomically(options.controller, controller_text(stack))
        print(f"controller: {options.controller}")
    if settings is not None and options.closed is not None:
        rows["bench, PI + inverse"] = tracking(*_closed(options, settings, stack))
    print(tracking_table(rows, float(np.ptp(target))))
    return 0


def controller_text(stack: IdentifiedStack) -> str:
    """Return PI behind the inverse of a stack's operator as the TOML of a controller.

    Behind an inverse the stack is a gain of 1 with a sample or two of delay, so the integral alone
    does.
    """
    from hardware.station.settings import toml_text

    rate = 1000.0
    return toml_text(
        {"kind": "inverse", "rate": rate, "integral": INTEGRAL * rate,
         "operator": stack.operator.to_dict()}
    )  # fmt: skip


def _stack_of(sources: list[Path]) -> IdentifiedStack:
    """Return the stack of a file, or identify it from recordings."""
    from actuators.stack.identification import identify_stack
    from actuators.stack.identified import IdentifiedStack
    from actuators.stack.loading_curve import Interval
    from bondgraph.signals.recording import Recording

    if sources[0].suffix == ".json":
        if len(sources) > 1:
            raise UnusableInput(f"compensate: {sources[0]} is one stack; leave the others out")
        return IdentifiedStack.open(sources[0])
    try:
        recordings = [Recording.read(f) for f in sources]
    except UnusableInput as error:
        raise fitting(error) from None
    # neither k nor T is needed for the voltage
    return identify_stack(recordings, Interval.of(65e6, 0.0), name=sources[0].stem).stack


def _check_bench(options: argparse.Namespace, settings: Any, folder: Path) -> None:
    """Refuse what the last of the runs would fail at, before the first one moves anything."""
    from hardware.regulation import check_rate
    from hardware.station import open_station
    from hardware.storage import new_files

    for name in ("plain-gain", "inverse", *(["closed"] if options.closed is not None else [])):
        new_files(folder / f"bench-{name}")
    if options.closed is not None:
        plan = _loop(options)
        with open_station(settings) as bench:
            check_rate(bench.loop(plan), plan)


def _ticks_a_second(asked: float) -> float:
    rate = real_number("--closed", asked)
    if rate <= 0.0:
        raise UnusableInput(f"--closed {rate:g}: give ticks a second above 0")
    return rate


def _loop(options: argparse.Namespace) -> LoopPlan:
    from hardware.regulation import LoopPlan

    rate = _ticks_a_second(options.closed)
    return LoopPlan(
        target_of(options.target, rate, "m"), rate, name="closed", asked={"target": options.target}
    )


def _measured(
    options: argparse.Namespace, settings: Any, made: Compensation, stack: IdentifiedStack
) -> dict[str, FloatArray]:
    """Play both voltages behind the same history and return the displacements (m)."""
    import numpy as np

    from actuators.stack.ramps import from_rest
    from hardware.recorder import TakePlan, record
    from hardware.station import open_station

    stroke = 0.5 * stack.high * (1.0 - np.cos(np.linspace(0.0, 2.0 * np.pi, round(made.rate))))
    rest = np.zeros(max(16, round(MARGIN * made.rate)))
    found = {}
    folder = (options.out or OUT / "voltage").parent
    with open_station(settings) as bench:
        for name, volt in (("plain-gain", made.linear), ("inverse", made.inverse)):
            plan = TakePlan(
                np.concatenate((rest, volt)), made.rate, name, "clock", erase=stroke,
                settle=stack.settling, asked={"target": options.target},
            )  # fmt: skip
            taken = record(bench.station(plan), plan, folder / f"bench-{name}")
            print(f"recording:  {taken.path}")
            found[f"bench, {name.replace('-', ' ')}"] = from_rest(taken.recording).x[rest.size :]
        print(f"output:     {bench.output.status}")
    return found


def _closed(
    options: argparse.Namespace, settings: Any, stack: IdentifiedStack
) -> tuple[FloatArray, FloatArray]:
    """Close the loop on the bench; return reference and displacement at its ticks (m)."""
    import numpy as np

    from hardware.regulation import InverseLoop, record_loop
    from hardware.station import open_station

    plan = _loop(options)
    controller = InverseLoop(stack.operator, 0.0, INTEGRAL * plan.rate, plan.rate)
    folder = (options.out or OUT / "voltage").parent
    with open_station(settings) as bench:
        done = record_loop(bench.loop(plan), plan, controller, folder / "bench-closed")
    print(f"recording:  {done.path}")
    for sentence in done.sentences:
        print(f"note:       {sentence}")
    return np.asarray(done.recording["x_ref"]), np.asarray(done.recording["x"])
