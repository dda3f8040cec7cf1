"""``bondsight fit``: fit a model to recordings, say what was found, keep it in files."""

from __future__ import annotations

import argparse
import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bondgraph.support.errors import UnusableInput
from bondsight.cli.arguments import OUT, add_jobs, add_seed, positive
from bondsight.cli.fit_options import add_study_options, study_from
from bondsight.cli.output import INTERRUPTED, ended_like_ctrl_c, writable
from bondsight.cli.spoken import as_options

if TYPE_CHECKING:
    from bondsight.cli.progress import Bar
    from identification.estimation import Estimation, Study
    from identification.estimation.starts import Starts


def add_fit_command(verbs: Any) -> None:
    """Add the command to the sub-parsers of ``bondsight``."""
    p = verbs.add_parser("fit", help="fit a model to recordings, with uncertainty and judgement")
    add_study_options(p)
    p.add_argument("--method", default="single_shooting",
                   help="single_shooting (the default), multiple_shooting, collocation, "
                   "prediction_error, frequency_domain")  # fmt: skip
    p.add_argument("--optimiser", choices=("gauss_newton", "ipopt"), default=None,
                   help="default: the first that the method runs with")  # fmt: skip
    p.add_argument("--guess", action="store_true", help="take start values from the data")
    p.add_argument("--starts", type=positive, default=None, help="fit from that many starts")
    p.add_argument("--profiles", action="store_true", help="profile every free parameter")
    p.add_argument("--iterations", type=positive, default=60,
                   help="at most so many (default: %(default)s)")  # fmt: skip
    add_seed(p)
    add_jobs(p)
    p.add_argument("--out", type=Path, default=OUT / "fit", help="folder (default: %(default)s)")
    p.add_argument("--quiet", action="store_true", help="no bar")
    p.add_argument("--json", action="store_true", help="print the result as JSON")
    p.set_defaults(run=_fit)


@ended_like_ctrl_c()
def _fit(options: argparse.Namespace) -> int:
    from numpy.linalg import LinAlgError

    from actuators.models.opening import load_model
    from bondsight.cli.progress import Bar
    from identification.estimation import FitStatus
    from identification.estimation.archive import save_fit
    from identification.estimation.values import write_values
    from identification.uncertainty.postflight import postflight
    from identification.uncertainty.preflight import preflight, require_motion
    from identification.validation import judge
    from identification.validation.report import write_report

    _require_starts_run_so(options)
    graph = load_model(options.model)
    study, said = study_from(options, graph)
    writable(options.out)
    command = "bondsight " + shlex.join(sys.argv[1:])
    require_motion(study)
    try:
        before = preflight(study)
    except LinAlgError:
        before = ()  # the fit says which start values have no equations
    for finding in before:
        print(f"bondsight: warning: {finding}", file=sys.stderr)
    with Bar(options.quiet) as bar:
        found, starts = _run(options, study, bar)
        archive, values = options.out / "fit.npz", options.out / "fit.json"
        save_fit(found, archive, command=command)  # before anything else can be stopped
        write_values(found, values)
        kinds = _profiled(options, found, bar)
    judgement = judge(starts or found, kinds=kinds).with_findings(postflight(found))
    write_values(found, values, judgement.material.tied)
    report = write_report(judgement, options.out / "fit.html", findings=before, command=command)
    if options.json:
        print(values.read_text(encoding="utf-8"), end="")
    else:
        for line in (*said, *([str(starts)] if starts else [])):
            print(line)
        print(as_options(str(judgement)))
        print(f"fit:    {archive}\nvalues: {values}\nreport: {report}")
    if found.status is FitStatus.CANCELLED:
        print("bondsight: cancelled; the best values so far are kept", file=sys.stderr)
        return INTERRUPTED
    return 0


def _require_starts_run_so(options: argparse.Namespace) -> None:
    """Refuse an optimiser that many starts are not run with."""
    from identification.estimation.methods import METHODS

    method = METHODS.get(options.method)  # of another one the fit says that there is none
    if options.starts and options.optimiser and method is not None:
        own = method.optimisers[0]
        if options.optimiser != own:
            raise UnusableInput(
                f"fit: --starts runs {options.method} with {own}, not with {options.optimiser}; "
                "leave --optimiser or --starts out"
            )


def _run(options: argparse.Namespace, study: Study, bar: Bar) -> tuple[Estimation, Starts | None]:
    from identification.estimation import estimate
    from identification.estimation.starts import many_starts

    if options.guess:
        from identification.estimation.guess import guess

        study = guess(study, seed=options.seed, progress=bar)
    if options.starts:
        starts = many_starts(
            study, options.starts, method=options.method, seed=options.seed, jobs=options.jobs,
            max_iterations=options.iterations, progress=bar,
        )  # fmt: skip
        return starts.best, starts
    found = estimate(
        study, options.method, optimiser=options.optimiser, max_iterations=options.iterations,
        progress=bar,
    )  # fmt: skip
    return found, None


def _profiled(options: argparse.Namespace, found: Estimation, bar: Bar) -> dict[str, str]:
    if not options.profiles:
        return {}
    from identification.uncertainty.fitted import from_estimation
    from identification.uncertainty.profiles import profiles

    def say(done: int, wanted: int, name: str) -> None:
        bar(f"profile of {name}", done / max(wanted, 1))

    return {
        p.name: p.shape for p in profiles(from_estimation(found), jobs=options.jobs, progress=say)
    }
