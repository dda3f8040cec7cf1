"""A first modal model of the steering mirror from its measured frequency response.

Sizes: K lines, 3 actuators, 3 sensors, P pairs of poles.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tests.proof.published.mirror_layout import DELAY, OMEGA, Layout
from tests.proof.published.mirror_lines import ComplexArray, FloatArray, Lines, Spectra

SLENDER = (0.003, 0.1)
"""Damping ratios of poles that are taken for modes; others fill gaps of the rational fit."""

LOOP = 0.3
"""First guess of ``theta psi`` summed over the actuators of a mode."""


def response(data: Sequence[Spectra]) -> ComplexArray:
    """Best linear approximation, shape (K, 3, 3), by weighted least squares over realisations."""
    left = sum(np.einsum("ok,ok,ik->koi", e.y, e.weight, e.u.conj()) for e in data)
    made = np.empty_like(np.asarray(left))
    for o in range(3):
        right = sum(np.einsum("jk,k,ik->kji", e.u, e.weight[o], e.u.conj()) for e in data)
        made[:, o] = np.linalg.solve(np.swapaxes(np.asarray(right), 1, 2), left[:, o, :, None])[
            :, :, 0
        ]
    return made


def _fractions(s: ComplexArray, poles: ComplexArray) -> ComplexArray:
    """Partial fractions with real coefficients, shape (K, 2 P)."""
    first, second = 1.0 / (s[:, None] - poles), 1.0 / (s[:, None] - poles.conj())
    made = np.stack((first + second, 1j * (first - second)), axis=2)
    return made.reshape(s.size, -1)


def vector_fit(
    s: ComplexArray, h: ComplexArray, weight: FloatArray, poles: ComplexArray, sweeps: int = 20
) -> tuple[ComplexArray, FloatArray]:
    """Fit common poles to several responses (vector fitting).

    Parameters
    ----------
    s : ndarray, shape (K,), rad/s
    h, weight : ndarray, shape (K, n)
    poles : ndarray, shape (P,)
        First guess, upper half plane, rad/s.

    Returns
    -------
    poles : ndarray, shape (P,)
        Stable: a pole that leaves the left half plane is reflected.
    coefficients : ndarray, shape (2 P + 1, n)
        Of the real partial fractions, and a constant.

    References
    ----------
    B. Gustavsen, A. Semlyen, Rational approximation of frequency domain responses by vector
    fitting, IEEE Trans. Power Delivery 14 (1999) 1052; D. Deschrijver et al., fast version, 2008.
    """
    unit = float(np.abs(s).max())
    s, poles = s / unit, poles / unit
    for _ in range(sweeps):
        basis = _fractions(s, poles)
        n = basis.shape[1]
        own = np.column_stack((basis, np.ones(s.size)))
        rows = []
        for c in range(h.shape[1]):
            block = np.column_stack((own, -basis * h[:, c, None], h[:, c])) * weight[:, c, None]
            upper = np.asarray(np.linalg.qr(np.concatenate((block.real, block.imag)), mode="r"))
            rows.append(upper[n + 1 : 2 * n + 1, n + 1 :])
        stacked = np.concatenate(rows)
        size = np.linalg.norm(stacked[:, :-1], axis=0)
        sigma = np.linalg.lstsq(stacked[:, :-1] / size, stacked[:, -1], rcond=None)[0] / size
        real, drive = np.zeros((n, n)), np.zeros(n)
        for k, pole in enumerate(poles):
            real[2 * k : 2 * k + 2, 2 * k : 2 * k + 2] = [
                [pole.real, pole.imag],
                [-pole.imag, pole.real],
            ]
            drive[2 * k] = 2.0
        found = np.asarray(np.linalg.eigvals(real - np.outer(drive, sigma)), complex)
        found = found[found.imag > 1e-9]
        lost = poles[found.size :] if found.size < poles.size else poles[:0]
        found = np.concatenate((-np.abs(found.real) + 1j * found.imag, lost))
        poles = found[np.argsort(found.imag)]
    last = np.column_stack((_fractions(s, poles), np.ones(s.size)))
    coefficients = np.empty((last.shape[1], h.shape[1]))
    for c in range(h.shape[1]):
        table, right = last * weight[:, c, None], h[:, c] * weight[:, c]
        coefficients[:, c] = np.linalg.lstsq(
            np.concatenate((table.real, table.imag)),
            np.concatenate((right.real, right.imag)),
            rcond=None,
        )[0]
    coefficients[:-1] *= unit
    return poles * unit, coefficients


def first_modes(data: Sequence[Spectra], lines: Lines, pairs: int, terms: int) -> tuple[
    Layout, FloatArray
]:  # fmt: skip
    """Return modes with real shapes and a common dead time, from a rational fit of the response."""
    s, h = lines.s, response(data).reshape(lines.count, 9)
    weight = np.sqrt(np.mean([e.weight for e in data], 0)).T.repeat(3, axis=1)
    span = np.linspace(0.5 / 3.0, 1.03, pairs) * np.abs(s[-1])
    poles, coefficients = vector_fit(s, h, weight, (-0.01 + 1j) * span)
    ratio = -poles.real / np.abs(poles)
    kept = (ratio > SLENDER[0]) & (ratio < SLENDER[1])
    residues = (coefficients[0:-1:2] + 1j * coefficients[1:-1:2])[kept]
    poles = poles[kept]
    # a mode with real shapes has an imaginary residue; a dead time turns it
    trials = np.linspace(0.0, 3e-4, 301)
    turned = residues * np.exp(1j * trials[:, None, None] * poles.imag[:, None])
    late = trials[np.argmax((np.abs(turned.imag) ** 2).sum((1, 2)))]
    shapes = (residues * np.exp(1j * late * poles.imag[:, None]) * 2j / np.abs(poles)[:, None]).real
    layout = Layout(poles.size, (), terms)
    p = np.zeros(layout.size)
    p[layout.at["late_in"]] = late / DELAY
    for m, (pole, shape) in enumerate(zip(poles, shapes, strict=True)):
        _put_mode(layout, p, m, abs(pole), -pole.real / abs(pole), shape.reshape(3, 3))
    return layout, p


def _put_mode(
    layout: Layout, p: FloatArray, m: int, omega: float, zeta: float, shape: FloatArray
) -> None:
    """Write a mode with the nearest shape of rank one into the vector."""
    left, size, right = np.linalg.svd(shape)
    psi, phi = right[0] * np.sqrt(size[0]), left[:, 0] * np.sqrt(size[0])
    at = layout.at
    p[at["log_omega"][m]], p[at["log_zeta"][m]] = np.log(omega / OMEGA), np.log(zeta)
    p[at["psi"][m]], p[at["phi"][m]] = psi, phi
    p[at["log_stiffness"][m]] = np.log(LOOP / (psi @ psi))


def add_mode(
    layout: Layout, p: FloatArray, left: ComplexArray, weight: FloatArray, lines: Lines
) -> tuple[Layout, FloatArray]:
    """Add the mode that explains most of what is left of the response, as a fit weighs it.

    Parameters
    ----------
    left : ndarray, shape (K, 3, 3), um/V
        Response less that of the model, dead time taken out.
    weight : ndarray, shape (3, K)
        Of the squares of each sensor.
    """
    root = np.concatenate((np.sqrt(weight), np.sqrt(weight)), 1)[:, :, None]
    right = root * np.concatenate((left.real, left.imag)).transpose(1, 0, 2)
    flat = np.concatenate((np.ones(lines.count), np.zeros(lines.count)))
    top = float(np.abs(lines.s[-1]))
    best: tuple[float, float, float, FloatArray] | None = None
    for omega in np.append(np.arange(1.0 / 6.0, 1.0, 1.0 / 300.0), (1.03, 1.08, 1.17)) * top:
        for zeta in (0.01, 0.03, 0.1):
            z = 1.0 / ((lines.s / omega) ** 2 + 2.0 * zeta * lines.s / omega + 1.0)
            basis = root * np.column_stack((np.concatenate((z.real, z.imag)), flat))
            turned = basis.transpose(0, 2, 1)
            found = np.linalg.solve(turned @ basis, turned @ right)  # sensor by sensor
            explained = float((turned @ right * found).sum())
            if best is None or explained > best[0]:
                best = (explained, float(omega), zeta, found[:, 0])
    assert best is not None
    wider = Layout(layout.modes + 1, layout.pairs, layout.terms)
    made = layout.moved(p, wider)
    _put_mode(wider, made, layout.modes, *best[1:])
    return wider, made
