"""``bondsight regulate``: a feedback loop on a bench, guarded, journalled, its clock told."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

from bondgraph.support.errors import UnusableInput, real_number
from bondsight.cli.arguments import OUT, nonnegative
from bondsight.cli.output import writable


def add_regulate_command(verbs: Any) -> None:
    """Add the command to the sub-parsers of ``bondsight``."""
    p = verbs.add_parser("regulate", help="run a feedback loop on a bench and record it")
    p.add_argument(
        "station", nargs="?", type=Path,
        help="station file (TOML); a virtual bench that suits the controller if left out",
    )  # fmt: skip
    p.add_argument(
        "--controller", default="stack", metavar="NAME|FILE",
        help="stack (PI and inverse), stack-linear, stack-open, m661 (ultrasonic stage), lock (PLL "
        "of the resonance), force (force gauge), or a TOML file",
    )  # fmt: skip
    p.add_argument(
        "--target", default="", metavar="TEXT|FILE",
        help="sine:HZ:LOW:HIGH:SECONDS, steps:SECONDS:VALUE:... or thesis (eq. 7.3), SI; or a file",
    )  # fmt: skip
    p.add_argument("--rate", type=float, default=None, help="ticks a second (that of the file)")
    p.add_argument("--start", type=float, default=0.0, help="voltage at rest before the loop")
    p.add_argument(
        "--patience", type=float, default=0.1, metavar="SECONDS",
        help="longest time without a new reading, or stall, that the loop outlives (default 0.1)",
    )  # fmt: skip
    p.add_argument(
        "--bench", type=Path, default=None, metavar="FILE",
        help="without a station: configuration of the virtual bench (TOML or JSON)",
    )  # fmt: skip
    p.add_argument("--seed", type=nonnegative, default=5, help="of the virtual bench")
    p.add_argument("--name", default="loop", help="of the recording and its files")
    p.add_argument("--out", type=Path, default=OUT, help="folder (default: %(default)s)")
    p.add_argument("--quiet", action="store_true", help="no view of the progress")
    p.set_defaults(run=_regulate)


TARGETS = {
    "x": "thesis", "V": "sine:1:0:100:2", "lag": "steps:2:0",
    "F": "steps:1:0:2:2.5:3:3.5:4:5:6:8:10:0",
}  # fmt: skip
"""What is followed where nothing is asked for, by what the reference is."""


def _regulate(options: argparse.Namespace) -> int:
    from bondsight.cli.acquire import check_name
    from bondsight.cli.controller_file import OpenDescription, controller_of
    from bondsight.cli.target import target_of
    from hardware.regulation import LoopPlan
    from hardware.storage import new_files

    description, bench = controller_of(options.controller)
    rate = description.rate if options.rate is None else real_number("--rate", options.rate)
    if rate <= 0.0:
        raise UnusableInput(f"--rate {rate:g}: give ticks a second above 0")
    voltage = isinstance(description, OpenDescription)
    followed = "V" if voltage and description.reading == "x" else description.reading
    stage = options.controller == "m661" and not options.target
    text = options.target or ("steps:0.5:0:1e-3:-1e-3:0" if stage else TARGETS.get(followed, ""))
    unit = "V" if voltage else {"x": "m", "F": "N"}.get(description.reading, "1")
    plan = LoopPlan(
        target_of(text, rate, unit), rate, description.reading, voltage=voltage,
        name=options.name, start=options.start, patience=options.patience,
        asked={"controller": options.controller, "target": text, "rate": rate},
    )  # fmt: skip
    controller = description.made(rate)
    check_name(options.name)
    writable(options.out)
    new_files(options.out / options.name)
    if options.station is not None:
        from hardware.station import read_settings

        _run(options, read_settings(options.station), plan, controller)
        return 0
    _on_virtual_bench(options, bench, plan, controller)
    return 0


def _on_virtual_bench(options: argparse.Namespace, table: Any, plan: Any, controller: Any) -> None:
    """Run on a bench of its own; what the actuator met is told at the end."""
    from bondsight.cli.bench_serve import bench_config
    from bondsight.cli.virtual_bench import served

    config = bench_config(options.bench or table, seed=options.seed)
    with served(config) as bench:
        _run(options, bench.settings, plan, controller)
    for line in bench.said.splitlines():
        if "voltage at the actuator" in line:
            print(f"actuator:   {line}")


BEYOND = 0.2
"""Share of its reach by which an actuator may surpass the operator that stands for it."""


def _within_reach(settings: Any, plan: Any, controller: Any) -> None:
    """Refuse a target that no voltage of the envelope brings about."""
    from hardware.regulation import InverseLoop

    if not isinstance(controller, InverseLoop):
        return
    e = settings.envelope
    low, high = controller.reach(e.v_min, e.v_max)
    spare = BEYOND * (high - low)
    lowest, highest = float(plan.reference.min()), float(plan.reference.max())
    if lowest < low - spare or highest > high + spare:
        raise UnusableInput(
            f"--target {plan.asked['target']}: goes from {lowest:.4g} to {highest:.4g}, the "
            f"operator reaches {low:.4g} to {high:.4g} within {e.v_min:g} .. {e.v_max:g} V; "
            "ask for less"
        )


def _suits(options: argparse.Namespace, settings: Any, controller: Any) -> None:
    """Refuse the ultrasonic stage's controller elsewhere, and a start that no command reaches."""
    from actuators.ultrasonic import StageLoop

    if isinstance(controller, StageLoop) and settings.ultrasonic is None:
        raise UnusableInput(
            f"--controller {options.controller}: is made for the ultrasonic stage, but "
            f"{settings.name} has no [ultrasonic] driver in its station file; choose one for its "
            "actuator (stack), or describe the driver there"
        )
    envelope = settings.envelope
    if not envelope.v_min <= options.start <= envelope.v_max:
        raise UnusableInput(
            f"--start {options.start:g}: lies outside of the envelope's {envelope.v_min:g} .. "
            f"{envelope.v_max:g} V; give a voltage between them"
        )


def _run(options: argparse.Namespace, settings: Any, plan: Any, controller: Any) -> None:
    import numpy as np

    from hardware.live.take_view import watching_loop
    from hardware.regulation import record_loop
    from hardware.station import open_station

    _suits(options, settings, controller)
    _within_reach(settings, plan, controller)
    print(f"envelope:   {settings.envelope.describe().splitlines()[0]}")
    print(
        f"loop:       {options.controller} at {plan.rate:g} Hz, {plan.reference.size} ticks of "
        f"{plan.asked['target']}"
    )
    with open_station(settings) as bench:
        station = bench.loop(plan)
        quiet = options.quiet or not sys.stderr.isatty()
        with watching_loop(plan, station, quiet=quiet) as view:
            done = record_loop(station, plan, controller, options.out / options.name, view)
        print(f"output:     {bench.output.status}")
    recording = done.recording
    if not plan.voltage:
        error = np.asarray(recording[plan.reading]) - np.asarray(recording[f"{plan.reading}_ref"])
        span = float(np.ptp(plan.reference))
        share = f", {100 * error.std() / span:.3g} % of the reference's range" if span else ""
        unit = recording.units[plan.reading]
        print(
            f"error:      {np.sqrt(np.mean(error**2)):.4g} {unit} rms, "
            f"{np.abs(error).max():.4g} {unit} at most{share}"
        )
    print(f"recording:  {done.path}  {recording!r}")
    print(f"raw data:   {done.journal}")
    for sentence in done.sentences:
        print(f"note:       {sentence}")
