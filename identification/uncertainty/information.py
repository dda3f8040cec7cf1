"""Fisher information, covariance, correlation and standard errors from weighted sensitivities.

The coordinates are ``theta = ln p`` for logarithmic parameters and ``theta = p / scale`` for
linear ones, so that every column of the Jacobian counts standard deviations of the noise per
relative change. For coloured residuals see `identification.statistics.blocks`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from bondgraph.support.arrays import FloatArray
from bondgraph.support.errors import UnusableInput, require_known
from bondgraph.support.tall import triangle
from identification.statistics.blocks import sandwich

NULL = 1e-7
"""Singular values below this share of the largest count as zero (columns of unit length)."""


@dataclass(frozen=True, eq=False)
class Sensitivities:
    """Weighted sensitivities of all scored samples by the free parameters.

    Parameters
    ----------
    names : tuple of str
        The n free parameters.
    values : ndarray, shape (n,), SI
    jacobian : ndarray, shape (M, n)
        ``d(output / noise) / d theta``.
    log : tuple of bool
        Which parameters are logarithmic; all positive ones when not given.
    scale : ndarray, shape (n,), SI, optional
        Scale of the linear ones; ``|value|``, or 1 at zero, when not given.
    units : tuple of str, optional

    Raises
    ------
    UnusableInput
        Shapes do not fit, or something is not finite.
    """

    names: tuple[str, ...]
    values: FloatArray
    jacobian: FloatArray
    log: tuple[bool, ...] = ()
    scale: FloatArray = field(default_factory=lambda: np.zeros(0))
    units: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Check shapes, fill in defaults."""
        n = len(self.names)
        values = np.asarray(self.values, float)
        jacobian = np.asarray(self.jacobian, float)
        if values.shape != (n,) or jacobian.ndim != 2 or jacobian.shape[1] != n:
            raise UnusableInput(
                f"sensitivities: {n} names, values of shape {values.shape}, Jacobian of shape "
                f"{jacobian.shape}; one value and one column a name are needed"
            )
        for i, name in enumerate(self.names):
            if not np.isfinite(values[i]) or not np.isfinite(jacobian[:, i]).all():
                raise UnusableInput(
                    f"sensitivities: value or column of {name} is not finite; the simulation "
                    "broke there, choose another point"
                )
        log = self.log or tuple(bool(v > 0) for v in values)
        scale = np.asarray(self.scale, float)
        if not scale.size:
            scale = np.where(values == 0, 1.0, np.abs(values))
        for key, given in (
            ("values", values),
            ("jacobian", jacobian),
            ("log", tuple(log)),
            ("scale", scale),
            ("units", self.units or ("",) * n),
        ):
            object.__setattr__(self, key, given)
        if len(self.log) != n or self.scale.shape != (n,) or len(self.units) != n:
            raise UnusableInput(f"sensitivities: log, scale and units need one entry for {n} names")

    @property
    def slopes(self) -> FloatArray:
        """Derivative of each value by its theta, shape (n,), SI."""
        return np.where(np.array(self.log, bool), self.values, self.scale)

    @property
    def strength(self) -> FloatArray:
        """Length of each column: total change of the outputs, in noise, per unit of theta."""
        return np.asarray(np.linalg.norm(self.jacobian, axis=0))

    def index(self, name: str) -> int:
        """Return the place of a parameter.

        Raises
        ------
        UnknownName
            There is none of that name.
        """
        require_known("free parameter", "the fit", self.names, name)
        return self.names.index(name)


