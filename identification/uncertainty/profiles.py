"""Profile likelihoods of the parameters of a fit, or of products of them, in parallel."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from bondgraph.support.arrays import FloatArray
from bondgraph.support.errors import UnusableInput
from bondgraph.support.parallel import results
from bondgraph.support.spelled import spelled
from bondgraph.support.tall import triangle
from identification.estimation.levenberg_marquardt import minimise
from identification.estimation.result import Estimation
from identification.estimation.threads import single_threaded
from identification.study.joint import JointPoint, JointProblem, NormalEquations
from identification.study.residual import ResidualEvaluation
from identification.uncertainty.fitted import FitView, from_estimation, sum_of_squares
from identification.uncertainty.profile import Profile, profile, threshold_of

Progress = Callable[[int, int, str], None]
"""Called with what is done, how many there are, and the name just finished."""
TIGHT = 100.0
"""Deviations of a held combination count so many standard errors."""


@dataclass(frozen=True, eq=False)
class HeldStack(JointProblem):
    """A stack with unknowns held, or one combination of them.

    Attributes
    ----------
    direction : ndarray, shape (n,)
        Combination ``a theta`` that a tight weight keeps at `target`; empty for none.
    weight : float
    """

    direction: FloatArray = field(default_factory=lambda: np.zeros(0))
    target: float = 0.0
    weight: float = 0.0

    def cost(self, evaluations: Sequence[ResidualEvaluation], point: JointPoint) -> float:
        """Mean square, the held combination included."""
        total = super().cost(evaluations, point)
        if self.direction.size:
            off = self.weight * (float(self.direction @ point.theta) - self.target)
            total += off**2 / self.count(evaluations)
        return total

    def normal(
        self, evaluations: Sequence[ResidualEvaluation], point: JointPoint
    ) -> NormalEquations:
        """Compressed least squares, with one more row for the held combination."""
        made = super().normal(evaluations, point)
        if not self.direction.size:
            return made
        off = self.weight * (self.target - float(self.direction @ point.theta))
        row = np.append(self.weight * self.direction, off)
        whole = np.vstack([np.hstack([made.factor, made.right[:, None]]), row])
        r = triangle(whole)
        return replace(made, factor=r[:, : self.n], right=r[:, self.n])


def _held(stack: JointProblem, **changes: Any) -> HeldStack:
    return HeldStack(stack.problems, stack.names, stack.columns, stack.factors, **changes)


@single_threaded
def profile_one(fit: FitView, name: str, *, most: int = 30, beyond: int = 0) -> Profile:
    """Profile a parameter, or a product such as ``k/m`` or ``T^2*C``, of a fit.

    Parameters
    ----------
    fit : FitView
    name : str
    most, beyond
        As in `profile`.
    """
    plain = fit.plain
    if name in plain.names:
        u = fit.of(name)
        width = float(plain.standard_errors[plain.names.index(name)])
        f = u.free
        origin = np.log(f.start) if f.log else f.start / f.scale
        value = f.value(float(fit.point.theta[u.place]))

        def refit(x: float, start: JointPoint) -> tuple[float, JointPoint]:
            stack = _held(fit.stack, held={u.place: x - origin})
            return _refitted(stack, start)

        return profile(
            refit, name, value, fit.sum_of_squares, fit.point,
            width=width if np.isfinite(width) and width > 0 else 0.5, log=f.log,
            scale=f.scale, unit=f.parameter.unit, bounds=(u.lower, u.upper), most=most,
            beyond=beyond, threshold=_threshold(fit, fit.inflation(name)),
        )  # fmt: skip
    powers = _powers(name, fit)
    direction, offset = np.zeros(fit.stack.n), 0.0
    for n, e in powers.items():
        u = fit.of(n)
        direction[u.place] = e
        offset += e * float(np.log(u.free.start))
    local = np.array([float(powers.get(n, 0)) for n in plain.names])
    width = plain.error_of(local)
    robust = fit.robust.error_of(local)
    value = float(np.exp(direction @ fit.point.theta + offset))
    weight = TIGHT / max(width, 1e-9)

    def refit_product(x: float, start: JointPoint) -> tuple[float, JointPoint]:
        stack = _held(fit.stack, direction=direction, target=x - offset, weight=weight)
        total, warm = _refitted(stack, start)
        return total - (weight * (float(direction @ warm.theta) - x + offset)) ** 2, warm

    return profile(
        refit_product, name, value, fit.sum_of_squares, fit.point, width=width,
        threshold=_threshold(fit, (robust / width) ** 2 if width > 0 else 1.0),
        most=most, beyond=beyond,
    )  # fmt: skip


@single_threaded
def rise_at(fit: FitView, name: str, value: float) -> tuple[float, float]:
    """Return the rise of the sum of squares with a parameter held at `value` (SI), and the limit.

    The value lies in the 95 % profile interval of a single valley if the rise is below the limit.
    """
    u = fit.of(name)
    if (u.free.log and value <= 0) or not u.lower <= value <= u.upper:
        return float("inf"), _threshold(fit, fit.inflation(name))
    stack = _held(fit.stack, held={u.place: u.free.theta(value)})
    total, _ = _refitted(stack, fit.point)
    return total - fit.sum_of_squares, _threshold(fit, fit.inflation(name))


def _threshold(fit: FitView, inflation: float) -> float:
    freedom = float("inf") if fit.known_noise else fit.freedom
    return threshold_of(fit.variance, freedom, inflation)


def _refitted(stack: HeldStack, start: JointPoint) -> tuple[float, JointPoint]:
    made = minimise(stack, start, max_iterations=30, tolerance=1e-7)
    if not np.isfinite(made.cost):
        return float("inf"), start
    return sum_of_squares(stack, made.evaluations, made.point), made.point


def _powers(text: str, fit: FitView) -> dict[str, int]:
    """Read a product such as ``a^2*b/(c*d)`` of logarithmic parameters."""
    above, _, below = text.replace(" ", "").partition("/")
    found: dict[str, int] = {}
    for sign, part in ((1, above), (-1, below.strip("()"))):
        for factor in filter(None, part.split("*")):
            n, _, power = factor.partition("^")
            if n == "1":
                continue
            i = fit.sensitivities.index(n)
            if not fit.sensitivities.log[i] or (power and not power.lstrip("-").isdigit()):
                raise UnusableInput(
                    f"profile of {text!r}: {factor} is no whole power of a positive parameter; "
                    "write products such as k/m or T^2*C"
                )
            found[n] = found.get(n, 0) + sign * int(power or 1)
    return found


@spelled
def profiles(
    fit: FitView | Estimation,
    names: Sequence[str] | None = None,
    *,
    jobs: int = 1,
    most: int = 30,
    beyond: int = 0,
    progress: Progress | None = None,
) -> tuple[Profile, ...]:
    """Profile several parameters or products; Ctrl-C keeps those that are done.

    Parameters
    ----------
    fit : Estimation, or what `from_estimation` made of it
    names : sequence of str, optional
        All parameters when not given.
    jobs : int
        Processes (joblib; the backend follows `joblib.parallel_config`).

    Examples
    --------
    >>> (profile,) = profiles(fit, ["m"])
    >>> profile.shape
    'two-sided'
    """
    from joblib import delayed

    fit = from_estimation(fit) if isinstance(fit, Estimation) else fit
    wanted = tuple(names) if names is not None else tuple(u.name for u in fit.parameters)
    done: list[Profile] = []
    try:
        work = (delayed(profile_one)(fit, n, most=most, beyond=beyond) for n in wanted)
        for made in results(work, jobs, ordered=True):
            done.append(made)
            if progress is not None:
                progress(len(done), len(wanted), made.name)
    except KeyboardInterrupt:
        return tuple(done)
    return tuple(done)
