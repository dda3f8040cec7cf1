"""``bondsight stack``: identification from recordings; experiments on the simulated stack."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bondgraph.support.errors import UnusableInput, unknown_name
from bondsight.cli.arguments import OUT, add_map, fitting, mapping_of, positive

CHANNELS = ("V_in", "x", "F_e")
OF_RAMPS = (
    "stiffness", "stiffness_error", "load", "weight", "step", "mass", "erased", "maps"
)  # fmt: skip
OF_IDENTIFY = ("capacitance", "plays", "validate")
"""Options beside files: of both verbs that take recordings, and of identify alone."""
UNKNOWN = (
    "of the thesis, and T is as good as it: a free ramp tells T / k only; k tell --load (a force, "
    "or --weight KG), --step with --mass, or --stiffness"
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from actuators.stack.loading_curve import Interval
    from actuators.stack.step_response import Ringing
    from bondgraph.signals.recording import Recording


def add_stack_command(verbs: Any) -> None:
    """Add ``stack`` to the sub-parsers of ``bondsight``."""
    p = verbs.add_parser(
        "stack", help="identify a stack from its recordings; experiments on a simulated one"
    )
    p.add_argument(
        "what", choices=("identify", *EXPERIMENTS),
        help="identify: operator, T, k, remanence, damping, Maxwell capacitor, from recordings; "
        "mechanical: T and remanence of ramps, without one on simulated stacks; charge drive; "
        "two clocks",
    )  # fmt: skip
    p.add_argument(
        "files", nargs="*", type=Path, metavar="FILE",
        help="recordings from rest at 0 V, in the order in which they were taken; the last one is "
        "held out and judges the fit",
    )  # fmt: skip
    p.add_argument(
        "--out", type=Path, default=None,
        help="identify: what was found, .json (bondsight-out/stack.json); else figure, .svg",
    )  # fmt: skip
    g = p.add_argument_group("identify and mechanical")
    g.add_argument("--stiffness", type=float, metavar="N/M", help="k (default: 65e6, the thesis)")
    g.add_argument("--stiffness-error", type=float, metavar="N/M", help="one sigma")
    g.add_argument(
        "--load", type=Path, metavar="FILE",
        help="k from a recorded force at constant voltage: F_e along x, or F of a gauge against it",
    )  # fmt: skip
    g.add_argument(
        "--weight", type=float, metavar="KG",
        help="put on the upright stack, or taken off, while --load was recorded: no force needed",
    )  # fmt: skip
    g.add_argument("--step", type=Path, metavar="FILE", help="damping, k from its ringing")
    g.add_argument("--mass", type=float, metavar="KG", help="moved, known: for --step")
    g.add_argument(
        "--capacitance", type=float, metavar="F", help="clamped, for identify (default: 1.5e-6)"
    )
    g.add_argument(
        "--plays", type=positive, nargs="+", action="extend", metavar="J",
        help="numbers of plays to try (default 4 to 16); held-out samples choose",
    )  # fmt: skip
    g.add_argument(
        "--validate", type=Path, metavar="FILE",
        help="then hold the complete model against this recording, which no fit sees; taken last",
    )  # fmt: skip
    g.add_argument("--erased", action="store_true", help="every recording began demagnetised")
    add_map(g)
    p.set_defaults(run=_stack)


def _stack(options: argparse.Namespace) -> int:
    if options.what == "identify":
        return _identify(options)
    from bondsight.cli.figures import require_figure, save_figure
    from bondsight.cli.output import writable

    if options.files and options.what != "mechanical":
        raise UnusableInput(f"stack {options.what} runs on simulated stacks and takes no file")
    _require_used(options)
    if options.out is not None:
        require_figure(options.out)
        writable(options.out.parent)
    draw = _ramps(options) if options.files else EXPERIMENTS[options.what]()
    if options.out is not None:
        print(save_figure(options.out, draw))
    return 0


def _require_used(options: argparse.Namespace) -> None:
    """Refuse options that an experiment, or mechanical, would not use."""
    given = {n for n in (*OF_RAMPS, *OF_IDENTIFY) if getattr(options, n) not in (None, False, [])}
    unused = sorted(given - set(OF_RAMPS if options.files else ()))
    if unused:
        words = ", ".join(f"--{n.rstrip('s') if n == 'maps' else n}" for n in unused)
        where = "stack identify has it" if options.files else "it is for recordings; give files"
        raise UnusableInput(
            f"stack {options.what} takes no {words.replace('_', '-')}: {where}, or leave it out"
        )
    if options.mass is not None and options.step is None:
        raise UnusableInput("--mass: give --step, a recording that rings; a ramp needs no mass")


def _identify(options: argparse.Namespace) -> int:
    from actuators.stack.identification import COUNTS, checked_records, identify_stack
    from actuators.stack.ramps import from_rest, require_different
    from actuators.stack.validation import validate
    from bondsight.cli.output import writable

    out = options.out or OUT / "stack.json"
    if out.suffix != ".json":
        raise UnusableInput(f"stack identify --out {out}: write what was found to a .json file")
    writable(out.parent)
    recordings = _opened(options.files, _maps(options))
    fresh = _opened([options.validate], _maps(options)) if options.validate else []
    records = checked_records(recordings)  # refused before minutes are spent on a fit
    for r in fresh:
        require_different(records, from_rest(r))
    capacitance = _above_zero(
        "--capacitance", 1.5e-6 if options.capacitance is None else options.capacitance
    )
    stiffness, ringing = _stiffness(options)
    found = identify_stack(
        recordings, stiffness, capacitance=capacitance, mass=options.mass, step=ringing,
        carried=not options.erased, counts=options.plays or COUNTS,
        name=options.files[0].stem if options.files else "",
    )  # fmt: skip
    print(found)
    if fresh:
        print(validate(found.stack, fresh[0], () if options.erased else recordings))
    found.stack.save(out)
    print(f"identified: {out}")
    return 0


def _ramps(options: argparse.Namespace) -> Callable[[], Figure]:
    from actuators.stack import figures
    from actuators.stack.identification import checked_records, fit_ramps, ramp_table, said_of
    from actuators.stack.ramps import mean_of

    records = checked_records(_opened(options.files, _maps(options)))
    stiffness, _ = _stiffness(options)
    ramps = fit_ramps(records, stiffness, carried=not options.erased)
    print(ramp_table(ramps))
    if len(ramps) > 1:
        used = [r for r in ramps if r.steady] or ramps
        # what is not known of creep is common to all
        mean = mean_of(r.transducer for r in used).widened(max(r.unsure[0] for r in used))
        print(f"mean: T = {said_of(mean)} N/V, of {', '.join(r.name for r in used)}")
    return lambda: figures.loading_figure({r.name: r.largest_rise for r in records})


def _stiffness(options: argparse.Namespace) -> tuple[Interval, Ringing | None]:
    """Return k and the ringing, and say where k is from: load, user, ringing, or the thesis."""
    from actuators.stack.identification import said_of
    from actuators.stack.loading_curve import Interval
    from actuators.stack.ramps import stiffness_from_load, stiffness_from_weight
    from actuators.stack.step_response import fit_step

    if options.load is not None:
        for name in ("stiffness", "stiffness_error"):
            if getattr(options, name) is not None:
                raise UnusableInput(
                    f"--{name.replace('_', '-')}: k is told by --load; leave one of them out"
                )
    error = options.stiffness_error or 0.0
    if not 0.0 <= error < inf:
        raise UnusableInput(f"--stiffness-error {error:g}: give 0 or more, N/m")
    ringing = None
    if options.step is not None:
        ringing = fit_step(_opened([options.step], _maps(options))[0])
        print(f"ringing: w {said_of(ringing.pulsation)} rad/s, decay {said_of(ringing.decay)} 1/s")
        if options.mass is None:
            raise UnusableInput("--step: give --mass, the moved one (kg); ringing tells b / m only")
        mass = _above_zero("--mass", options.mass)
        print(f"  damping {said_of(ringing.damping(mass))} N s/m (thesis 80)")
        print(f"  k = m (w^2 + s^2) = {said_of(ringing.stiffness(mass), 1e-6)} N/um")
    if options.weight is not None and options.load is None:
        raise UnusableInput("--weight: give --load, a recording in which the mass is put on")
    if options.load is not None:
        loaded = _opened([options.load], _maps(options))[0]
        k = (
            stiffness_from_load(loaded)
            if options.weight is None
            else stiffness_from_weight(loaded, options.weight)
        )
        source = f"from {options.load.name}"
    elif options.stiffness is not None:
        k = Interval.of(_above_zero("--stiffness", options.stiffness), error)
        source = "as given"
    elif ringing is not None and options.stiffness_error is not None:
        raise UnusableInput("--stiffness-error: k is told by --step; leave one of them out")
    elif ringing is not None:
        k = ringing.stiffness(options.mass)
        source = "from the ringing: more than at constant voltage unless R_e C is short beside it"
    else:
        k, source = Interval.of(65e6, error), UNKNOWN
    print(f"stiffness: {said_of(k, 1e-6)} N/um, {source}")
    return k, ringing


def _maps(options: argparse.Namespace) -> dict[str, str]:
    """Return columns by what they are: V_in, x, F_e."""
    named = mapping_of(options.maps)
    for name in named:
        if name not in CHANNELS:
            raise unknown_name("channel", name, "stack --map", CHANNELS)
    return named


def _opened(files: Sequence[Path], maps: dict[str, str]) -> list[Recording]:
    from bondgraph.signals.recording import Recording

    if not files:
        raise UnusableInput("stack: give a recording of a ramp; bondsight acquire makes one")
    try:
        return [Recording.read(f, maps or None) for f in files]
    except UnusableInput as error:
        raise fitting(error, "--map") from None


def _above_zero(option: str, value: float) -> float:
    if not 0.0 < value < inf:
        raise UnusableInput(f"{option} {value:g}: give a number above 0")
    return value


def _mechanical() -> Callable[[], Figure]:
    from actuators.stack import figures
    from actuators.stack import loading_study as study

    print(study.erasing())
    found = study.loading()
    print(found)
    print(study.known())
    return lambda: figures.loading_figure(found.curves)


def _charge() -> Callable[[], Figure]:
    from actuators.stack import charge_study as study
    from actuators.stack import figures

    rows = study.drive_comparisons()
    print(study.drive_table(rows))
    print(study.force_table(study.force_cycles()))
    print(study.drift_table(study.drifts()))
    print(study.leak_table(study.leaks()))
    return lambda: figures.charge_figure(rows)


def _clocks() -> Callable[[], Figure]:
    from actuators.stack import figures
    from bondsight.cli.stack_clocks import clock_skew

    loops = clock_skew()
    return lambda: figures.clock_figure(loops)


EXPERIMENTS = {"mechanical": _mechanical, "charge": _charge, "clocks": _clocks}
"""Each prints its numbers and returns what draws them."""
