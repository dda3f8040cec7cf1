"""From raw quadrature to displacement, chunk by chunk, with the ellipse taken out."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bondgraph.support.arrays import FloatArray as Array
from bondgraph.support.errors import UnusableInput
from hardware.contracts import Flag
from hardware.optics.beam import BeamState, BeamWatch, watch_beam
from hardware.optics.ellipse import Ellipse
from hardware.optics.phase import quadrature_phase, unwrap
from hardware.optics.refraction import HELIUM_NEON


def displacement_of_phase(phase: ArrayLike, wavelength: float, index: ArrayLike = 1.0) -> Array:
    """``phase lambda / (4 pi n)`` (m): one turn is half a wavelength in air."""
    n = np.asarray(index, dtype=np.float64)
    return np.asarray(np.asarray(phase, dtype=np.float64) * wavelength / (4.0 * np.pi * n))


@dataclass(frozen=True, slots=True, eq=False)
class Demodulated:
    """One chunk of displacement.

    Parameters
    ----------
    position : ndarray
        ``(n,)``, m, from the first sample of the record.
    level : ndarray
        ``(n,)``, amplitude by that of the ellipse.
    flags : ndarray
        ``(n,)``, uint16: `LEVEL_LOW` and, from the first lost sample on, `BEAM_LOST`.
    """

    position: Array
    level: Array
    flags: NDArray[np.uint16]


@dataclass(frozen=True, slots=True)
class Demodulator:
    """Frozen state between two chunks.

    Parameters
    ----------
    ellipse : Ellipse
        Coefficients, frozen for the whole record.
    wavelength : float
        In vacuum (m).
    index : float
        Refraction index.
    beam : BeamWatch
        When light is too little.
    first, last : float or None
        First and last unwrapped phase (rad).
    seen : BeamState
        What the beam went through.
    """

    ellipse: Ellipse
    wavelength: float = HELIUM_NEON
    index: float = 1.0
    beam: BeamWatch = field(default_factory=BeamWatch)
    first: float | None = None
    last: float | None = None
    seen: BeamState = field(default_factory=BeamState)

    def feed(self, u1: ArrayLike, u2: ArrayLike) -> tuple[Demodulated, Demodulator]:
        """Demodulate the next chunk.

        Parameters
        ----------
        u1, u2 : array_like
            ``(n,)`` raw signals. A sample that is not finite counts as lost light and holds the
            phase before it.

        Returns
        -------
        chunk : Demodulated
        following : Demodulator
            For the next chunk; the results do not depend on where the record was cut.
        """
        a, b = np.asarray(u1, dtype=np.float64), np.asarray(u2, dtype=np.float64)
        if a.ndim != 1 or a.shape != b.shape:
            raise UnusableInput(f"quadrature: signals of shape {a.shape} and {b.shape}; give (n,)")
        cosine, sine = self.ellipse.circle(a, b)
        level = np.nan_to_num(np.hypot(cosine, sine) / self.ellipse.radius, nan=0.0, posinf=0.0)
        phase = _held(quadrature_phase(cosine, sine), np.isfinite(a) & np.isfinite(b), self.last)
        phase, last = unwrap(phase, self.last)
        first = self.first if self.first is not None or phase.size == 0 else float(phase[0])
        flags, seen = watch_beam(level, self.beam, self.seen)
        position = displacement_of_phase(phase - (first or 0.0), self.wavelength, self.index)
        following = replace(self, first=first, last=last, seen=seen)
        return Demodulated(position, level, flags), following


def quadrature_displacement(
    u1: ArrayLike,
    u2: ArrayLike,
    ellipse: Ellipse,
    wavelength: float = HELIUM_NEON,
    index: float = 1.0,
) -> Array:
    """Displacement (m) of a whole record from its first sample; see `Demodulator`.

    Raises
    ------
    UnusableInput
        Light was lost on the way, so that the rest is off by unknown fringes.
    """
    result, _ = Demodulator(ellipse, wavelength, index).feed(u1, u2)
    lost = np.flatnonzero(result.flags & int(Flag.BEAM_LOST))
    if lost.size:
        raise UnusableInput(
            f"quadrature: no light at sample {lost[0]} of {result.level.size}; cut the record "
            "there or use Demodulator, which flags the rest"
        )
    return result.position


def _held(phase: Array, good: NDArray[np.bool_], last: float | None) -> Array:
    """Phase with unusable samples replaced by the last usable one before."""
    if good.all():
        return phase
    held = np.maximum.accumulate(np.where(good, np.arange(phase.size), -1))
    # a phase carried in from the chunk before may be many turns; unwrap takes it as it is
    start = 0.0 if last is None else last
    return np.asarray(np.where(held >= 0, phase[np.maximum(held, 0)], start))
