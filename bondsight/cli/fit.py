"""``bondsight fit``: fit a model to recordings, say what was found, keep it in files."""

from __future__ import annotations

import argparse
import shlex
import sys
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bondgraph.support.errors import UnusableInput
from bondsight.cli.arguments import OUT, SHOWN, add_jobs, add_seed, positive
from bondsight.cli.fit_options import add_study_options, study_from
from bondsight.cli.output import INTERRUPTED, ended_like_ctrl_c, writable
from bondsight.cli.spoken import as_options

if TYPE_CHECKING:
    from bondsight.cli.progress import Bar
    from identification.diagnosis.screening.undoing import Mixup
    from identification.estimation import Estimation, Study
    from identification.estimation.starts import Starts
    from identification.uncertainty.finding import Finding
    from identification.validation import Judgement


BETTER = 0.9
"""Part of the misfit that another way down leaves at most to be taken."""


def add_fit_command(verbs: Any) -> None:
    """Add the command to the sub-parsers of ``bondsight``."""
    p = verbs.add_parser("fit", help="fit a model to recordings, with uncertainty and judgement")
    add_study_options(p)
    way, shown = p.add_argument_group("how it is fitted"), p.add_argument_group(SHOWN)
    way.add_argument("--method", default="single_shooting",
                   help="single_shooting (the default), multiple_shooting, collocation, "
                   "prediction_error, frequency_domain")  # fmt: skip
    way.add_argument("--optimiser", choices=("gauss_newton", "ipopt"), default=None,
                   help="default: the first that the method runs with")  # fmt: skip
    way.add_argument("--guess", action="store_true", help="take start values from the data")
    way.add_argument(
        "--starts", type=positive, default=None, metavar="N",
        help="fit from N starts spread over the bounds, a decade either way where there are none; "
        "without it, a fit that ends far above the noise is begun once more from values that short "
        "stretches give, and mixed-up columns are looked for",
    )  # fmt: skip
    way.add_argument("--profiles", action="store_true", help="profile every free parameter")
    way.add_argument("--iterations", type=positive, default=60,
                   help="at most so many (default: %(default)s)")  # fmt: skip
    add_seed(way)
    add_jobs(way)
    shown.add_argument(
        "--out", type=Path, default=OUT / "fit", help="folder (default: %(default)s)"
    )
    shown.add_argument("--quiet", action="store_true", help="no bar")
    shown.add_argument("--json", action="store_true", help="print the result as JSON")
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
    # what moves beside the start values may be those: it is told where the fit leaves it
    drifts = tuple(f for f in before if f.kind == "drift")
    _warn(f for f in before if f not in drifts)
    with Bar(options.quiet) as bar:
        found, starts = _run(options, study, bar)
        found, again, mistakes = _looked_again(options, study, found, bar)
        archive, values = options.out / "fit.npz", options.out / "fit.json"
        save_fit(found, archive, command=command)  # before anything else can be stopped
        write_values(found, values)
        kinds = _profiled(options, found, bar)
    judgement = _at_shell(
        judge(found, kinds=kinds, starts=[] if starts is None else starts.costs.tolist()),
        mistakes, postflight(found),
    )  # fmt: skip
    write_values(found, values, judgement.material.tied)
    if all(c.judged.at_floor and not c.judged.misread for c in judgement.channels):
        before = tuple(f for f in before if f not in drifts)
    else:
        _warn(drifts)
    report = write_report(judgement, options.out / "fit.html", findings=before, command=command)
    if options.json:
        print(values.read_text(encoding="utf-8"), end="")
    else:
        for line in (*said, *([str(starts)] if starts else []), *again):
            print(line)
        print(judgement)
        print(f"fit:    {archive}\nvalues: {values}\nreport: {report}")
    if found.status is FitStatus.CANCELLED:
        print("bondsight: cancelled; the best values so far are kept", file=sys.stderr)
        return INTERRUPTED
    return 0


def _warn(findings: Iterable[Finding]) -> None:
    for finding in findings:
        print(f"bondsight: warning: {finding}", file=sys.stderr)


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


def _looked_again(
    options: argparse.Namespace, study: Study, found: Estimation, bar: Bar
) -> tuple[Estimation, list[str], tuple[Mixup, ...]]:
    """Begin once more where a fit ended far above the noise, unless columns are mixed up.

    Returns
    -------
    the better fit, lines on how it came about, what looks wrong with the recording
    """
    from identification.diagnosis.search.second_look import second_look
    from identification.estimation import FitStatus, estimate
    from identification.report.numbers import times_noise
    from identification.validation import judge

    if found.status is FitStatus.CANCELLED or not any(r.leads for r in judge(found).faults):
        return found, [], ()
    bar("far above the noise: looking for mixed-up columns and another way down", 0.5)
    try:
        look = second_look(study, options.jobs)
    except KeyboardInterrupt:
        return found, ["the search for another way down was stopped"], ()
    if not look.values:
        return found, [], look.mistakes
    other = estimate(
        study.starting(look.values), options.method, optimiser=options.optimiser,
        max_iterations=options.iterations, progress=bar,
    )  # fmt: skip
    before, after = found.chi2("train"), other.chi2("train")
    if not after < BETTER * before:
        return found, [], ()
    line = (
        f"the first fit ended at {times_noise(before):.3g} times the noise; begun again from what "
        f"short stretches gave it ends at {times_noise(after):.3g}"
    )
    return other, [line], ()


def _at_shell(
    judged: Judgement, mistakes: tuple[Mixup, ...], findings: Iterable[Finding]
) -> Judgement:
    """Return the judgement, mixed-up columns first, with options in place of arguments."""
    from identification.validation.remark import fault

    judged = judged.with_findings(findings)
    first = [
        fault(
            f"{' or '.join(m.claim for m in mistakes)}: {mistakes[0].undoing}",
            f"{'; or '.join(m.remedy for m in mistakes)}, then fit again",
            "the recording looks wrong",
        )
        for _ in mistakes[:1]
    ]
    told = (
        replace(r, text=as_options(r.text), advice=as_options(r.advice))
        for r in (*first, *judged.remarks)
    )
    return replace(judged, remarks=tuple(told))


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
