"""Catalogue of the effects that the bench can conceal, and their places.

An entry draws the dimensionless shape of its effect, then turns shape and amplitude into physical
parameters.  The amplitude is either sized by its mark on the outputs (see ``draw``) or, where
plausible values are all strong marks (delays, amplifier pole), drawn from a range per class.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from hardware.simulators.plant import BIAS, PlantParameters

STRENGTHS = ("weak", "medium", "strong")
NONE = "none"

RATIO_RANGES: Mapping[str, tuple[float, float]] = {
    "weak": (3.0, 8.0),
    "medium": (10.0, 30.0),
    "strong": (50.0, 150.0),
}
"""Promised rms deviation of the most touched output over its noise, per class.

More where other values of the plant's parameters would imitate it to below the noise (creep)."""

Parameters = dict[str, float]

# Scales that make amplitudes dimensionless; bench constants, not true parameters.
X_SCALE = 2.7e-6
"""Half range of displacement (m): 54 nm/V times 50 V."""
I_SCALE = 1.0
"""Range of the current probe (A)."""
_STRETCH = 1.0e-6
_SPEED = 0.02
_BRANCHES = 3
_STOPS = 6


@dataclass(frozen=True, slots=True)
class HiddenEffect:
    """One effect at one place.

    Parameters
    ----------
    name, place
        Entry of the catalogue, ``("none", "")`` for nothing.
    parameters
        ``(name, value)`` pairs, SI; delays in samples.
    """

    name: str = NONE
    place: str = ""
    parameters: tuple[tuple[str, float], ...] = ()

    def value(self, name: str) -> float:
        """Value of one parameter."""
        return dict(self.parameters)[name]

    def series(self, stem: str) -> tuple[float, ...]:
        """Values of ``stem_1, stem_2, ...`` in order."""
        table = dict(self.parameters)
        found: list[float] = []
        while f"{stem}_{len(found) + 1}" in table:
            found.append(table[f"{stem}_{len(found) + 1}"])
        return tuple(found)


@dataclass(frozen=True, slots=True)
class EffectEntry:
    """How an effect at a place is drawn.

    Parameters
    ----------
    name, place
        Identifiers.
    law
        Constitutive law as text.
    shape
        Draws the dimensionless shape.
    build
        Turns (shape, amplitude, plant) into parameters.
    first_guess
        Amplitude at which the search for the promised strength starts.
    classes
        Amplitude range per class instead of a search, or None.
    """

    name: str
    place: str
    law: str
    shape: Callable[[np.random.Generator], Parameters]
    build: Callable[[Parameters, float, PlantParameters], Parameters]
    first_guess: float = 0.05
    classes: Mapping[str, tuple[float, float]] | None = None

    def effect(self, shape: Parameters, amplitude: float, plant: PlantParameters) -> HiddenEffect:
        """Effect of this entry with the given shape and amplitude."""
        values = self.build(shape, amplitude, plant)
        return HiddenEffect(self.name, self.place, tuple(sorted(values.items())))


def _no_shape(rng: np.random.Generator) -> Parameters:
    return {}


def _stop_shape(rng: np.random.Generator) -> Parameters:
    """Slip limits spread over the stroke and uneven gains whose limit forces sum to one."""
    radii = np.linspace(0.08, 0.9, _STOPS) * rng.uniform(0.85, 1.15, _STOPS)
    forces = rng.dirichlet(np.full(_STOPS, 4.0))
    shape = {f"radius_{j}": float(r) for j, r in enumerate(radii, 1)}
    return shape | {f"force_{j}": float(f) for j, f in enumerate(forces, 1)}


def _stops(stroke: Callable[[PlantParameters], float], effort: Callable[[PlantParameters], float]):  # type: ignore[no-untyped-def]
    def build(shape: Parameters, a: float, p: PlantParameters) -> Parameters:
        out = {}
        for j in range(1, _STOPS + 1):
            radius = shape[f"radius_{j}"] * stroke(p)
            out[f"radius_{j}"] = radius
            out[f"gain_{j}"] = a * shape[f"force_{j}"] * effort(p) / radius
        return out

    return build


