"""Frequencies of a mode, and the coupling and quality factors that follow from them.

With losses the extremes of ``|Z|`` and the zeros of its phase lie beside the resonance and the
antiresonance of the lossless circuit (stack actuator thesis, fig. 2.6; IEEE Std 176 and 177).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi, sqrt, tan
from typing import final

import numpy as np

from actuators.materials.equivalent_circuit import EquivalentCircuit
from bondgraph.support.errors import UnusableInput

_GRID = 4001


@final
@dataclass(frozen=True, slots=True)
class CharacteristicFrequencies:
    """The six frequencies of a mode (IEEE Std 177), Hz.

    Attributes
    ----------
    minimum, maximum : float
        Of ``|Z|``.
    series, parallel : float
        Of the lossless circuit.
    resonance, antiresonance : float or None
        Zeros of the phase; None if damping keeps the phase from zero.
    """

    minimum: float
    series: float
    resonance: float | None
    antiresonance: float | None
    parallel: float
    maximum: float


def characteristic_frequencies(
    circuit: EquivalentCircuit, mode: int = 0
) -> CharacteristicFrequencies:
    """Return the frequencies of one mode; losses part them in the order of the fields.

    Parameters
    ----------
    circuit : EquivalentCircuit
    mode : int
        0 is the lowest.

    Raises
    ------
    UnusableInput
        There is no such mode, or damping leaves ``|Z|`` without a minimum or maximum.
    """
    n = len(circuit.branches)
    if not 0 <= mode < n:
        raise UnusableInput(f"circuit: mode {mode} does not exist; it has modes 0 to {n - 1}")
    f_s, f_p = circuit.resonances, circuit.antiresonances
    low = f_p[mode - 1] if mode else f_s[0] / 3
    high = f_s[mode + 1] if mode + 1 < n else 3 * f_p[-1]
    f_m = _extreme(circuit, low, f_s[mode], f_p[mode], 1)
    f_n = _extreme(circuit, f_m, f_p[mode], high, -1)
    return CharacteristicFrequencies(
        f_m, f_s[mode], *_zero_phase(circuit, f_m, f_n), f_p[mode], f_n
    )


def _extreme(circuit: EquivalentCircuit, low: float, at: float, high: float, sign: int) -> float:
    """Find the minimum of ``sign |Z|`` in the interval, on a grid that is dense around `at`."""
    from scipy.optimize import minimize_scalar

    toward = np.geomspace(1e-9, 1, _GRID // 2)
    grid = np.unique(np.concatenate([at - (at - low) * toward, [at], at + (high - at) * toward]))
    grid = grid[(grid >= low) & (grid <= high)]
    i = int(np.argmin(sign * np.abs(circuit.impedance(grid))))
    if i in (0, grid.size - 1):
        what = "minimum" if sign > 0 else "maximum"
        raise UnusableInput(
            f"circuit: |Z| has no {what} near {at:.6g} Hz; the damping of the mode hides it"
        )
    found = minimize_scalar(
        lambda f: sign * float(np.log(np.abs(circuit.impedance(f)))),
        bounds=(grid[i - 1], grid[i + 1]),
        method="bounded",
        options={"xatol": 1e-10 * at},
    )
    return float(found.x)


def _zero_phase(
    circuit: EquivalentCircuit, low: float, high: float
) -> tuple[float | None, float | None]:
    """First and last zero of Im Z around the two extremes, for a phase that gets inductive."""
    from scipy.optimize import brentq

    def reactance(f: float) -> float:
        return float(circuit.impedance(f).imag)

    grid = np.linspace(low, high, _GRID)
    x = circuit.impedance(grid).imag
    inductive = np.flatnonzero(x > 0)
    if not inductive.size or inductive[0] == 0 or inductive[-1] == grid.size - 1:
        return None, None
    i, j = int(inductive[0]), int(inductive[-1])
    first = brentq(reactance, grid[i - 1], grid[i], rtol=1e-13)
    last = brentq(reactance, grid[j], grid[j + 1], rtol=1e-13)
    return float(first), float(last)


def _pair(f_r: float, f_a: float, largest: float = float("inf")) -> None:
    if not 0 < f_r < f_a < largest * f_r:
        limit = "" if largest == float("inf") else f" < {largest:g} f_r"
        raise UnusableInput(
            f"coupling: f_r = {f_r:g} Hz and f_a = {f_a:g} Hz; the formula needs "
            f"0 < f_r < f_a{limit}, check which is the minimum of |Z|"
        )


def effective_coupling(f_r: float, f_a: float) -> float:
    """Return ``k_eff = sqrt((f_a^2 - f_r^2)/f_a^2)`` of a mode; for one branch ``C/(C_0 + C)``.

    Examples
    --------
    >>> round(effective_coupling(80.0, 100.0), 12)
    0.6
    """
    _pair(f_r, f_a)
    return sqrt((f_a**2 - f_r**2) / f_a**2)


def longitudinal_coupling(f_r: float, f_a: float) -> float:
    """Return ``k33`` of a slender rod (or ``kt`` of a plate) from its lowest mode.

    ``k33^2 = (pi/2)(f_r/f_a) tan((pi/2)(f_a - f_r)/f_a)`` (IEEE Std 176): exact for a lossless rod
    with free ends and electrodes on them.
    """
    _pair(f_r, f_a)
    return sqrt(pi / 2 * f_r / f_a * tan(pi / 2 * (f_a - f_r) / f_a))


def transverse_coupling(f_r: float, f_a: float) -> float:
    """Return ``k31`` of a slender bar poled across, from its lowest mode.

    ``k31^2/(1 - k31^2) = (pi/2)(f_a/f_r) tan((pi/2)(f_a - f_r)/f_r)`` (IEEE Std 176).
    """
    _pair(f_r, f_a, 2.0)
    ratio = pi / 2 * f_a / f_r * tan(pi / 2 * (f_a - f_r) / f_r)
    return sqrt(ratio / (1 + ratio))


def mechanical_quality(f_r: float, f_a: float, least_impedance: float, capacitance: float) -> float:
    """Return ``Q = f_a^2/(2 pi f_r |Z|_min C (f_a^2 - f_r^2))`` (IEEE Std 176), for high Q.

    Parameters
    ----------
    f_r, f_a : float
        Minimum and maximum of ``|Z|``, Hz.
    least_impedance : float
        ``|Z|`` at `f_r`, ohm.
    capacitance : float
        Far below the mode (free), F.
    """
    _pair(f_r, f_a)
    if not (least_impedance > 0 and capacitance > 0):
        raise UnusableInput(
            f"quality: least_impedance = {least_impedance:g} ohm and capacitance = "
            f"{capacitance:g} F must be positive"
        )
    return f_a**2 / (2 * pi * f_r * least_impedance * capacitance * (f_a**2 - f_r**2))
