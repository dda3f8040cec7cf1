"""``bondsight diagnose``: locate, name and repair the mismatch between a model and recordings."""

from __future__ import annotations

import argparse
import json
import re
import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Any

from bondgraph.support.errors import UnusableInput, unknown_name
from bondsight.cli.arguments import (
    ALLOWED,
    EFFORT,
    MODEL,
    OUT,
    READ,
    SHOWN,
    Options,
    add_jobs,
    add_reading,
    add_seed,
    mapping_of,
    positive,
    positive_number,
    reading_of,
)
from bondsight.cli.fit_options import add_statement, statement_of, states
from bondsight.cli.output import INTERRUPTED, Stopped, ended_like_ctrl_c, writable
from bondsight.cli.spoken import as_options, at_shell

if TYPE_CHECKING:
    from bondgraph.graph.bond_graph import BondGraph
    from bondgraph.signals.recording import Recording, Split


def add_diagnose_command(verbs: Any) -> None:
    """Add the command to the sub-parsers of ``bondsight``."""
    p = verbs.add_parser("diagnose", help="locate, name and repair a mismatch")
    p.add_argument(
        "recordings", nargs="+", metavar="RECORDING",
        help="a .csv, .npz, .mat, .h5, .tdms or .parquet file, or a known recording; several of "
        "one system are used together",
    )  # fmt: skip
    shown = add_diagnosis_options(p)
    shown.add_argument("--json", action="store_true", help="print the verdict as JSON")
    p.set_defaults(run=lambda options: diagnose_files(options)[0])


def add_diagnosis_options(
    p: argparse.ArgumentParser, seed: int | None = 0, otherwise: str = "0"
) -> Options:
    """Add what says how a recording is diagnosed, and where the results go.

    Returns
    -------
    The group of what is written and shown; `seed` and `otherwise` are those of `add_seed`.
    """
    read, allowed = p.add_argument_group(READ), p.add_argument_group(ALLOWED)
    effort, shown = p.add_argument_group(EFFORT), p.add_argument_group(SHOWN)
    read.add_argument("--model", required=True, help=MODEL)
    add_reading(read)
    add_statement(allowed)
    allowed.add_argument(
        "--without", action="append", default=[], metavar="EFFECT",
        help="an effect that may not be named; may be repeated",
    )  # fmt: skip
    effort.add_argument(
        "--effects", type=positive, default=None, metavar="N",
        help="look for at most N effects, one after the other",
    )  # fmt: skip
    read.add_argument(
        "--hold", choices=("hold", "hold-after", "linear", "band-limited"), default=None,
        help="commands between samples: hold as of a converter (-after: readings come after its "
        "step), linear, band-limited (default: what fits best)",
    )  # fmt: skip
    read.add_argument(
        "--noise", action="append", default=[], metavar="SENSOR=VALUE",
        help="standard deviation of a sensor's noise where it is known, SI or with a unit, such as "
        "x=0.5um; may be repeated",
    )  # fmt: skip
    allowed.add_argument(
        "--process-noise", action="append", default=[], metavar="PLACE",
        help="a state, element or source that moves at random: one-step predictions decide then; "
        "may be repeated",
    )  # fmt: skip
    effort.add_argument(
        "--time", type=positive_number, default=None, metavar="SECONDS",
        help="end the search after so long and write what was found by then, as Ctrl-C does",
    )  # fmt: skip
    add_jobs(effort)
    add_seed(effort, seed, otherwise)
    shown.add_argument("--out", type=Path, default=OUT, help="folder (default: %(default)s)")
    shown.add_argument("--quiet", action="store_true", help="no bar")
    return shown


@ended_like_ctrl_c()
def diagnose_files(
    options: argparse.Namespace,
    graph: BondGraph | None = None,
    watch: Callable[[str, float], None] | None = None,
) -> tuple[int, Any]:
    """Diagnose, write verdict and report, print; returns the exit code and the diagnosis.

    Parameters
    ----------
    options : Namespace
        As parsed; with `lines` the JSON is one line, as one of several documents.
    graph : BondGraph, optional
        In place of the model the options name.
    watch : callable, optional
        Told every step, beside the bar.
    """
    begin, limit = monotonic(), getattr(options, "time", None)
    try:
        result = _found(options, graph, watch, None if limit is None else begin + limit)
    except KeyboardInterrupt as stop:
        when = str(stop) or "stopped"
        raise Stopped(f"{when} before anything was found, so nothing was written") from None
    from identification.diagnosis.explanation.recovered import characterised
    from identification.diagnosis.studio import write_report
    from identification.diagnosis.verdict import NEXT, in_words, next_input, verdict, write_verdict

    path = write_verdict(result, options.out)
    report = write_report(characterised(result), options.out)
    if options.json:
        indent = None if getattr(options, "lines", False) else 2
        print(json.dumps(verdict(result), indent=indent, allow_nan=False), flush=True)
    else:
        print(in_words(result))
        print(f"verdict: {path}\nreport:  {report}")
        if (made := next_input(result)) is not None:
            print(f"input:   {path.parent / NEXT}: {made.words}")
        print(f"{monotonic() - begin:.1f} s in all, with reading the files and writing the report")
    if result.stopped:
        if options.json:  # else it stands among the words
            print(f"bondsight: {result.stopped}", file=sys.stderr)
        elif limit is None:
            print("bondsight: stopped; what was found by then is written", file=sys.stderr)
        return INTERRUPTED if limit is None else 0, result
    return 0, result


