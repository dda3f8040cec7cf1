"""``bondsight acquire``: drive, record, align, store; and diagnose what was recorded."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bondgraph.support.errors import UnusableInput, real_number
from bondsight.cli.arguments import OUT, SHOWN, add_jobs, add_map, mapping_of, nonnegative
from bondsight.cli.output import words_of, writable
from bondsight.cli.spoken import as_options
from bondsight.cli.take_file import TakeAction, described

if TYPE_CHECKING:
    from collections.abc import Callable

    from hardware.recorder.taking import TakeProgress
    from identification.diagnosis.studio.live import LiveStudio


def add_acquire_command(verbs: Any) -> None:
    """Add the command to the sub-parsers of ``bondsight``."""
    p = verbs.add_parser("acquire", help="record on a bench, and diagnose what was recorded")
    p.add_argument(
        "station", nargs="?", type=Path,
        help="station file (TOML): envelope, output, amplifier, interferometer",
    )  # fmt: skip
    bench, taken = p.add_argument_group("the bench"), p.add_argument_group("the take")
    searched, shown = p.add_argument_group("the diagnosis"), p.add_argument_group(SHOWN)
    bench.add_argument(
        "--simulated", action="store_true",
        help="start a virtual bench that conceals an effect, and record on it over its wire",
    )  # fmt: skip
    bench.add_argument(
        "--bench", type=Path, default=None, metavar="FILE",
        help="with --simulated: configuration of the virtual bench (TOML or JSON)",
    )  # fmt: skip
    bench.add_argument("--effect", default="drawn", help="with --simulated: conceal this effect")
    bench.add_argument("--place", default="", help="with --simulated: at this element")
    bench.add_argument("--strength", default="", help="with --simulated: weak, medium or strong")
    bench.add_argument("--seed", type=nonnegative, default=None, help="of the bench and the signal")
    taken.add_argument(
        "--take", type=Path, action=TakeAction, metavar="FILE",
        help="signal, rate, samples, seed, erase, rest, synchronise, patience from a TOML file, or "
        "from the journal of a take that is to be repeated; options behind it count instead",
    )  # fmt: skip
    taken.add_argument(
        "--signal", default="session",
        help="session, hold:SECONDS:VOLTS, sine:HZ, ramp:SECONDS, triangle:HZ, "
        "staircase:STEPS:SECONDS, multisine:LOWEST_HZ:HIGHEST_HZ, reversals:CURVES:VOLTS_A_SECOND "
        "(each may end with :LOW:HIGH volts), demagnetise:VOLTS, or a file",
    )  # fmt: skip
    taken.add_argument(
        "--erase", type=float, default=None, metavar="VOLTS",
        help="before the take, take the actuator's history away by a decay around this voltage",
    )  # fmt: skip
    taken.add_argument(
        "--rest", type=float, default=0.0, metavar="SECONDS",
        help="hold the first voltage so long before the signal, and record it",
    )  # fmt: skip
    taken.add_argument(
        "--rate", type=float, default=None,
        help="samples a second of the output (default: 10000, or that of the file)",
    )  # fmt: skip
    taken.add_argument(
        "--samples", type=nonnegative, default=8192,
        help="of session and sine (default 8192); files and decays have their own",
    )  # fmt: skip
    bench.add_argument("--synchronise", choices=("clock", "start", "none"), default="clock",
                   help="how the sensor knows when the output changes")  # fmt: skip
    bench.add_argument(
        "--patience", type=float, default=2.0, metavar="SECONDS",
        help="longest silence of the sensor, beyond the length of a block (default 2)",
    )  # fmt: skip
    shown.add_argument("--name", default="take", help="of the recording and its files")
    shown.add_argument("--out", type=Path, default=OUT, help="folder (default: %(default)s)")
    shown.add_argument(
        "--live", type=Path, default=None, metavar="PNG", help="picture of the progress"
    )
    shown.add_argument("--quiet", action="store_true", help="no view of the progress")
    searched.add_argument(
        "--diagnose", default=None, metavar="MODEL", help="then diagnose with this model"
    )
    searched.add_argument(
        "--studio", action="store_true",
        help="with --diagnose: a browser of this machine shows how the model runs along, then the "
        "search, then the page",
    )  # fmt: skip
    add_map(searched)
    shown.add_argument(
        "--json", action="store_true",
        help="print the verdict as JSON; with --studio one line for each take",
    )  # fmt: skip
    add_jobs(searched)
    taken.add_argument(
        "--recover", type=Path, default=None, metavar="JOURNAL",
        help="make recordings from the journal of a take that was broken off",
    )  # fmt: skip
    p.set_defaults(run=_acquire)


def _acquire(options: argparse.Namespace) -> int:
    from hardware.storage import new_files

    if options.recover is not None:
        return _recover(options.recover)
    if options.simulated == (options.station is not None):
        raise UnusableInput(
            "acquire: give a station file, or --simulated for a virtual bench (not both)"
        )
    if options.studio and not options.diagnose:
        raise UnusableInput("acquire --studio: which model runs along? add --diagnose MODEL")
    check_name(options.name)
    if not real_number("--patience", options.patience) > 0.0:
        raise UnusableInput(f"--patience {options.patience:g}: give seconds above 0")
    if not 0.0 <= real_number("--rest", options.rest) <= 3600.0:
        raise UnusableInput(f"--rest {options.rest:g}: give 0 to 3600 seconds")
    writable(options.out)
    new_files(options.out / options.name)
    if options.diagnose:
        from actuators.models.opening import load_model
        from bondgraph.causality.assignment import assign_causality

        graph = load_model(options.diagnose)
        graph.require_sound()
        assign_causality(graph)  # a conflict is refused before anything moves
        _check_maps(graph, options.maps)
    if not options.simulated:
        from hardware.station import read_settings

        record_and_diagnose(options, read_settings(options.station))
        return 0
    from bondsight.cli.acquire_simulated import simulated

    return simulated(options, record_and_diagnose)


def check_name(name: str) -> None:
    """Refuse a name that is no plain file name."""
    if not name or name != Path(name).name or not name.isprintable() or name.startswith("."):
        raise UnusableInput(
            f"--name {name!r}: is no plain file name; give one without folders, and --out for those"
        )


def _check_maps(graph: Any, maps: list[str]) -> None:
    """Refuse a map of something that is neither in the model nor of the right form."""
    from bondgraph.graph.elements import Source
    from bondgraph.graph.sensors import Sensor
    from bondgraph.support.errors import require_known

    known = [e.name for e in graph.of_type(Source, Sensor)]
    require_known("source or sensor", graph.name, known, *mapping_of(maps))


def _recover(journal: Path) -> int:
    from bondgraph.signals.recording import Recording
    from hardware.storage import Provenance, recover

    said: dict[str, None] = {}
    for path in recover(journal):
        recording = Recording.open(path)
        print(f"recording:  {path}  {recording!r}")
        said.update(dict.fromkeys(Provenance.of(recording).warnings))
    for sentence in said:
        print(f"note:       {sentence}")
    return 0


def record_and_diagnose(options: argparse.Namespace, settings: Any) -> Any:
    """Record one take and diagnose it if asked for; returns the diagnosis or None."""
    if not getattr(options, "studio", False):
        return _recorded_and_diagnosed(options, settings, None)
    from bondsight.cli.acquire_studio import recorded_on_and_on
    from identification.diagnosis.studio.live import LiveStudio

    with LiveStudio() as live:
        words_of(options)(f"studio:     {live.address}")
        return recorded_on_and_on(
            options, live, lambda asked: _recorded_and_diagnosed(asked, settings, live)
        )


def _recorded_and_diagnosed(
    options: argparse.Namespace, settings: Any, live: LiveStudio | None
) -> Any:
    path = _record(options, settings, live)
    if not options.diagnose:
        return None
    from actuators.models.opening import load_model
    from bondsight.cli.diagnose import diagnose_files

    graph = load_model(options.diagnose)
    maps = [*options.maps, *_source(graph, options.maps)]
    graph = _recorded_only(graph, path, maps, words_of(options))
    request = argparse.Namespace(
        recordings=[str(path)], model=options.diagnose, maps=maps, out=options.out,
        json=options.json, jobs=options.jobs, seed=options.seed or 0, without=(),
        effects=None, noise=(), process_noise=(),
        hold=_held(graph, maps), lines=live is not None,
    )  # fmt: skip
    from bondsight.cli.studio import stoppable

    return diagnose_files(request, graph, None if live is None else stoppable(live))[1]


def _held(graph: Any, maps: list[str]) -> str | None:
    """Say that commands are held if the commanded voltage drives the model, mapped or by name.

    A converter holds its command between updates; a monitor may have seen anything.
    """
    from bondgraph.graph.elements import Source

    told = mapping_of(maps)
    driven = [told.get(e.name, e.name) for e in graph.of_type(Source) if not e.measured]
    return "hold" if "V" in driven or "V" in told.values() else None


def _source(graph: Any, maps: list[str]) -> list[str]:
    """Map the commanded voltage to the model's only command, unless the user maps it."""
    from bondgraph.graph.elements import Source

    sources = [e.name for e in graph.of_type(Source) if not e.measured]
    if len(sources) == 1 and sources[0] not in mapping_of(maps) and sources[0] != "V":
        return [f"{sources[0]}=V"]
    return []


