"""From the words of a command line to a study: what varies, what is known, what is added."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from bondgraph.support.errors import UnusableInput, unknown_name
from bondsight.cli.arguments import (
    ALLOWED,
    MODEL,
    READ,
    Options,
    add_reading,
    add_several,
    mapping_of,
    reading_of,
)

if TYPE_CHECKING:
    from bondgraph.graph.bond_graph import BondGraph
    from identification.study.calibration import Known
    from identification.study.specification import Vary
    from identification.study.study import Study


def add_study_options(p: argparse.ArgumentParser) -> None:
    """Add what says which numbers vary, and what the measuring chain may add."""
    read, allowed = p.add_argument_group(READ), p.add_argument_group(ALLOWED)
    p.add_argument("recordings", nargs="+", metavar="RECORDING", help="files or known recordings")
    read.add_argument("--model", required=True, help=MODEL)
    add_reading(read)
    read.add_argument(
        "--hold", choices=("hold", "hold-after", "linear", "band-limited", "estimate"),
        default=None,
        help="commands between samples: hold as of a converter (-after: readings come after its "
        "step), linear, band-limited, or what fits best (the default)",
    )  # fmt: skip
    read.add_argument("--noise", choices=("white", "coloured"), default="white",
                      help="of the readings (default: %(default)s)")  # fmt: skip
    add_several(read, "--validate", "RECORDING", [], "recordings only judged")
    read.add_argument(
        "--init", type=int, default=0, help="samples of those that their state is fitted to"
    )
    read.add_argument("--window", type=int, default=None, help="samples of windows to score on")
    add_statement(allowed)
    add_several(allowed, "--own", "NAME", [], "parameters with a value in every recording")
    add_several(
        allowed, "--process-noise", "PLACE", None,
        "prediction_error: states, elements or sources that are disturbed; default: every state",
    )  # fmt: skip


def add_statement(p: Options) -> None:
    """Add what says which numbers vary, what is known of them, and what sensors may add."""
    add_several(p, "--free", "NAME", None, "parameters that are fitted (default: all not fixed)")
    p.add_argument("--fix", action="append", default=[], metavar="NAME=VALUE",
                   help="hold a parameter at a value, SI; may be repeated")  # fmt: skip
    p.add_argument("--start", action="append", default=[], metavar="NAME=VALUE",
                   help="begin there, SI; may be repeated")  # fmt: skip
    p.add_argument("--bound", action="append", default=[], metavar="NAME=LOW:HIGH",
                   help="keep it between, SI; one may be left empty; may be repeated")  # fmt: skip
    p.add_argument(
        "--prior",
        action="append",
        default=[],
        metavar="NAME=MEDIAN:FACTOR",
        help="two thirds of the weight within FACTOR of MEDIAN",
    )
    p.add_argument("--rest", action="store_true", help="every recording begins at rest")
    p.add_argument("--clock", type=ppm, default=0.0, metavar="PPM", help="largest clock error")
    p.add_argument(
        "--gain",
        action="append",
        default=[],
        metavar="CHANNEL=PERCENT",
        help="a calibration that may be wrong by as much, such as x=2%%; x=1.03:2%% around 1.03",
    )
    p.add_argument("--no-offsets", action="store_true", help="sensors have no offset")
    p.add_argument("--no-lags", action="store_true", help="sensors have no lag")
    p.add_argument("--command-offsets", action="store_true", help="commands may have an offset")


def ppm(text: str) -> float:
    """Return the largest error of a clock, parts in a million."""
    try:
        value = float(text)
    except ValueError:
        value = -1.0
    if not 0.0 <= value < 1e5:
        raise argparse.ArgumentTypeError(f"{text!r} is not 0 to 1e5 ppm; 200 is 0.02 %")
    return value


def study_from(options: argparse.Namespace, graph: BondGraph) -> tuple[Study, tuple[str, ...]]:
    """Return the study that the options describe, and sentences about matched channels.

    Raises
    ------
    UnusableInput, UnknownName
        One line that says which option, and what to write instead.
    """
    from identification.datasets.opening import open_recording
    from identification.study.study import ESTIMATED, Study

    maps = mapping_of(options.maps)
    more = reading_of(options)
    opened = [open_recording(text, graph, maps, **more) for text in options.recordings]
    splits = [split for _, split, _ in opened]
    judged = [open_recording(text, graph, maps, **more)[0] for text in options.validate]
    study = Study(
        graph,
        [record for record, _, _ in opened],
        hold=options.hold or ESTIMATED,
        noise=options.noise,
        splits=None if None in splits else [s for s in splits if s is not None],
        validation=judged,
        init=options.init,
        window=options.window,
        process_noise=options.process_noise,
        **statement_of(options, graph),
    )
    if any(splits) and None in splits:
        # the stated splits of known recordings, beside the default ones of files
        mixed = [s or d for s, d in zip(splits, study.splits, strict=True)]
        study = study.changed(splits=mixed)
    return study, tuple(s for _, _, sentences in opened for s in sentences)


def states(options: argparse.Namespace) -> bool:
    """Whether anything is said that a graph alone does not say."""
    given = vars(options)
    return any(given.get(n) for n in STATED)


STATED = (
    "free", "fix", "start", "bound", "prior", "rest", "clock", "gain", "no_offsets",
    "no_lags", "command_offsets",
)  # fmt: skip
"""Options of `add_statement`."""


def statement_of(options: argparse.Namespace, graph: BondGraph) -> dict[str, Any]:
    """Return what `add_statement` lets one say, as arguments of a study."""
    from identification.study.specification import Nuisances

    nuisances = Nuisances(
        offsets=not options.no_offsets,
        lags=not options.no_lags,
        commands=options.command_offsets,
        clock=1e-6 * options.clock,
        gains={n: _gain(n, text) for n, text in _pairs("--gain", options.gain)},
    )
    return {
        "free": _free(options, graph),
        "fixed": {n: _number("--fix", n, v) for n, v in _pairs("--fix", options.fix)},
        "initial": "rest" if options.rest else "free",
        "nuisances": nuisances,
    }


def _free(options: argparse.Namespace, graph: BondGraph) -> list[Vary] | None:
    from identification.study.priors import LogNormal
    from identification.study.specification import Vary

    known = graph.parameters
    starts = {n: _number("--start", n, v) for n, v in _pairs("--start", options.start)}
    bounds = dict(_pairs("--bound", options.bound))
    priors = dict(_pairs("--prior", options.prior))
    fixed = {n for n, _ in _pairs("--fix", options.fix)}
    names, apart = options.free, getattr(options, "own", [])
    if names is None:
        names = [n for n, p in known.items() if not p.fixed and n not in fixed]
    for option, given in (
        ("--start", starts), ("--bound", bounds), ("--prior", priors), ("--own", apart)
    ):  # fmt: skip
        for n in given:
            if n not in known:
                raise unknown_name(f"parameter of {option}", n, graph.name, known)
            if n in fixed:
                raise UnusableInput(f"{option} {n}: {n} is held by --fix; leave one of them out")
            if n not in names:
                raise UnusableInput(f"{option} {n}: {n} is not free; add it to --free")
    found = []
    for n in names:
        v = Vary(n, own=n in apart)
        if n in bounds:
            low, high = _span("--bound", n, bounds[n])
            v = replace(v, lower=low, upper=high)
        if n in priors:
            v = replace(v, prior=LogNormal(*_both("--prior", n, priors[n])))
        if n in starts:
            v = replace(v, start=starts[n])
        found.append(v)
    return found


def _pairs(option: str, entries: Sequence[str]) -> list[tuple[str, str]]:
    found: list[tuple[str, str]] = []
    for e in entries:
        name, sign, value = (part.strip() for part in e.partition("="))
        if not (name and sign and value):
            raise UnusableInput(f"{option} {e} is not NAME=VALUE; write {option} m=0.5")
        if name in (known for known, _ in found):
            raise UnusableInput(f"{option} {e}: {name} was given before; give it once")
        found.append((name, value))
    return found


def _gain(name: str, text: str) -> Known:
    from identification.study.calibration import Known

    value, sign, width = text.rpartition(":")
    if not width.endswith("%"):
        raise UnusableInput(
            f"--gain {name}={text}: say by how much it may be wrong, in percent: --gain {name}=2%"
        )
    within = _number("--gain", name, width.removesuffix("%")) / 100.0
    return Known(_number("--gain", name, value) if sign else 1.0, within)


def _number(option: str, name: str, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise UnusableInput(f"{option} {name}={text}: {text!r} is no number") from None


def _span(option: str, name: str, text: str) -> tuple[float | None, float | None]:
    low, sign, high = text.partition(":")
    if not sign:
        raise UnusableInput(f"{option} {name}={text} is not NAME=LOW:HIGH; one may be left empty")
    return (
        _number(option, name, low) if low else None,
        _number(option, name, high) if high else None,
    )


def _both(option: str, name: str, text: str) -> tuple[float, float]:
    first, sign, second = text.partition(":")
    if not sign:
        raise UnusableInput(f"{option} {name}={text} is not NAME=MEDIAN:FACTOR, such as k=200:1.5")
    return _number(option, name, first), _number(option, name, second)
