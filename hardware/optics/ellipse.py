"""The ellipse of two quadrature signals, and its linear fit.

``u1 = R cos(phi) + p``, ``u2 = (R / r) sin(phi - a) + q``: offsets, unequal amplitudes and a lack
of quadrature bend the phase within a fringe. P. L. M. Heydemann, Appl. Opt. 20 (1981) 3382.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from bondgraph.support.arrays import FloatArray as Array
from bondgraph.support.errors import UnusableInput
from hardware.optics.conic_kind import ConicKind, form_kind, sample_kind
from hardware.optics.phase import quadrature_phase, unwrap

SHORTEST_ARC: Final = 0.6
"""Fringes; on less the five numbers are not told apart well enough to improve on older ones."""
_ROUNDS: Final = 3


@dataclass(frozen=True, slots=True)
class Ellipse:
    """Coefficients of the quadrature, frozen.

    Parameters
    ----------
    offset_1, offset_2 : float
        p and q, in the unit of the signals.
    ratio : float
        r, amplitude of the first by that of the second.
    skew : float
        a, rad, what the second lacks to 90 degrees.
    radius : float
        R, amplitude of the first.
    """

    offset_1: float = 0.0
    offset_2: float = 0.0
    ratio: float = 1.0
    skew: float = 0.0
    radius: float = 1.0

    def __post_init__(self) -> None:
        """Refuse what is no ellipse."""
        if not (self.ratio > 0.0 and self.radius > 0.0 and abs(self.skew) < 1.5):
            raise UnusableInput(
                f"quadrature: ratio {self.ratio:g}, radius {self.radius:g}, skew {self.skew:g} rad "
                "are no ellipse; amplitudes must be positive and the skew below 1.5 rad"
            )

    def circle(self, u1: ArrayLike, u2: ArrayLike) -> tuple[Array, Array]:
        """Return (R cos phi, R sin phi) of raw signals."""
        w1 = np.asarray(u1, dtype=np.float64) - self.offset_1
        w2 = np.asarray(u2, dtype=np.float64) - self.offset_2
        sine = (w1 * np.sin(self.skew) + self.ratio * w2) / np.cos(self.skew)
        return np.asarray(w1), np.asarray(sine)

    def signals(self, phase: ArrayLike) -> tuple[Array, Array]:
        """Return the raw signals of a phase (rad)."""
        f = np.asarray(phase, dtype=np.float64)
        return (
            np.asarray(self.radius * np.cos(f) + self.offset_1),
            np.asarray(self.radius / self.ratio * np.sin(f - self.skew) + self.offset_2),
        )

    def level(self, u1: ArrayLike, u2: ArrayLike) -> Array:
        """Amplitude of every sample by that of the fit; 1 is full light, 0 none."""
        return np.asarray(np.hypot(*self.circle(u1, u2)) / self.radius)


@dataclass(frozen=True, slots=True)
class EllipseFit:
    """Result of a fit.

    Parameters
    ----------
    ellipse : Ellipse
        To be used: the fitted one, or the given one if `kept`.
    uncertainty : tuple of float or None
        Standard uncertainty of every coefficient of a new fit, in the order of `Ellipse`; None if
        `kept`. Residuals are taken as independent.
    arc : float
        Fringes that the record covers.
    kept : bool
        Whether the given coefficients were kept because the arc is too short.
    noise : float
        Root mean square of the radius about the ellipse, by the radius.
    """

    ellipse: Ellipse
    uncertainty: tuple[float, float, float, float, float] | None
    arc: float
    kept: bool
    noise: float


def fit_ellipse(
    u1: ArrayLike,
    u2: ArrayLike,
    keep: Ellipse | None = None,
    *,
    shortest_arc: float = SHORTEST_ARC,
) -> EllipseFit:
    """Fit the ellipse of a record by linear least squares.

    ``A u1^2 + B u2^2 + C u1 u2 + D u1 + E u2 = 1`` about the middle of the last round, scaled to
    unit amplitude; the middle is improved in three rounds because the constant of the equation is
    not invariant to it.

    Parameters
    ----------
    u1, u2 : array_like
        ``(n,)`` raw signals, one unit.
    keep : Ellipse, optional
        Coefficients of an earlier record, kept if the arc is too short.
    shortest_arc : float
        Fringes.

    Returns
    -------
    EllipseFit

    Raises
    ------
    UnusableInput
        Too few or non-finite samples, no ellipse, or too short an arc with nothing to keep.
    """
    a, b = _signals(u1, u2)
    if keep is not None:
        arc = _arc(a, b, keep)
        if arc < shortest_arc:
            return EllipseFit(keep, None, arc, True, _noise(a, b, keep))
    found, spread = _rounds(a, b, keep)
    arc = _arc(a, b, found)
    if arc < shortest_arc:
        if keep is not None:
            return EllipseFit(keep, None, arc, True, _noise(a, b, keep))
        raise UnusableInput(
            f"quadrature: the record covers {arc:.2f} fringe, a fit needs {shortest_arc:g}; move "
            f"by {shortest_arc * 316:.0f} nm or more, or give the coefficients of an earlier record"
        )
    return EllipseFit(found, spread, arc, False, _noise(a, b, found))


def _rounds(
    u1: Array, u2: Array, start: Ellipse | None
) -> tuple[Ellipse, tuple[float, float, float, float, float]]:
    kind = sample_kind(u1, u2)
    if kind not in (ConicKind.ELLIPSE, ConicKind.SCATTERED):
        raise _no_ellipse(kind)
    # each signal by its own amplitude: the fit is the same, its condition is not
    scale = np.array([0.5 * np.ptp(u1), 0.5 * np.ptp(u2)])
    unit = np.array([scale[0], scale[1], scale[0] / scale[1], 1.0, scale[0]])
    if start is None:
        middle = np.array([0.5 * (u1.max() + u1.min()), 0.5 * (u2.max() + u2.min())])
    else:
        middle = np.array([start.offset_1, start.offset_2])
    for _ in range(_ROUNDS):
        x, y = (u1 - middle[0]) / scale[0], (u2 - middle[1]) / scale[1]
        theta, covariance = _conic(x, y)
        found = _coefficients(theta)
        middle = middle + scale * found[:2]
    J = unit[:, None] * _slopes(theta)
    sigma = np.sqrt(np.maximum(np.diag(J @ covariance @ J.T), 0.0))
    ratio, skew, radius = (unit * found)[2:]
    p, q, r, a, R = map(float, sigma)
    return (
        Ellipse(float(middle[0]), float(middle[1]), float(ratio), float(skew), float(radius)),
        (p, q, r, a, R),
    )


def _conic(x: Array, y: Array) -> tuple[Array, Array]:
    """Coefficients A to E and their covariance."""
    columns = np.stack([x * x, y * y, x * y, x, y], axis=1)
    Q, R = np.linalg.qr(columns)
    size = np.abs(np.diag(R))
    if size.min() < 1e-12 * size.max():
        # the equation's constant is then zero, not one; no whole ellipse does that
        raise UnusableInput(
            "quadrature: the samples pass through the middle of what they span; too short an arc"
        )
    theta = np.linalg.solve(R, Q.T @ np.ones(x.size))
    rest = columns @ theta - 1.0
    inverse = np.linalg.inv(R)
    return theta, inverse @ inverse.T * float(rest @ rest) / max(x.size - 5, 1)


def _coefficients(theta: Array) -> Array:
    """p, q, r, a, R of the conic."""
    A, B, C, D, E = theta
    kind = form_kind(A, B, C)
    if kind is not ConicKind.ELLIPSE:
        raise _no_ellipse(kind)
    below = C * C - 4.0 * A * B
    p, q = (2.0 * B * D - E * C) / below, (2.0 * A * E - D * C) / below
    skew = np.arcsin(np.sign(A) * C / np.sqrt(4.0 * A * B))
    held = 1.0 + A * p * p + B * q * q + C * p * q
    if held / A <= 0.0:
        raise UnusableInput(
            "quadrature: the fitted ellipse is imaginary; too short an arc or noise"
        )
    return np.array([p, q, np.sqrt(B / A), skew, np.sqrt(held / A) / np.cos(skew)])


def _no_ellipse(kind: ConicKind) -> UnusableInput:
    if kind is ConicKind.STILL:
        return UnusableInput(f"quadrature: {kind.value}, so there is no ellipse to fit")
    return UnusableInput(
        f"quadrature: {kind.value}, not on an ellipse; too short an arc, too much noise, or no "
        "pair of quadrature signals"
    )


def _slopes(theta: Array) -> Array:
    """Return the derivative of the coefficients by A to E."""
    columns = []
    for k in range(5):
        e = np.zeros(5)
        e[k] = 1e-6 * max(abs(theta[k]), 1e-2 * float(np.abs(theta).max()))
        columns.append((_coefficients(theta + e) - _coefficients(theta - e)) / (2.0 * e[k]))
    return np.stack(columns, axis=1)


def _signals(u1: ArrayLike, u2: ArrayLike) -> tuple[Array, Array]:
    a, b = np.asarray(u1, dtype=np.float64), np.asarray(u2, dtype=np.float64)
    if a.ndim != 1 or a.shape != b.shape or a.size < 6:
        raise UnusableInput(f"quadrature: signals of shape {a.shape} and {b.shape}; give 6 or more")
    if not (np.isfinite(a).all() and np.isfinite(b).all()):
        raise UnusableInput("quadrature: a signal is not finite; cut the record before that sample")
    return a, b


def _arc(u1: Array, u2: Array, ellipse: Ellipse) -> float:
    phase, _ = unwrap(quadrature_phase(*ellipse.circle(u1, u2)))
    return float(np.ptp(phase)) / (2.0 * np.pi)


def _noise(u1: Array, u2: Array, ellipse: Ellipse) -> float:
    return float(np.std(ellipse.level(u1, u2)))
