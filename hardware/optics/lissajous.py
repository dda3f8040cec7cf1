"""Whether the figure of sine and cosine is a circle, and how far off a count from it is.

The stack actuator thesis (section 4.2.2) calibrates its interferometer so: the reference mirror
vibrates, the two signals are shown against each other, and head and object are turned until they
make "a thin closed circle".
"""

from __future__ import annotations

from dataclasses import dataclass
from math import degrees

import numpy as np
from numpy.typing import ArrayLike

from bondgraph.support.arrays import FloatArray as Array
from hardware.optics.ellipse import Ellipse, EllipseFit, fit_ellipse
from hardware.optics.phase import quadrature_phase
from hardware.optics.refraction import HELIUM_NEON

THIN = 0.05
"""Rms of the radius about the ellipse, by the radius, up to which a figure counts as thin."""
CLOSED = 15.0
"""Widest gap (degrees) without a sample up to which it counts as closed."""


@dataclass(frozen=True, slots=True, eq=False)
class Lissajous:
    """The figure of two quadrature signals.

    Attributes
    ----------
    fit : EllipseFit
    gap : float
        Widest angle without a sample (rad).
    before, after : float
        Periodic error of a displacement, peak to peak (m): counted from the raw signals, and what
        the noise of the figure leaves (rms) with the ellipse taken out.
    cosine, sine : ndarray
        (n,) raw signals.
    """

    fit: EllipseFit
    gap: float
    before: float
    after: float
    cosine: Array
    sine: Array

    @property
    def sentences(self) -> tuple[str, ...]:
        """What it is like, and what to turn."""
        e, f = self.fit.ellipse, self.fit
        said = [
            f"ellipse: offsets {e.offset_1 / e.radius:.2%} and {e.offset_2 / e.radius:.2%} of the "
            f"radius {e.radius:.4g}, ratio {e.ratio:.4g}, {degrees(e.skew):.3g} deg off quadrature",
            f"periodic error {1e9 * self.before:.2g} nm peak to peak as counted; "
            f"{1e9 * self.after:.2g} nm rms is left with the ellipse taken out",
        ]
        if degrees(self.gap) > CLOSED:
            said.append(
                f"not closed: {degrees(self.gap):.0f} deg have no sample; align the object, or "
                "raise the amplitude of the reference mirror (module RG-10), or move further"
            )
        if f.noise > THIN:
            said.append(
                f"not thin: the radius scatters by {f.noise:.1%}; align head and object until more "
                "light comes back, and keep vibration away"
            )
        return tuple(said)

    @property
    def good(self) -> bool:
        """Whether it is a thin closed circle, but for what the ellipse takes out."""
        return degrees(self.gap) <= CLOSED and self.fit.noise <= THIN


def lissajous(cosine: ArrayLike, sine: ArrayLike, wavelength: float = HELIUM_NEON) -> Lissajous:
    """Look at the figure of two signals (n,).

    Raises
    ------
    UnusableInput
        Too short an arc, or no ellipse at all.
    """
    u1, u2 = np.asarray(cosine, dtype=np.float64), np.asarray(sine, dtype=np.float64)
    fit = fit_ellipse(u1, u2)
    angles = np.sort(quadrature_phase(*fit.ellipse.circle(u1, u2)))
    gap = float(np.max(np.diff(np.append(angles, angles[0] + 2.0 * np.pi))))
    unit = wavelength / (4.0 * np.pi)
    return Lissajous(fit, gap, unit * periodic_error(fit.ellipse), unit * fit.noise, u1, u2)


def periodic_error(ellipse: Ellipse) -> float:
    """Error of the phase taken from the raw signals as they are (rad, peak to peak).

    Examples
    --------
    >>> periodic_error(Ellipse())
    0.0
    >>> round(periodic_error(Ellipse(offset_1=0.04)), 3)
    0.08
    """
    phase = np.linspace(0.0, 2.0 * np.pi, 721)
    off = quadrature_phase(*ellipse.signals(phase)) - phase
    wrapped = np.arctan2(np.sin(off), np.cos(off))
    return float(np.round(np.ptp(wrapped), 12))