def _found(
    options: argparse.Namespace,
    graph: BondGraph | None,
    watch: Callable[[str, float], None] | None,
    end: float | None,
) -> Any:
    """Read and diagnose; the search ends at `end` of the clock."""
    from actuators.models.opening import load_model, model_name
    from bondgraph.causality.assignment import assign_causality
    from bondgraph.signals.files.placeholders import FAR_OUTSIDE
    from bondgraph.signals.recording import Recording
    from bondgraph.support.deadline import Deadline
    from bondsight.cli.progress import Bar
    from identification.diagnosis.diagnose import diagnose
    from identification.diagnosis.search.candidates import DiagnosisOptions
    from identification.study.driven import require_driven
    from identification.study.study import ESTIMATED, Study

    settings: dict[str, Any] = {"jobs": options.jobs, "without": known_effects(options.without)}
    if options.effects is not None:
        settings["effects"] = options.effects
    graph = load_model(options.model) if graph is None else graph
    graph.require_sound()
    assign_causality(graph)  # a conflict is refused before any file is read
    found, split = load_all(options.recordings, options.maps, graph, **reading_of(options))
    read = [found] if isinstance(found, Recording) else found
    far = (f"{r.name}: {as_options(n)}" for r in read for n in r.notes if n.startswith(FAR_OUTSIDE))
    still = require_driven(graph, read)
    for line in (*still, *far):
        print(f"note: {line}", file=sys.stderr)
    writable(options.out)
    noise = noise_of(options.noise, graph)
    asked: Any = graph
    if options.process_noise or states(options):
        asked = Study(
            graph, found, hold=options.hold or ESTIMATED, noise=noise or "white",
            process_noise=options.process_noise or None, splits=None if split is None else [split],
            **(statement_of(options, graph) if states(options) else {}),
        )  # fmt: skip
    given = (found, split) if asked is graph else ()
    with Bar(getattr(options, "quiet", False)) as bar:

        def say(text: str, fraction: float) -> None:
            bar(text, fraction)
            if watch is not None:
                watch(text, fraction)

        deadline = Deadline(say, end)
        try:
            with deadline:
                result = diagnose(
                    asked, *given, model=model_name(options.model, graph), hold=options.hold,
                    options=DiagnosisOptions(**settings), progress=deadline,
                    seed=options.seed, noise=noise,
                )  # fmt: skip
        except KeyboardInterrupt as stop:
            raise KeyboardInterrupt("the time was over" if deadline.over else str(stop)) from None
    # the page and the file say it too
    result = replace(result, notes=(*result.notes, *still), advice=(*still, *result.advice))
    return at_shell(result)


def noise_of(texts: Sequence[str], graph: BondGraph | None = None) -> dict[str, float]:
    """Read ``SENSOR=VALUE`` texts, SI or with a unit of the sensor's quantity.

    Raises
    ------
    UnusableInput
        A text is no such pair, or its unit is of another quantity.

    Examples
    --------
    >>> noise_of(["x=1e-9", "v = 0.5 mm/s"])
    {'x': 1e-09, 'v': 0.0005}
    """
    from bondgraph.signals.units import parse_unit, read_unit

    found = {}
    for text in texts:
        name, _, value = (part.strip() for part in text.partition("="))
        made = re.fullmatch(r"([-+]?[\d.]+(?:e[-+]?\d+)?)\s*(.*)", value, re.IGNORECASE)
        unit = read_unit(made[2]) if made and made[2] else None
        try:
            found[name] = float(made[1] if made and (unit or not made[2]) else value)
        except ValueError:
            raise UnusableInput(
                f"--noise {text}: give a sensor and a number in SI units, like --noise x=1e-9, or "
                "with its unit, like --noise x=1nm"
            ) from None
        if unit is None:
            continue
        found[name] *= unit.scale
        own = getattr(graph[name], "unit", "") if graph and name in graph.elements else ""
        if own and parse_unit(own).dims != unit.dims:
            raise UnusableInput(f"--noise {text}: {name} is read in {own}; give its noise in that")
    return found


def known_effects(names: Sequence[str]) -> tuple[str, ...]:
    """Return `names` if all are effects of the catalogue.

    Raises
    ------
    UnusableInput
        At the first name that is not in the catalogue, with the nearest that is.
    """
    from identification.diagnosis.catalogue import CATALOGUE

    known = [e.name for e in CATALOGUE]
    for n in names:
        if n not in known:
            raise UnusableInput(str(unknown_name("effect", n, "the catalogue", known)))
    return tuple(names)


def load_all(
    texts: Sequence[str], maps: Sequence[str], graph: BondGraph, **reading: Any
) -> tuple[Recording | list[Recording], Split | None]:
    """Read one or several recordings and match their channels to the model.

    Returns
    -------
    recording or list of them, split (a single known recording may state one)
    """
    from identification.datasets.opening import open_recording

    loaded = [open_recording(text, graph, mapping_of(maps), **reading) for text in texts]
    if len(loaded) == 1:
        return loaded[0][:2]
    return [r for r, _, _ in loaded], None