def _recorded_only(graph: Any, path: Path, maps: list[str], say: Callable[[str], None]) -> Any:
    """Return the model without the sensors that the bench does not have, and say so."""
    from bondgraph.graph.sensors import Sensor
    from bondgraph.signals.recording import Recording

    there = {*Recording.open(path).channels, *mapping_of(maps)}
    absent = [e.name for e in graph.of_type(Sensor) if e.name not in there]
    if len(absent) == len(graph.of_type(Sensor)):
        return graph  # names differ: the matching by unit, or its message, is the better answer
    for name in absent:
        say(f"note:       sensor {name} of the model was not recorded; it is left out")
        graph = graph.remove(name)
    return graph


def _record(options: argparse.Namespace, settings: Any, live: LiveStudio | None) -> Path:
    """Record one take with a live view; returns the file."""
    import numpy as np

    from bondsight.cli.acquire_signal import erasure, waveform
    from hardware.live.take_view import watching
    from hardware.recorder import TakePlan, record
    from hardware.station import open_station

    volts, rate = waveform(
        options.signal, options.rate, options.samples, settings.envelope, options.seed or 0
    )
    volts = np.concatenate((np.full(round(options.rest * rate), volts[0]), volts))
    erase, say = None, words_of(options)
    if options.erase is not None:
        erase = erasure(options.erase, rate, settings.envelope)
    plan = TakePlan(
        volts, rate, options.name, options.synchronise, patience=options.patience, erase=erase,
        asked=described(options),
    )  # fmt: skip
    say(f"envelope:   {settings.envelope.describe().splitlines()[0]}")
    say(
        f"signal:     {options.signal}, {volts.size} samples of {rate:g} Hz "
        f"({plan.seconds:.3g} s), {volts.min():.4g} to {volts.max():.4g} V"
    )
    with open_station(settings) as bench:
        station = bench.station(plan)
        for remark in station.remarks:
            say(f"note:       {remark}")
        quiet = options.quiet or not sys.stderr.isatty()
        with watching(plan, station, quiet=quiet, picture=options.live) as view:
            beside = _beside(options, plan, station, live)

            def watch(report: TakeProgress) -> None:
                view(report)
                beside(report)

            taken = record(station, plan, options.out / options.name, watch=watch)
        say(f"output:     {bench.output.status}")
    say(f"recording:  {taken.path}  {taken.recording!r}")
    say(f"raw data:   {taken.journal}")
    for sentence in taken.sentences[len(station.remarks) :]:
        say(f"note:       {sentence}")
    return taken.path


def _beside(
    options: argparse.Namespace, plan: Any, station: Any, live: LiveStudio | None
) -> Callable[[Any], None]:
    """Return what tells the studio of a take; where the model cannot run along, that is said."""
    if live is None:
        return lambda _: None
    from actuators.models.opening import load_model
    from bondgraph.support.errors import BondsightError
    from bondsight.cli.acquire_studio import RunningAlong

    graph = load_model(options.diagnose)
    maps = [*options.maps, *_source(graph, options.maps)]
    rates = {s.stream: s.rate for s in station.sensors}
    try:
        return RunningAlong(live, plan, graph, maps, rates)
    except BondsightError as error:
        words_of(options)(f"note:       the model does not run along: {as_options(str(error))}")
        return lambda _: None
