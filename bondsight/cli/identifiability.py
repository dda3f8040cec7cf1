"""``bondsight identifiability``: what a model, and a recording of it, determine; in words."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from bondsight.cli.arguments import MODEL, add_jobs, add_map, add_several, mapping_of
from bondsight.cli.output import ended_like_ctrl_c


def add_identifiability_command(verbs: Any) -> None:
    """Add the command to the sub-parsers of ``bondsight``."""
    p = verbs.add_parser(
        "identifiability", help="say which parameters readings determine, and which only together"
    )
    p.add_argument("model", help=MODEL)
    p.add_argument("--recording", help="also fit it: a file or a known recording")
    add_map(p)
    add_several(p, "--free", "NAME", None, "parameters (default: all not fixed)")
    p.add_argument("--profiles", action="store_true", help="also profile every parameter")
    p.add_argument("--noise", choices=("white", "coloured"), default="white",
                   help="of the readings (default: %(default)s)")  # fmt: skip
    p.add_argument("--out", type=Path, default=None, help="folder for figures")
    add_jobs(p)
    p.set_defaults(run=_identifiability)


@ended_like_ctrl_c()
def _identifiability(options: argparse.Namespace) -> int:
    from actuators.models.opening import load_model
    from bondgraph.support.errors import UnusableInput
    from identification.uncertainty.extra_sensor import helpful_sensors
    from identification.uncertainty.structural import identifiability
    from identification.uncertainty.words import report

    graph = load_model(options.model)
    if options.recording is None and (options.profiles or options.out is not None):
        raise UnusableInput("profiles and figures are of a fit; give --recording")
    structure = identifiability(graph, options.free)
    sensors = helpful_sensors(graph, structure.free, structure)
    if options.recording is None:
        print(report(structure=structure, sensors=sensors))
        return 0
    return _with_recording(options, graph, structure, sensors)


def _with_recording(
    options: argparse.Namespace, graph: Any, structure: Any, sensors: Sequence[Any]
) -> int:
    from bondsight.cli.progress import Bar
    from identification.datasets.opening import open_recording
    from identification.estimation import Study, estimate
    from identification.uncertainty.fitted import from_estimation
    from identification.uncertainty.postflight import postflight, practical_of
    from identification.uncertainty.preflight import preflight
    from identification.uncertainty.profiles import profiles
    from identification.uncertainty.words import report

    recording, split, said = open_recording(options.recording, graph, mapping_of(options.maps))
    study = Study(graph, recording, options.free, noise=options.noise, splits=split)
    before = preflight(study)
    with Bar() as bar:
        made = estimate(study, progress=bar)
        fit = from_estimation(made)
        walked = (
            profiles(fit, jobs=options.jobs, progress=lambda k, n, text: bar(text, k / n))
            if options.profiles
            else ()
        )
    for sentence in (*said, *made.notes):
        print(f"note: {sentence}")
    print(
        report(
            structure=structure,
            sensors=sensors,
            before=before,
            practical=practical_of(fit),
            plain=fit.plain,
            robust=fit.robust,
            profiles=walked,
            after=postflight(made, fit),
        )
    )
    if options.out is not None:
        for path in _figures(options.out, fit, walked):
            print(f"figure: {path}")
    return 0


def _figures(folder: Path, fit: Any, walked: Sequence[Any]) -> list[Path]:
    from identification.uncertainty.figures import correlation_figure, profile_figure

    folder.mkdir(parents=True, exist_ok=True)
    made = [(folder / "correlation.png", correlation_figure(fit.plain))]
    if walked:
        made.append((folder / "profiles.png", profile_figure(walked)))
    for path, figure in made:
        figure.savefig(path)
    return [path for path, _ in made]
