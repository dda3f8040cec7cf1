"""``bondsight coverage``: how often 95 % intervals hold the truth, by simulation."""

from __future__ import annotations

import argparse
import time
from typing import Any

from bondsight.cli.arguments import jobs, nonnegative, positive

DEMO = "demo"
KINDS = ("fisher", "sandwich", "profile")


def add_coverage_command(verbs: Any) -> None:
    """Add the command to the sub-parsers of ``bondsight``."""
    p = verbs.add_parser(
        "coverage", help="simulate records with new noise, fit each, count how often 95 %% holds"
    )
    p.add_argument(
        "model", nargs="?", default=DEMO,
        help="a model as for the other commands, at its declared values; or demo (default): a "
        "linear and a hysteretic spring, white and coloured noise",
    )  # fmt: skip
    p.add_argument("--trials", type=positive, default=200)
    p.add_argument("--samples", type=positive, default=None, help="of each record (default: 800)")
    p.add_argument("--noise", type=float, default=0.02, help="deviation over the rms of a reading")
    p.add_argument("--amplitude", type=float, default=1.0, help="peak of the commands of MODEL, SI")
    p.add_argument("--top", type=float, default=None, help="highest frequency for MODEL, Hz")
    p.add_argument("--colour", type=float, default=0.0, help="correlation of the noise of MODEL")
    p.add_argument("--model-noise", choices=("white", "coloured"), default="white", dest="taken")
    p.add_argument("--intervals", nargs="+", action="extend", choices=KINDS, default=None)
    p.add_argument("--first", type=nonnegative, default=0, help="number of the first trial")
    p.add_argument("--jobs", type=jobs, default=-1, help="processes (default: all cores)")
    p.set_defaults(run=_coverage)


def _coverage(options: argparse.Namespace) -> int:
    from actuators.models.opening import load_model
    from bondgraph.support.errors import UnusableInput
    from bondsight.cli.progress import Bar
    from identification.uncertainty.cases import SAMPLES, case_of
    from identification.uncertainty.coverage import coverage
    from tests.proof.coverage.demo import demo_cases

    for name in ("noise", "amplitude"):
        if not getattr(options, name) > 0:
            raise UnusableInput(f"--{name} {getattr(options, name):g}: give a positive number")
    samples = options.samples or SAMPLES
    if options.model == DEMO:
        cases = demo_cases(samples, options.noise)
    else:
        graph = load_model(options.model)
        graph.require_sound()
        cases = (
            case_of(
                graph, samples=samples, noise=options.noise, amplitude=options.amplitude,
                top=options.top, colour=options.colour, model=options.taken,
            ),
        )  # fmt: skip
    for case in cases:
        begin = time.perf_counter()
        with Bar() as bar:
            made = coverage(
                case, options.trials, kinds=options.intervals or KINDS, jobs=options.jobs,
                first=options.first, progress=lambda k, n, text: bar(text, k / n),
            )  # fmt: skip
        print(made)
        print(f"  {time.perf_counter() - begin:.1f} s", flush=True)
        if made.trials < options.trials:
            print("  stopped: counted as far as it came")
            return 130
    return 0
