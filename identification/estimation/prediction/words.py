"""What to know about a fit by prediction errors before believing it, one sentence each."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from identification.estimation.levenberg_marquardt import FitStatus
from identification.statistics.whiteness import white_p

if TYPE_CHECKING:
    from identification.estimation.prediction.fit import FilterFit

LINEARISED = (
    "is nonlinear: the filter linearises it along the estimate (extended Kalman filter), good "
    "while the uncertainty spans little curvature"
)


def remarks(fit: FilterFit) -> tuple[str, ...]:
    """Return the sentences that apply."""
    return (*_about_laws(fit), *_about_noise(fit), *_about_the_rest(fit))


def _about_laws(fit: FilterFit) -> list[str]:
    found, dynamics = [], fit.kalman.first.dynamics
    for element, law in fit.kalman.plants[0].laws:
        if law.n_memory:
            found.append(
                f"the memory of {element} follows the filtered argument and its own "
                "uncertainty is left out: variances are somewhat too small"
            )
        if law.set_valued:
            found.append(
                f"{element} jumps where its argument changes sign; the filter's line is poor "
                "there: while it sticks the filter takes the motion as known, and around reversals "
                "the likelihood is an approximation"
            )
        elif not law.n_memory:
            found.append(f"{element} {LINEARISED}")
    if not found and dynamics.lure is None:
        found.append(f"{dynamics.name} {LINEARISED}")
    return found


def _about_noise(fit: FilterFit) -> list[str]:
    found = [
        f"the data ask for no process noise at {place}: its diffusion is at its lower bound"
        for place, value in fit.sigma.items()
        if value == 0.0
    ]
    if not fit.sigma:
        found.append("no process noise is allowed: this is a fit of output errors")
    at, (lower, _) = fit.kalman.slots.noise, fit.kalman.bounds
    for name, t, low in zip(fit.kalman.estimated, fit.theta[at], lower[at], strict=True):
        if t <= low + 1e-9:
            found.append(
                f"the noise of {name} is at its lower bound: process noise explains all "
                "of it; give the sensor's noise if it is known"
            )
    return found


def _about_the_rest(fit: FilterFit) -> list[str]:
    found = []
    if fit.status is not FitStatus.CONVERGED:
        found.append(f"the search ended with '{fit.status.value}': intervals are not to be trusted")
        if fit.status is FitStatus.BROKEN:
            return [*found, "the filter fails at the start values: give others"]
    for name, p in whiteness(fit).items():
        if p < 0.01:
            found.append(
                f"the innovations of {name} are not white (Ljung-Box p = {p:.1g}): the model still "
                "leaves something out"
            )
    expected, robust = np.diag(fit.covariance), np.diag(fit.sandwich)
    for i, f in fit.kalman.stack.free.items():
        if robust[i] > 2.25 * expected[i] > 0:
            times = np.sqrt(robust[i] / expected[i])
            found.append(
                f"the interval of {f.parameter.name} is a robust one, {times:.3g} times that of a "
                "right noise model: the noise is not as assumed"
            )
    return found


def whiteness(fit: FilterFit, lags: int = 20) -> dict[str, float]:
    """Return the Ljung-Box p-value of each reading's training innovations, the worst record's."""
    found: dict[str, list[float]] = {}
    for p, seen in zip(fit.kalman.problems, fit.filtered.innovation, strict=True):
        for name, column in zip(p.data.names, seen[p.data.mask("train")].T, strict=True):
            found.setdefault(name, []).append(white_p(column, lags))
    return {n: min(1.0, min(v) * len(v)) for n, v in found.items()}
