"""What is wrong with a result, said after a fit."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from bondgraph.support.errors import UnusableInput
from identification.estimation.levenberg_marquardt import FitStatus
from identification.estimation.result import Estimation
from identification.report.numbers import quantity, times_noise
from identification.statistics.blocks import block_means
from identification.uncertainty.finding import Finding
from identification.uncertainty.fitted import FitView, from_estimation
from identification.uncertainty.information import Sensitivities
from identification.uncertainty.practical import DEAD, Practical, practical
from identification.uncertainty.preflight import thousand
from identification.uncertainty.well_known import well_known

BEYOND_NOISE = 4.0
WHY = {
    "dead": "the fit picked any value of it",
    "flat direction": "the values shown are one choice of many that fit as well",
    "trade-off pair": "an error of one hides in the other",
    "not pinned": "the interval is too wide to be used",
    "at bound": "its interval means nothing, and other values may be off to make up for it",
}
DO = {
    "dead": "fix it, or excite it",
    "flat direction": "where none of them is known, use what is told of them together",
    "trade-off pair": "use the combination, or record what tells them apart",
    "not pinned": "give a prior, fix it, or record more",
    "at bound": "move the bound if physics allows, otherwise doubt the model",
}


def practical_of(fit: FitView, dead: float = DEAD) -> Practical:
    """Return the five classes for a fit, proved at a second point."""
    try:
        further: tuple[Sensitivities, ...] = (fit.elsewhere(),)
    except UnusableInput:  # the neighbourhood cannot be simulated
        further = ()
    return practical(
        fit.sensitivities,
        fit.residual,
        bounds=fit.bounds,
        further=further,
        prior=fit.prior,
        channels=fit.channels,
        variance=fit.variance,
        dead=dead,
        readings=fit.readings,
    )


def postflight(estimation: Estimation, fit: FitView | None = None) -> tuple[Finding, ...]:
    """Return what a user should know after a fit; empty if nothing stands out.

    Parameters
    ----------
    estimation : Estimation
    fit : FitView, optional
        Of it, if it is there already.
    """
    found = list(_ended(estimation))
    if estimation.status is FitStatus.BROKEN:
        return tuple(found)
    with np.errstate(all="ignore"):
        found += _landed(estimation)
        found += _misfit(estimation)
        found += _trend(estimation)
    where = estimation.study.graph.name
    try:
        with np.errstate(all="ignore"):
            statements = practical_of(fit or from_estimation(estimation)).statements
    except UnusableInput as error:
        found.append(
            Finding(
                "not judged", str(error), where, "so nothing is known of the parameters",
                "mend the fit first",
            )
        )  # fmt: skip
        return tuple(found)
    known = {e.name for e in estimation.estimates if well_known(*e.ci95)}
    for s in statements:
        if s.kind == "trade-off pair" and known.issuperset(s.names):
            continue  # each is known well enough by itself
        found.append(
            Finding(s.kind, s.text, f"{where}, {', '.join(s.names)}", WHY[s.kind], DO[s.kind])
        )
    return tuple(found)


def _ended(e: Estimation) -> Iterator[Finding]:
    if e.status is FitStatus.CONVERGED:
        return
    yield Finding(
        "not converged", e.status.value, e.study.graph.name, "the values may not be the best",
        "start from them again, or from elsewhere",
    )  # fmt: skip


def _landed(e: Estimation) -> Iterator[Finding]:
    known = e.study.graph.parameters
    for entry in e.estimates:
        name = entry.name.partition(" @")[0]
        nominal = known[name].value if name in known else 0.0
        # an interval that holds what is declared tells nothing against it
        if not nominal * entry.value > 0 or entry.ci95[0] <= nominal <= entry.ci95[1]:
            continue
        ratio = entry.value / nominal
        power, said = thousand(ratio), f"{entry.name} = {quantity(entry.value, entry.unit)} is"
        if power is not None:
            yield Finding(
                "unit", f"{said} {ratio:.3g} times the declared value",
                f"{e.study.graph.name}, {entry.name}",
                f"a factor near {1000.0**power:g} is mostly a unit",
                "check units of channels and declared values",
            )  # fmt: skip
        elif abs(np.log10(ratio)) > 1.5:
            yield Finding(
                "far from declared", f"{said} {ratio:.3g} times the declared value",
                f"{e.study.graph.name}, {entry.name}",
                "it may stand for a wrong unit in the recording, or for physics that is missing",
                "check the units of the channels, then the declared value, then the model",
            )  # fmt: skip


def _misfit(e: Estimation) -> Iterator[Finding]:
    for floor, p in zip(e.floors, e.stack.problems, strict=False):
        if (floor < 1e-9 * np.abs(p.data.readings).max(axis=0)).any():
            return  # a constant reading has no floor
    left = e.chi2("train")
    if np.isfinite(left) and left > BEYOND_NOISE:
        yield Finding(
            "misfit", f"what the model leaves is {times_noise(left):.3g} times the noise",
            e.study.graph.name, "the model leaves out more than noise",
            "diagnose the recording; intervals assume that the model is right",
        )  # fmt: skip


def _trend(e: Estimation) -> Iterator[Finding]:
    for r, name in enumerate(e.record_names[: len(e.study.recordings)]):
        rest = e.residuals("train", r)
        units = e.study.recordings[r].units
        n = rest.shape[0]
        if n < 100 or not np.isfinite(rest).all():
            continue
        t = np.linspace(-0.5, 0.5, n)
        for c, sensor in enumerate(e.sensors(r)):
            slope = float(12 * np.mean(t * rest[:, c]))
            left = rest[:, c] - slope * t
            error = float(block_means(left, 20).std() / np.sqrt(20)) * np.sqrt(12.0)
            if abs(slope) > max(6 * error, 2 * float(e.floors[r][c])):
                yield Finding(
                    "drift",
                    f"what is left of {sensor} moves by {quantity(slope, units[sensor], 3)} over "
                    "the record",
                    f"{name}, {sensor}",
                    "plant or sensor change with time, or a command has an offset",
                    "add the drift to the model, or Nuisances(commands=True)",
                )  # fmt: skip
