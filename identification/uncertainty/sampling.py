"""Samples of the posterior of a few parameters, by the affine-invariant ensemble of emcee.

Goodman and Weare, Comm. App. Math. Comp. Sci. 5 (2010) 65; Foreman-Mackey et al., PASP 125 (2013)
306. Initial states, lags and offsets stay where the fit put them to first order: they follow the
parameters along their Gauss-Newton line, so that only the parameters are walked. Convergence is
judged by the autocorrelation time and by the split R-hat of Gelman et al. (Bayesian Data Analysis,
2013), with halves of each walker as chains. Needs the extra ``sampling``.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from bondgraph.signals.files.checks import optional
from bondgraph.support.arrays import FloatArray
from bondgraph.support.errors import BondsightError, UnusableInput
from identification.estimation.threads import single_threaded
from identification.study.joint import JointPoint
from identification.uncertainty.fitted import FitView, sum_of_squares

Progress = Callable[[int, int, str], None]
MOST_PARAMETERS = 20
LEAST_TIMES = 50.0
"""Steps over autocorrelation times that make an estimate of that time trustworthy."""
LARGEST_RHAT = 1.05


@dataclass(frozen=True, eq=False)
class Sample:
    """Draws of parameters.

    Attributes
    ----------
    names, units : tuple of str
    draws : ndarray, shape (n_steps, n_walkers, n)
        After the run-in, SI.
    autocorrelation : ndarray, shape (n,)
        In steps.
    rhat : ndarray, shape (n,)
    acceptance : float
    status : str
        ``converged``, or what is missing.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    draws: FloatArray
    autocorrelation: FloatArray
    rhat: FloatArray
    acceptance: float
    status: str

    @property
    def flat(self) -> FloatArray:
        """All draws in one row, shape (n_draws, n)."""
        return self.draws.reshape(-1, len(self.names))

    def quantiles(self, q: tuple[float, ...] = (0.025, 0.5, 0.975)) -> dict[str, tuple[float, ...]]:
        """Return quantiles by parameter, SI."""
        made = np.quantile(self.flat, q, axis=0)
        return {n: tuple(map(float, made[:, i])) for i, n in enumerate(self.names)}

    def to_pandas(self) -> Any:
        """Return a data frame of all draws (needs pandas)."""
        pd = optional("pandas", "to_pandas", "tables")
        return pd.DataFrame(self.flat, columns=list(self.names))

    def to_xarray(self) -> Any:
        """Return a data set with dimensions walker and step (needs xarray)."""
        xr = optional("xarray", "to_xarray", "tables")
        return xr.Dataset(
            {
                n: (("walker", "step"), self.draws[:, :, i].T, {"units": u})
                for i, (n, u) in enumerate(zip(self.names, self.units, strict=True))
            },
            attrs={"status": self.status, "acceptance": self.acceptance},
        )

    def __str__(self) -> str:
        """One line a parameter."""
        lines = [f"{self.flat.shape[0]} draws, {self.status}, acceptance {self.acceptance:.2f}"]
        for i, (n, (low, mid, high)) in enumerate(self.quantiles().items()):
            lines.append(
                f"  {n} = {mid:.4g} {self.units[i]} [{low:.4g}, {high:.4g}]  R-hat "
                f"{self.rhat[i]:.3f}, {self.autocorrelation[i]:.0f} steps"
            )
        return "\n".join(lines)


def split_rhat(chains: FloatArray) -> FloatArray:
    """Return R-hat of every column; halves of the chains count as chains.

    Parameters
    ----------
    chains : ndarray, shape (n_steps, n_chains, n)
    """
    half = chains.shape[0] // 2
    parts = np.concatenate([chains[:half], chains[half : 2 * half]], axis=1)
    within = parts.var(axis=0, ddof=1).mean(axis=0)
    between = half * parts.mean(axis=0).var(axis=0, ddof=1)
    with np.errstate(all="ignore"):
        total = (half - 1) / half * within + between / half
        return np.asarray(np.where(within > 0, np.sqrt(total / within), np.inf))


