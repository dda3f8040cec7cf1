"""What to know about a fit by prediction errors before believing it, one sentence each."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from identification.estimation.levenberg_marquardt import FitStatus
from identification.estimation.prediction.model import PredictionModel
from identification.statistics.whiteness import white_p

if TYPE_CHECKING:
    from identification.estimation.prediction.result import PredictionFit


def remarks(model: PredictionModel, fit: PredictionFit) -> tuple[str, ...]:
    """Return the sentences that apply."""
    return (*_about_laws(model), *_about_noise(model, fit), *_about_the_rest(model, fit))


def _about_laws(model: PredictionModel) -> list[str]:
    found = []
    for port in model.compiled.space.laws:
        if port.law.n_memory:
            found.append(
                f"the memory of {port.element} follows the filtered argument and its own "
                "uncertainty is left out: variances are somewhat too small"
            )
        if port.law.set_valued:
            found.append(
                f"{port.element} jumps where its argument changes sign; the filter's line is poor "
                "there: while it sticks the filter takes the motion as known, and around reversals "
                "the likelihood is an approximation"
            )
        elif not port.law.n_memory:
            found.append(
                f"{port.element} is nonlinear: the filter linearises it along the estimate "
                "(extended Kalman filter), good while the uncertainty spans little curvature"
            )
    return found


def _about_noise(model: PredictionModel, fit: PredictionFit) -> list[str]:
    found = []
    for place, value in fit.sigma.items():
        if value == 0.0:
            found.append(
                f"the data ask for no process noise at {place}: its diffusion is at its lower bound"
            )
    if not model.diffusions:
        found.append("no process noise is allowed: this is a fit of output errors")
    lower, _ = model.bounds()
    for i, j in enumerate(model.estimated_noise, start=model.slots.noise.start):
        if fit.theta[i] <= lower[i] + 1e-9:
            found.append(
                f"the noise of {model.names[j]} is at its lower bound: process noise explains all "
                "of it; give the sensor's noise if it is known"
            )
    return found


def _about_the_rest(model: PredictionModel, fit: PredictionFit) -> list[str]:
    found = []
    if fit.status is not FitStatus.CONVERGED:
        found.append(f"the search ended with '{fit.status.value}': intervals are not to be trusted")
        if fit.status is FitStatus.BROKEN:
            return [*found, "the filter fails at the start values: give others"]
    for name, p in whiteness(model, fit).items():
        if p < 0.01:
            found.append(
                f"the innovations of {name} are not white (Ljung-Box p = {p:.1g}): the model still "
                "leaves something out"
            )
    expected, robust = np.diag(fit.covariance), np.diag(fit.sandwich)
    for i, f in enumerate(model.free):
        if robust[i] > 2.25 * expected[i] > 0:
            times = np.sqrt(robust[i] / expected[i])
            found.append(
                f"the interval of {f.parameter.name} is a robust one, {times:.3g} times that of a "
                "right noise model: the noise is not as assumed"
            )
    return found


def whiteness(model: PredictionModel, fit: PredictionFit, lags: int = 20) -> dict[str, float]:
    """Return the Ljung-Box p-value of each reading's training innovations, the worst record's."""
    found: dict[str, float] = {}
    for j, name in enumerate(model.names):
        pairs = zip(model.records, fit.predicted, strict=True)
        values = [white_p(seen.innovation[d.mask("train"), j], lags) for d, seen in pairs]
        found[name] = min(1.0, min(values) * len(values))
    return found