@dataclass(frozen=True, eq=False)
class Information:
    """What the data say about the parameters, to second order.

    Attributes
    ----------
    sensitivities : Sensitivities
    fisher : ndarray, shape (n, n)
        ``J' J`` (and priors), per theta.
    covariance : ndarray, shape (n, n)
        Of theta, on the directions that are determined (pseudo-inverse); it says nothing about
        a parameter that has a part in a flat direction, see `flat`.
    null : ndarray, shape (n, n_null)
        Orthonormal basis of the flat directions, in theta.
    singular : ndarray, shape (min(M, n),)
        Singular values of the Jacobian with columns of unit length, largest first.
    coloured : bool
        Whether the covariance is the sandwich.
    """

    sensitivities: Sensitivities
    fisher: FloatArray
    covariance: FloatArray
    null: FloatArray
    singular: FloatArray
    coloured: bool

    @property
    def names(self) -> tuple[str, ...]:
        """The free parameters."""
        return self.sensitivities.names

    @property
    def flat(self) -> NDArray[np.bool_]:
        """Whether each parameter has a part in a flat direction, shape (n,)."""
        # in units of what is determined, or two columns of very different length hide each other
        part = np.abs(self.null * self.sensitivities.strength[:, None]).max(axis=1, initial=0.0)
        dead = self.sensitivities.strength == 0
        return np.asarray(dead | (part > 1e-5 * part.max(initial=1e-300)), bool)

    @property
    def standard_errors(self) -> FloatArray:
        """Standard errors of theta (relative, for logarithmic parameters); infinite if flat."""
        sd = np.sqrt(np.maximum(np.diag(self.covariance), 0.0))
        return np.where(self.flat, np.inf, sd) if self.null.shape[1] else np.asarray(sd)

    @property
    def correlation(self) -> FloatArray:
        """Correlation matrix, shape (n, n); NaN where a parameter has no finite variance."""
        sd = np.where(np.isfinite(self.standard_errors), self.standard_errors, np.nan)
        with np.errstate(all="ignore"):
            return np.asarray(self.covariance / np.outer(sd, sd))

    def error_of(self, combination: FloatArray) -> float:
        """Return the standard error of ``sum a_i theta_i`` for a determined combination."""
        a = np.asarray(combination, float)
        return float(np.sqrt(max(float(a @ self.covariance @ a), 0.0)))

    def interval(self, name: str, z: float = 1.959964) -> tuple[float, float]:
        """Return the 95 % interval of a parameter, SI; open ends are infinite (or zero)."""
        s = self.sensitivities
        i = s.index(name)
        half, v = z * float(self.standard_errors[i]), float(s.values[i])
        if s.log[i]:
            if half > 700.0:
                return 0.0, float("inf")
            return v * float(np.exp(-half)), v * float(np.exp(half))
        return v - half * float(s.scale[i]), v + half * float(s.scale[i])

    def __repr__(self) -> str:
        """Short text."""
        flat = self.null.shape[1]
        return f"Information({len(self.names)} parameters, {flat} flat directions)"


def information(
    sensitivities: Sensitivities,
    residual: FloatArray | None = None,
    *,
    prior: FloatArray | None = None,
    channels: Sequence[int] = (),
    variance: float = 1.0,
    readings: Sequence[int] = (),
) -> Information:
    """Return information and covariance at a fitted point.

    Parameters
    ----------
    sensitivities : Sensitivities
    residual : ndarray, shape (M,), optional
        Weighted residuals in the order of the Jacobian; with them the covariance is the sandwich,
        never smaller on its diagonal than the plain one, and widened for Student's t of its few
        blocks. Without them the noise counts as white.
    prior : ndarray, shape (n,), optional
        Precision of a normal prior on each theta.
    channels : sequence of int, optional
        Number of consecutive rows of each record or channel, so that no block straddles two.
    variance : float
        Mean square of the weighted residuals if the noise level was estimated, else 1.
    readings : sequence of int, optional
        How many of the channels are the readings of each window, see `block_rows`.
    """
    j = sensitivities.jacobian
    n = j.shape[1]
    fisher = j.T @ j / variance + (np.diag(prior) if prior is not None else 0.0)
    stacked = j / np.sqrt(variance)
    if prior is not None:
        stacked = np.vstack([stacked, np.diag(np.sqrt(prior))])
    length = np.linalg.norm(stacked, axis=0)
    live = length > 1e-12 * max(float(length.max(initial=0.0)), 1e-300)
    unit = stacked[:, live] / length[live]
    _, singular, rows = np.linalg.svd(_triangle(unit), full_matrices=True)
    kept = singular > NULL * singular.max(initial=0.0)
    count = int(kept.sum())
    null = np.zeros((n, n - count))
    null[np.flatnonzero(~live), np.arange(n - int(live.sum()))] = 1.0
    null[live, n - int(live.sum()) :] = rows[count:].T / length[live][:, None]
    if null.shape[1]:
        null, _ = np.linalg.qr(null)
    root = np.zeros((n, count))
    root[live] = (rows[:count].T / singular[:count]) / length[live][:, None]
    covariance = root @ root.T
    coloured = residual is not None
    if residual is not None:
        root = np.sqrt(variance)
        weight = np.zeros(n) if prior is None else prior
        r = np.asarray(residual, float) / root
        robust = sandwich(j / root, r, covariance, weight, channels, readings)
        grow = np.sqrt(np.maximum(_ratio(np.diag(robust), np.diag(covariance)), 1.0))
        base = np.sqrt(np.maximum(_ratio(np.diag(robust), np.diag(covariance)), 1e-300))
        covariance = robust * np.outer(grow / base, grow / base)
    return Information(sensitivities, np.asarray(fisher), covariance, null, singular, coloured)


def _triangle(a: FloatArray) -> FloatArray:
    return triangle(a) if a.shape[0] > a.shape[1] else a


def _ratio(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.divide(a, b, out=np.ones_like(a), where=b > 0)