def draw(
    log_density: Callable[[FloatArray], float],
    start: FloatArray,
    spread: FloatArray,
    *,
    steps: int = 2000,
    walkers: int | None = None,
    seed: int = 0,
    progress: Progress | None = None,
) -> tuple[FloatArray, FloatArray, FloatArray, float, str]:
    """Walk over any log density; returns draws, autocorrelation, R-hat, acceptance, status.

    Stops early once both criteria hold; Ctrl-C keeps what was drawn.

    Parameters
    ----------
    log_density : callable
        Of a vector of shape (n,).
    start : ndarray, shape (n,)
        Centre of the first walkers.
    spread : ndarray, shape (n,) or (n, n)
        Standard deviations of the first walkers, or a root of their covariance.
    """
    emcee = optional("emcee", "sampling", "sampling")
    n = start.size
    many = walkers or max(4 * n, 16)
    if many < 2 * n:
        raise UnusableInput(f"{many} walkers for {n} parameters: give at least {2 * n}")
    rng = np.random.default_rng(seed)
    root = np.diag(spread) if spread.ndim == 1 else spread
    first = start + rng.standard_normal((many, n)) @ root.T
    sampler = emcee.EnsembleSampler(many, n, log_density)
    sampler.random_state = np.random.RandomState(seed).get_state()
    status = f"not converged after {steps} steps: raise steps"
    tau = np.full(n, np.inf)
    try:
        for done, _ in enumerate(sampler.sample(first, iterations=steps), start=1):
            if done % 100:
                continue
            if progress is not None:
                progress(done, steps, "sampling")
            tau = np.asarray(sampler.get_autocorr_time(tol=0))
            kept = _kept(sampler.get_chain(), tau)
            known = bool(np.isfinite(tau).all()) and done > LEAST_TIMES * float(tau.max())
            if known and float(split_rhat(kept).max()) < LARGEST_RHAT:
                status = "converged"
                break
    except KeyboardInterrupt:
        status = "cancelled: what was drawn is kept"
    chain = np.asarray(sampler.get_chain())
    if chain.shape[0] < 4:
        raise BondsightError("sampling was cancelled before anything could be kept")
    kept = _kept(chain, tau)
    return kept, tau, split_rhat(kept), float(np.mean(sampler.acceptance_fraction)), status


def _kept(chain: FloatArray, tau: FloatArray) -> FloatArray:
    """Leave out a run-in of five autocorrelation times, at most half."""
    longest = float(np.max(tau)) if np.isfinite(tau).all() else np.inf
    return np.asarray(chain[int(min(5 * longest, chain.shape[0] // 2)) :])


@single_threaded
def sample(
    fit: FitView,
    *,
    steps: int = 2000,
    walkers: int | None = None,
    seed: int = 0,
    progress: Progress | None = None,
) -> Sample:
    """Draw from the posterior of the parameters of a fit.

    The density is ``exp(-sum of squares / (2 variance))`` with the given priors, flat in the
    logarithm of logarithmic parameters, within the bounds. Coloured residuals make it too narrow;
    fit with ``noise="coloured"``.

    Raises
    ------
    UnusableInput
        Too many parameters, or flat directions without a prior: those have no posterior.
    """
    info = fit.plain
    if len(fit.parameters) > MOST_PARAMETERS:
        raise UnusableInput(
            f"sampling {len(fit.parameters)} parameters: this walk is for at most "
            f"{MOST_PARAMETERS}; fix some, or take profiles"
        )
    if flat := [n for n, f in zip(info.names, info.flat, strict=True) if f and info.null.size]:
        raise UnusableInput(
            f"sampling {', '.join(flat)}: the data leave a direction of them open; give a prior "
            "or fix one"
        )
    follow = _follow(fit)
    lower, upper = (b[[u.place for u in fit.parameters]] for b in fit.stack.bounds)
    start = fit.point.theta[[u.place for u in fit.parameters]]
    variance = fit.variance

    def log_density(theta: FloatArray) -> float:
        if (theta < lower).any() or (theta > upper).any():
            return -np.inf
        point = follow(theta)
        made = fit.stack.evaluate(point, derivatives=False)
        total = sum_of_squares(fit.stack, made, point, fit.parameters)
        return -0.5 * total / variance if np.isfinite(total) else -np.inf

    root = np.asarray(
        np.linalg.cholesky(info.covariance + 1e-12 * np.diag(np.diag(info.covariance))), float
    )
    found = draw(
        log_density, start, root, steps=steps, walkers=walkers, seed=seed, progress=progress
    )
    draws = np.stack(
        [
            f.start * np.exp(found[0][:, :, i]) if f.log else f.start + f.scale * found[0][:, :, i]
            for i, f in enumerate(u.free for u in fit.parameters)
        ],
        axis=2,
    )
    return Sample(
        tuple(u.name for u in fit.parameters),
        tuple(u.free.parameter.unit for u in fit.parameters),
        draws,
        *found[1:],
    )


def _follow(fit: FitView) -> Callable[[FloatArray], JointPoint]:
    """Return how initial states and nuisances follow the parameters, to first order."""
    stack, at = fit.stack, fit.point
    made = stack.evaluate(at)
    system = stack.normal(made, at)
    own = [u.place for u in fit.parameters]
    lower, upper = stack.bounds
    others = [i for i in range(stack.n) if i not in own and upper[i] > lower[i]]
    drag = np.zeros((len(others), len(own)))
    if others:
        drag = -np.linalg.lstsq(system.factor[:, others], system.factor[:, own], rcond=None)[0]

    def follow(theta: FloatArray) -> JointPoint:
        delta = np.zeros(stack.n)
        delta[own] = theta - at.theta[own]
        delta[others] = drag @ delta[own]
        moved = np.clip(at.theta + delta, lower, upper)
        delta = moved - at.theta
        return JointPoint(moved, stack.followed(system, at, delta, settling=0.0))

    return follow
