"""From a measured impedance to the equivalent circuit: start from peaks, then least squares."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from typing import Any, final

import numpy as np
from numpy.typing import ArrayLike

from actuators.materials.equivalent_circuit import Branch, ComplexArray, EquivalentCircuit
from bondgraph.support.errors import BondsightError, UnusableInput
from bondgraph.support.ops import FloatArray

_PROMINENCE = 8.0  # standard deviations of the scatter between neighbouring samples
_QUALITY_STEPS = (1.0, 0.3, 3.0, 10.0)
_LEAST_CERTAIN = 0.5  # relative uncertainty from which a mode counts as not seen


class NoResonance(BondsightError, ValueError):
    """An impedance sweep does not contain the resonances that are to be fitted."""


@final
@dataclass(frozen=True)
class CircuitFit:
    """A fitted circuit with what the data say about it.

    Attributes
    ----------
    circuit : EquivalentCircuit
    errors : dict of str to float
        Standard error of ``C_0``, ``L_1``, ``R_1``, ``C_1``, ... (SI) and ``f_1``, ... (Hz).
    names : tuple of str
        Rows and columns of `covariance`.
    covariance : ndarray, shape (1 + 3 n, 1 + 3 n)
        Of the logarithms of ``C_0``, ``L_1``, ``R_1``, ``C_1``, ...
    misfit : float
        Root mean square of the residual over both parts of Z: relative, or in units of `sigma`.
    """

    circuit: EquivalentCircuit
    errors: dict[str, float]
    names: tuple[str, ...]
    covariance: FloatArray
    misfit: float

    def __str__(self) -> str:
        """Return the elements one a line, with standard errors."""
        values = element_values(self.circuit)
        lines = [f"{n} = {values[n]:.6g} +- {self.errors[n]:.2g} {u}" for n, u in _units(values)]
        return "\n".join([*lines, f"misfit {self.misfit:.3g}"])


def element_values(circuit: EquivalentCircuit) -> dict[str, float]:
    """Return the elements by name: ``C_0``, then ``L_n``, ``R_n``, ``C_n``, ``f_n`` (SI)."""
    values = {"C_0": circuit.capacitance}
    for n, b in enumerate(circuit.branches, start=1):
        values |= {f"L_{n}": b.inductance, f"R_{n}": b.resistance, f"C_{n}": b.capacitance}
        values |= {f"f_{n}": b.resonance}
    return values


def _units(values: dict[str, float]) -> list[tuple[str, str]]:
    units = {"C": "F", "L": "H", "R": "ohm", "f": "Hz"}
    return [(n, units[n[0]]) for n in values]


def fit_circuit(
    frequency: ArrayLike, impedance: ArrayLike, *, modes: int = 1, sigma: ArrayLike | None = None
) -> CircuitFit:
    """Fit ``C_0`` and `modes` branches to an impedance sweep.

    Parameters
    ----------
    frequency : array, shape (N,), Hz
        Positive, rising; it must contain the resonances.
    impedance : array, shape (N,), ohm
        Complex.
    modes : int
        How many of the strongest modes to fit.
    sigma : float or array, shape (N,), ohm, optional
        Standard deviation of each part of Z. Left out, the noise is taken as relative: the
        residual is ``log(Z_model/Z)``, magnitude and phase.

    Raises
    ------
    UnusableInput
        The data have the wrong shape, order or too few points.
    NoResonance
        The sweep contains fewer resonances than asked for; says where it should go on.

    Notes
    -----
    Peaks of the conductance, above the scatter of neighbouring samples, give the series
    resonances and, by their half width, the quality factors. The fit is in logarithms, so every
    element stays positive; the derivatives are exact.
    """
    f, z = _checked(frequency, impedance, modes)
    s = None if sigma is None else np.broadcast_to(np.asarray(sigma, dtype=np.float64), f.shape)
    if s is not None and not (np.isfinite(s) & (s > 0)).all():
        raise UnusableInput("impedance sweep: sigma must be positive and finite, in ohm")
    found = _best_fit(f, z, s, _start(f, z, modes))
    return _result(f, found, modes)


def _checked(
    frequency: ArrayLike, impedance: ArrayLike, modes: int
) -> tuple[FloatArray, ComplexArray]:
    f, z = np.asarray(frequency), np.asarray(impedance)
    if f.ndim != 1 or f.shape != z.shape:
        raise UnusableInput(
            f"impedance sweep: frequency has shape {f.shape}, impedance {z.shape}; give two "
            "records of one length"
        )
    if modes < 1:
        raise UnusableInput(f"impedance sweep: modes = {modes}; fit at least one")
    if f.size < 6 * modes + 4:
        raise UnusableInput(
            f"impedance sweep: {f.size} points cannot carry {modes} modes; give at least "
            f"{6 * modes + 4}"
        )
    if not np.iscomplexobj(z):
        raise UnusableInput("impedance sweep: the impedance is real; give complex Z, not |Z|")
    if not (np.isfinite(f).all() and np.isfinite(z).all()) or (np.abs(z) == 0).any():
        raise UnusableInput("impedance sweep: a value is zero or not finite; leave it out")
    if f[0] <= 0 or (np.diff(f) <= 0).any():
        raise UnusableInput("impedance sweep: frequencies must be positive and rise; sort them")
    return f.astype(np.float64), z.astype(np.complex128)


def _start(f: FloatArray, z: ComplexArray, modes: int) -> FloatArray:
    """Logarithms of ``C_0`` and, for each mode, of w, R, C; shape (1 + 3 n,)."""
    from scipy.signal import find_peaks, peak_widths

    y = 1 / z
    g = y.real
    # relative to |Y|, for the noise of an analyser grows with its reading
    loss = g / np.abs(y)
    scatter = 1.4826 * float(np.median(np.abs(np.diff(loss, 2)))) / np.sqrt(6)
    floor = max(_PROMINENCE * scatter, 1e-9) * np.abs(y)
    peaks, about = find_peaks(g, prominence=floor)
    if peaks.size < modes:
        raise NoResonance(_advice(f, loss, scatter, int(peaks.size), modes))
    peaks = np.sort(peaks[np.argsort(-about["prominences"])[:modes]])
    _, _, left, right = peak_widths(g, peaks, rel_height=0.5)
    index = np.arange(f.size)
    width = np.maximum(np.interp(right, index, f) - np.interp(left, index, f), 1e-6 * f[peaks])
    omega, r = 2 * pi * f[peaks], 1 / g[peaks]
    c = width / f[peaks] / (omega * r)  # 1/(Q w R)
    rest = y.imag / (2 * pi * f)
    for w, resistance, cap in zip(omega, r, c, strict=True):
        b = Branch(float(1 / (w**2 * cap)), float(resistance), float(cap))
        rest = rest - (1 / b.impedance(f)).imag / (2 * pi * f)
    c_0 = float(np.median(rest))
    if c_0 <= 0:
        c_0 = float(np.median(np.abs(y.imag) / (2 * pi * f)))
    return np.log([c_0, *np.stack([omega, r, c], axis=1).ravel()])


def _advice(f: FloatArray, loss: FloatArray, scatter: float, found: int, wanted: int) -> str:
    tenth = max(3, f.size // 10)
    low, high = float(np.median(loss[:tenth])), float(np.median(loss[-tenth:]))
    seen = 5 * scatter / np.sqrt(tenth)
    if low > max(2 * high, seen):
        hint = f"the conductance rises towards {f[0]:.4g} Hz; sweep further down"
    elif high > max(2 * low, seen):
        hint = f"the conductance rises towards {f[-1]:.4g} Hz; sweep further up"
    else:
        hint = "widen the sweep, take more points around the resonance, or average more"
    return (
        f"impedance sweep of {f[0]:.4g} to {f[-1]:.4g} Hz shows {found} of {wanted} resonances "
        f"(peaks of the conductance above its scatter): {hint}"
    )


def _circuit(theta: FloatArray) -> EquivalentCircuit:
    c_0, *rest = np.exp(theta).tolist()
    triples = zip(rest[::3], rest[1::3], rest[2::3], strict=True)
    return EquivalentCircuit(c_0, tuple(Branch(1 / (w * w * c), r, c) for w, r, c in triples))


def _model(theta: FloatArray, f: FloatArray) -> tuple[ComplexArray, ComplexArray]:
    """Return Y, shape (N,), and its derivatives by `theta`, shape (N, n)."""
    s = 2j * pi * f
    c_0 = np.exp(theta[0])
    columns = [s * c_0]
    y = s * c_0
    for i in range(1, theta.size, 3):
        w, r, c = np.exp(theta[i : i + 3])
        inertia, spring = s / (w * w * c), 1 / (s * c)
        branch = inertia + r + spring
        y = y + 1 / branch
        columns += [2 * inertia / branch**2, -r / branch**2, (inertia + spring) / branch**2]
    return y, np.stack(columns, axis=1)


def _best_fit(f: FloatArray, z: ComplexArray, sigma: FloatArray | None, start: FloatArray) -> Any:
    """Fit from several quality factors: half widths of narrow or noisy peaks mislead."""
    from scipy.optimize import least_squares

    def residual(theta: FloatArray) -> FloatArray:
        y, _ = _model(theta, f)
        e = -np.log(y * z) if sigma is None else (1 / y - z) / sigma
        return np.concatenate([e.real, e.imag])

    def jacobian(theta: FloatArray) -> FloatArray:
        y, dy = _model(theta, f)
        de = -dy / y[:, None] if sigma is None else -dy / (y**2 * sigma)[:, None]
        return np.concatenate([de.real, de.imag])

    # start values from peaks are right within decades; the walls keep exp() from overflowing
    wall = np.full(start.size, 12.0)
    wall[1::3] = 1.0
    best = None
    for factor in _QUALITY_STEPS:
        theta = start.copy()
        theta[3::3] -= np.log(factor)  # Q = 1/(w R C)
        run = least_squares(
            residual, theta, jacobian, bounds=(start - wall, start + wall),
            x_scale="jac", xtol=1e-14, ftol=1e-14, gtol=1e-14, max_nfev=300,
        )  # fmt: skip
        if best is None or run.cost < best.cost:
            best = run
    return best


def _result(f: FloatArray, found: Any, modes: int) -> CircuitFit:
    theta = found.x
    freedom = found.fun.size - theta.size
    variance = 2 * found.cost / freedom
    _, size, vt = np.linalg.svd(found.jac, full_matrices=False)
    size = np.maximum(size, 1e-12 * size[0])
    covariance = variance * (vt.T / size**2) @ vt
    order = [0, *(1 + 3 * i + j for i in np.argsort(theta[1::3]) for j in range(3))]
    theta, covariance = theta[order], covariance[np.ix_(order, order)]
    for n in range(modes):
        _require_seen(f, theta, covariance, n)
    circuit = _circuit(theta)
    # log L = -2 log w - log C
    turn = np.eye(theta.size)
    for i in range(1, theta.size, 3):
        turn[i, i], turn[i, i + 2] = -2.0, -1.0
    logs = turn @ covariance @ turn.T
    values = element_values(circuit)
    names = tuple(n for n in values if n[0] != "f")
    spread = dict(zip(names, np.sqrt(np.diag(logs)), strict=True))
    spread |= {f"f_{n + 1}": np.sqrt(covariance[1 + 3 * n, 1 + 3 * n]) for n in range(modes)}
    errors = {n: float(v * spread[n]) for n, v in values.items()}
    return CircuitFit(circuit, errors, names, logs, float(np.sqrt(np.mean(found.fun**2))))


def _require_seen(f: FloatArray, theta: FloatArray, covariance: FloatArray, n: int) -> None:
    i = 1 + 3 * n
    at = float(np.exp(theta[i]) / (2 * pi))
    worst = float(np.sqrt(np.diag(covariance)[i + 1 : i + 3].max()))
    if not f[0] < at < f[-1]:
        where = "down" if at <= f[0] else "up"
        raise NoResonance(
            f"impedance sweep of {f[0]:.4g} to {f[-1]:.4g} Hz: mode {n + 1} was found at "
            f"{at:.4g} Hz, outside; sweep further {where}"
        )
    if worst > _LEAST_CERTAIN:
        raise NoResonance(
            f"impedance sweep: mode {n + 1} at {at:.4g} Hz is uncertain by {100 * worst:.0f} %; "
            "fit fewer modes or take more points around it"
        )
