"""Laws of resistors; kinds of ``c/laws.h``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from hardware.simulators.generator.law import CodedLaw, Numbers, between, bristle, sign
from hardware.simulators.generator.scale import PlaceScale


def _dry(numbers: Numbers, z: PlaceScale) -> float:
    return (numbers["level"] + numbers.get("extra", 0.0)) / (0.004 * z.fr * z.mass)


def _dry_numbers(level: float, extra: float, speed: float, z: PlaceScale) -> Numbers:
    rest = {f"_{k}": 0.0 for k in range(3, 9)}
    return {"level": level, "extra": extra, "speed": speed, **rest, "smooth": 0.004 * z.fr}


def _bristle_numbers(s: float, z: PlaceScale, d: Sequence[float], full: bool) -> Numbers:
    level = 1.5 * s * z.force
    stiffness = level / (z.q * between(0.03, 0.25, d[0]))
    return {
        "level": level,
        "stiffness": stiffness,
        "damping": 0.1 * np.sqrt(stiffness * z.mass) if full else 0.0,
        "extra": between(0.1, 0.6, d[1]) * level if full else 0.0,
        "speed": between(0.1, 0.4, d[2]) * z.fr,
    }


def _resistance(s: float, z: PlaceScale, d: Sequence[float]) -> Numbers:
    even = (0.5 * sign(d[1]) if d[0] < 0.4 else 0.0) * s * z.c / z.fr
    return {"quadratic": even, "cubic": 5 * s * z.c / z.fr**2}


RESISTOR_LAWS: Mapping[str, CodedLaw] = {
    # resistors
    "coulomb": CodedLaw(
        40, lambda s, z, d: _dry_numbers(2 * s * z.force, 0.0, z.fr, z), fastest=_dry
    ),
    "stribeck": CodedLaw(
        41,
        lambda s, z, d: _dry_numbers(
            s * z.force, between(0.5, 1.5, d[0]) * s * z.force, between(0.1, 0.5, d[1]) * z.fr, z
        ),
        fastest=_dry,
    ),
    "rational_stribeck": CodedLaw(
        46,
        lambda s, z, d: _dry_numbers(
            s * z.force, between(0.5, 1.5, d[0]) * s * z.force, between(0.1, 0.5, d[1]) * z.fr, z
        ),
        fastest=_dry,
    ),
    "bristles": CodedLaw(42, lambda s, z, d: _bristle_numbers(s, z, d, True), 1, bristle),
    "dahl": CodedLaw(42, lambda s, z, d: _bristle_numbers(s, z, d, False), 1, bristle),
    "square_drag": CodedLaw(
        43,
        lambda s, z, d: {"factor": 3 * s * z.force / z.fr**2},
        fastest=lambda p, z: 3 * p["factor"] * z.f / z.mass if z.mass != 1 else 0.0,
    ),
    "turbulent": CodedLaw(43, lambda s, z, d: {"factor": 6 * s * z.c / z.fr}),
    "two_dampings": CodedLaw(44, lambda s, z, d: {"half_difference": 0.9 * s * z.c * sign(d[0])}),
    "smooth_two_dampings": CodedLaw(
        49,
        lambda s, z, d: {
            "factor": 2 * s * z.c,
            "asymmetry": 0.9 * sign(d[0]),
            "speed": z.fr * between(0.1, 0.4, d[1]),
        },
    ),
    "power_drag": CodedLaw(
        45,
        lambda s, z, d: {"force": s * z.force, "size": z.fr, "power": 1.5 if d[0] < 0.6 else 2.5},
        fastest=lambda p, z: 5 * p["force"] / z.fr / z.mass if z.mass != 1 else 0.0,
    ),
    "orifice_power": CodedLaw(
        45, lambda s, z, d: {"effort": 4 * s * z.c * z.fr, "size": z.fr, "power": 1 / 0.6}
    ),
    "varistor": CodedLaw(
        45, lambda s, z, d: {"effort": 3 * s * z.c * z.fr, "size": z.fr, "power": 3 + 2 * d[0]}
    ),
    "polynomial_resistance": CodedLaw(47, _resistance),
    "warming": CodedLaw(
        48,
        lambda s, z, d: {
            "gain": 3 * s / (z.c * z.fr**2),
            "time": z.span * between(0.03, 0.25, d[0]),
        },
        1,
    ),
    "levelling_warming": CodedLaw(
        48,
        lambda s, z, d: {
            "gain": 4 * s / (z.c * z.fr**2),
            "time": z.span * between(0.03, 0.25, d[0]),
            "levels": 1.0,
        },
        1,
    ),
    "diffusive_drag": CodedLaw(
        60,
        lambda s, z, d: {"factor": 0.3 * s * z.force / z.fr, "time": 200 * z.step},
        7,
        lambda p, z: 4.0**6 / p["time"] + 130 * p["factor"] / z.mass,
    ),
    "displacement_damping": CodedLaw(
        61, lambda s, z, d: {"factor": s * z.force / (z.fr * z.qr**2)}
    ),
    "plate_valve": CodedLaw(
        62,
        lambda s, z, d: {
            "factor": 2 * s * (z.force / z.fr if z.mass != 1 else 3 * z.c),
            "period": between(2, 8, d[0]) * z.step,
            "damping": between(0.2, 0.6, d[1]),
            **{f"_{k}": 0.0 for k in range(3, 9)},
            "smooth": 0.05 * z.fr,
        },
        2,
    ),
    "healing_fluid": CodedLaw(
        64,
        lambda s, z, d: {
            "factor": 0.95 * s * z.c,
            "size": z.q * between(2, 20, d[0]),
            "time": z.span * between(0.02, 0.1, d[1]),
        },
        1,
    ),
}
