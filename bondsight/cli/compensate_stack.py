"""``bondsight compensate FIT --target FILE``: the voltage for one stack, tried on its bench."""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bondgraph.support.errors import UnusableInput, real_number
from bondsight.cli.arguments import OUT
from bondsight.cli.output import writable

if TYPE_CHECKING:
    from actuators.compensation.identified_tracking import Compensation
    from actuators.stack.identified import IdentifiedStack
    from bondgraph.support.ops import FloatArray

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
    settings = None
    if options.station is not None:
        from hardware.station import read_settings

        settings = read_settings(options.station)
    limits = UNIPOLAR if settings is None else settings.envelope.limits
    stack = _stack_of(options.source)
    target, rate = _target(options.target, options.rate)
    made = compensation(stack, target, rate, limits)
    writable(out.parent)
    time = np.arange(target.size) / rate
    voltage = Recording(
        out.stem, time, {"V": made.inverse, "x_ref": target}, {"V": "V", "x_ref": "m"}
    )
    print(
        f"stack:      {stack.name}, {stack.operator.kind}, held out {1e9 * stack.held_out:.2f} nm; "
        f"{1e6 * stack.stroke(made.history):.3f} um up to {stack.high:g} V"
    )
    written = voltage.save(out) if out.suffix == ".npz" else voltage.write_csv(out)
    print(f"voltage:    {written}, {made.inverse.min():.2f} to {made.inverse.max():.2f} V")
    if options.controller is not None:
        from bondgraph.support.whole_file import write_atomically

        writable(options.controller.parent)
        write_atomically(options.controller, controller_text(stack))
        print(f"controller: {options.controller}")
    before = stack.response(made.linear, rate, made.history)
    after = stack.response(made.inverse, rate, made.history)
    rows = {
        "model, plain gain": tracking(target, before),
        "model, inverse": tracking(target, after),
    }
    if settings is not None:
        with_bench = _measured(options, settings, made, stack)
        rows |= {name: tracking(target, x) for name, x in with_bench.items()}
    print(tracking_table(rows, float(np.ptp(target))))
    return 0


def controller_text(stack: IdentifiedStack, rate: float = 1000.0) -> str:
    """Return PI behind the inverse of a stack's operator as the TOML of a controller.

    Behind an inverse the stack is a gain of 1 with a sample or two of delay, so the integral alone
    does: a third of the rate (Hz) leaves a phase margin of 60 degrees.
    """
    head = ['kind = "inverse"', f"rate = {rate!r}", f"integral = {0.3 * rate!r}"]
    return "\n".join([*head, *_tables("operator", stack.operator.to_dict()), ""])


def _tables(name: str, values: Mapping[str, Any]) -> list[str]:
    """Return a table and those inside it as lines of TOML."""
    # a JSON text of numbers, texts and lists is a TOML text too
    plain = [f"{k} = {json.dumps(v)}" for k, v in values.items() if not isinstance(v, Mapping)]
    inner = [_tables(f"{name}.{k}", v) for k, v in values.items() if isinstance(v, Mapping)]
    return ["", f"[{name}]", *plain, *(line for table in inner for line in table)]


def _stack_of(sources: list[Path]) -> IdentifiedStack:
    """Return the stack of a file, or identify it from recordings."""
    from actuators.stack.identification import identify_stack
    from actuators.stack.identified import IdentifiedStack
    from actuators.stack.ramps import Interval
    from bondgraph.signals.recording import Recording

    if sources[0].suffix == ".json":
        if len(sources) > 1:
            raise UnusableInput(f"compensate: {sources[0]} is one stack; leave the others out")
        return IdentifiedStack.open(sources[0])
    recordings = [Recording.read(f) for f in sources]
    # neither k nor T is needed for the voltage
    return identify_stack(recordings, Interval.of(65e6, 0.0), name=sources[0].stem).stack


def _target(text: str, rate: float) -> tuple[FloatArray, float]:
    import numpy as np

    from actuators.compensation import thesis_reference
    from actuators.stack.ramps import channel_in
    from bondgraph.signals.recording import Recording

    kind, _, rest = text.partition(":")
    if kind == "thesis":
        hz = real_number("--target thesis", rest or 1.0)
        if not 0.0 < hz <= 0.025 * real_number("--rate", rate):
            raise UnusableInput(f"--target {text}: give up to 1/40 of the rate {rate:g} Hz")
        time = np.arange(round(2.0 * rate / hz) + 1) / rate
        return np.asarray(thesis_reference(time, hz).x), rate
    recording = Recording.read(Path(text))
    return channel_in(recording, "m"), recording.fs


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