def _creep_shape(low: float, high: float) -> Callable[[np.random.Generator], Parameters]:
    def shape(rng: np.random.Generator) -> Parameters:
        taus = np.geomspace(low, high, _BRANCHES) * rng.uniform(0.8, 1.25, _BRANCHES)
        ratios = rng.dirichlet(np.full(_BRANCHES, 6.0))
        out = {f"ratio_{j}": float(r) for j, r in enumerate(ratios, 1)}
        return out | {f"tau_{j}": float(s) for j, s in enumerate(taus, 1)}

    return shape


def _creep(shape: Parameters, a: float, p: PlantParameters) -> Parameters:
    return {n: v * (a if n.startswith("ratio") else 1.0) for n, v in shape.items()}


def _angle_shape(rng: np.random.Generator) -> Parameters:
    """Mix of an even and an odd part, either sign."""
    angle = rng.uniform(0.0, 2.0 * math.pi)
    return {"even": math.cos(angle), "odd": math.sin(angle)}


def _dielectric(shape: Parameters, a: float, p: PlantParameters) -> Parameters:
    charge = p.C_q * BIAS
    return {
        "c2": a * shape["even"] * BIAS / charge**2,
        "c3": a * shape["odd"] * BIAS / charge**3,
    }


def _spring(shape: Parameters, a: float, p: PlantParameters) -> Parameters:
    return {
        "k2": a * shape["even"] * p.k / _STRETCH,
        "k3": a * shape["odd"] * p.k / _STRETCH**2,
    }


def _curve(scale: float) -> Callable[[Parameters, float, PlantParameters], Parameters]:
    def build(shape: Parameters, a: float, p: PlantParameters) -> Parameters:
        return {"s2": a * shape["even"] / scale, "s3": a * shape["odd"] / scale**2}

    return build


def _drift_shape(rng: np.random.Generator) -> Parameters:
    return {"linear": float(rng.choice([-1.0, 1.0])), "bow": float(rng.uniform(-0.8, 0.8))}


def _drift(scale: float) -> Callable[[Parameters, float, PlantParameters], Parameters]:
    def build(shape: Parameters, a: float, p: PlantParameters) -> Parameters:
        return {name: a * scale * value for name, value in shape.items()}

    return build


def _limits_shape(rng: np.random.Generator) -> Parameters:
    return {"slope": float(rng.uniform(0.0, 0.3)), "skew": float(rng.uniform(-0.1, 0.1))}


def _limits(shape: Parameters, a: float, p: PlantParameters) -> Parameters:
    """Limits move inwards with the amplitude, from where no command reaches them."""
    reach = 1.2 * BIAS * math.exp(-a)
    return {
        "top": BIAS + reach * (1.0 + shape["skew"]),
        "bottom": BIAS - reach * (1.0 - shape["skew"]),
        "slope": shape["slope"],
    }


def _single(name: str, scale: float = 1.0):  # type: ignore[no-untyped-def]
    def build(shape: Parameters, a: float, p: PlantParameters) -> Parameters:
        return {name: a * scale}

    return build


def _coulomb(shape: Parameters, a: float, p: PlantParameters) -> Parameters:
    return {"F_c": a * p.b * _SPEED}


def _stribeck_shape(rng: np.random.Generator) -> Parameters:
    return {"peak": float(rng.uniform(1.4, 2.2)), "v_s": float(rng.uniform(0.1, 0.4))}


def _stribeck(shape: Parameters, a: float, p: PlantParameters) -> Parameters:
    force = a * p.b * _SPEED
    return {"F_c": force, "F_s": shape["peak"] * force, "v_s": shape["v_s"] * _SPEED}


def _drag(shape: Parameters, a: float, p: PlantParameters) -> Parameters:
    return {"b2": a * p.b / _SPEED}


_LINE_DELAY = {"weak": (2.0, 3.5), "medium": (4.0, 7.0), "strong": (8.0, 12.0)}
_CHANNEL_DELAY = {"weak": (0.3, 1.0), "medium": (1.5, 4.0), "strong": (6.0, 12.0)}
_POLE = {"weak": (30e-6, 50e-6), "medium": (70e-6, 130e-6), "strong": (180e-6, 300e-6)}

_STOP_LAW = "+ sum g_j stop(r_j)"

CATALOGUE: tuple[EffectEntry, ...] = (
    EffectEntry(
        "hysteresis",
        "C_nl",
        f"V_C = q/C_q {_STOP_LAW}[q]",
        _stop_shape,
        _stops(lambda p: 35.0 * p.C_q, lambda p: BIAS),
    ),
    EffectEntry(
        "hysteresis",
        "k",
        f"F = k x1 {_STOP_LAW}[x1]",
        _stop_shape,
        _stops(lambda p: _STRETCH, lambda p: p.k * _STRETCH),
    ),
    EffectEntry(
        "creep",
        "C_nl",
        "V_C = (q - sum q_j)/C_q, tau_j q_j' = C_j V_C - q_j",
        _creep_shape(2e-3, 60e-3),
        _creep,
    ),
    EffectEntry(
        "creep",
        "k",
        "F = k (x1 - sum s_j), tau_j s_j' = F/k_j - s_j",
        _creep_shape(2e-4, 1e-2),
        _creep,
    ),
    EffectEntry("coulomb_friction", "b", "F_R = b v + F_c sgn v", _no_shape, _coulomb, 0.2),
    EffectEntry(
        "stribeck_friction",
        "b",
        "F_R = b v + (F_c + (F_s - F_c) exp(-(v/v_s)^2)) sgn v",
        _stribeck_shape,
        _stribeck,
        0.2,
    ),
    EffectEntry("quadratic_drag", "b", "F_R = b v + b2 v |v|", _no_shape, _drag, 0.2),
    EffectEntry("nonlinear_stiffness", "k", "F = k x1 + k2 x1^2 + k3 x1^3", _angle_shape, _spring),
    EffectEntry(
        "nonlinear_stiffness",
        "C_nl",
        "V_C = q/C_q + c2 r^2 + c3 r^3, r = q - C_q 50 V",
        _angle_shape,
        _dielectric,
    ),
    EffectEntry("saturation", "V_in", "knees at top and bottom", _limits_shape, _limits, 0.35),
    EffectEntry(
        "dead_zone",
        "V_in",
        "u = V - clip(V - 50 V, -d, d)",
        _no_shape,
        _single("width", BIAS),
        0.01,
    ),
    EffectEntry("low_pass", "V_in", "tau u' = V - u", _no_shape, _single("tau"), classes=_POLE),
    EffectEntry(
        "delay", "V_in", "u(t) = V(t - d Ts)", _no_shape, _single("samples"), classes=_LINE_DELAY
    ),
    EffectEntry(
        "delay", "x", "y(t) = x(t - d Ts)", _no_shape, _single("samples"), classes=_CHANNEL_DELAY
    ),
    EffectEntry(
        "delay", "i", "y(t) = i(t - d Ts)", _no_shape, _single("samples"), classes=_CHANNEL_DELAY
    ),
    EffectEntry("sensor_drift", "x", "linear + bow in time", _drift_shape, _drift(X_SCALE)),
    EffectEntry("sensor_drift", "i", "linear + bow in time", _drift_shape, _drift(I_SCALE)),
    EffectEntry(
        "sensor_nonlinearity", "x", "y = x + s2 x^2 + s3 x^3", _angle_shape, _curve(X_SCALE)
    ),
    EffectEntry(
        "sensor_nonlinearity", "i", "y = i + s2 i^2 + s3 i^3", _angle_shape, _curve(I_SCALE)
    ),
)
"""All entries; the order is part of the meaning of a seed."""


def effects() -> dict[str, tuple[str, ...]]:
    """Give the places of every effect.

    Examples
    --------
    >>> effects()["creep"]
    ('C_nl', 'k')
    """
    table: dict[str, tuple[str, ...]] = {NONE: ()}
    for entry in CATALOGUE:
        table[entry.name] = (*table.get(entry.name, ()), entry.place)
    return table


def entry(name: str, place: str) -> EffectEntry:
    """Look an entry up.

    Raises
    ------
    KeyError
        If the catalogue has no such effect at that place.
    """
    for candidate in CATALOGUE:
        if (candidate.name, candidate.place) == (name, place):
            return candidate
    known = ", ".join(f"{e.name}@{e.place}" for e in CATALOGUE)
    raise KeyError(f"no effect {name!r} at {place!r} on this bench. Known: {known}")
