"""Laws of storages and of what escapes from them; kinds of ``c/laws.h``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from hardware.simulators.generator.law import Build, CodedLaw, Numbers, between, sign
from hardware.simulators.generator.scale import PlaceScale


def _contact(numbers: Numbers, z: PlaceScale) -> float:
    return float(3 * np.sqrt(numbers["stiffness"] / z.mass)) if z.mass != 1 else 0.0


def _even_odd(s: float, z: PlaceScale, d: Sequence[float]) -> Numbers:
    even = (0.9 * sign(d[1]) if d[0] < 0.4 else 0.0) * s * z.c / z.q
    return {"quadratic": even, "cubic": 3 * s * z.c / z.q**2}


def _stops(n: int, power: float) -> Build:
    def build(s: float, z: PlaceScale, d: Sequence[float]) -> Numbers:
        radius = z.q * between(0.15, 0.6, d[0])
        return {"stiffness": 2 * s * z.c, "radius": radius, "elements": n, "power": power}

    return build


STORAGE_LAWS: Mapping[str, CodedLaw] = {
    # storages
    "polynomial_stiffness": CodedLaw(10, _even_odd),
    "two_stiffnesses": CodedLaw(
        11,
        lambda s, z, d: {
            "extra": 3 * s * z.c,
            "from": 0.0 if d[0] < 0.5 else 0.3 * (d[1] - 0.5) * z.q,
        },
    ),
    "linear_stop": CodedLaw(
        12,
        lambda s, z, d: {
            "stiffness": between(5, 20, d[0]) * z.c,
            "upper": z.q * (1 - 0.85 * s),
            "lower": z.q * (1 - 0.85 * s) if d[1] < 0.4 else 1e3 * z.q,
        },
        fastest=_contact,
    ),
    "gap": CodedLaw(13, lambda s, z, d: {"half_gap": 0.5 * s * z.q}),
    "preload": CodedLaw(14, lambda s, z, d: {"preload": z.c * z.q * (1 - 0.95 * s)}),
    "prandtl_ishlinskii": CodedLaw(15, _stops(10, 1.0)),
    "two_yield": CodedLaw(15, _stops(2, 2.0)),
    "uneven_yield": CodedLaw(15, _stops(9, 2.5)),
    "bouc_wen": CodedLaw(
        16,
        lambda s, z, d: {
            "stiffness": 2 * s * z.c,
            "radius": z.q * between(0.08, 0.4, d[0]),
            "sharpness": 1 + d[1],
            "shape": 0.5,
        },
        1,
        lambda p, z: 2 * z.f / p["radius"],
    ),
    "kelvin_voigt": CodedLaw(
        17,
        lambda s, z, d: {
            "compliance": 0.8 * s,
            "elements": 2.0,
            "time": between(8, 100, d[0]) * z.step,
            "ratio": between(3, 6, d[1]),
        },
        2,
    ),
    "log_creep": CodedLaw(
        17,
        lambda s, z, d: {
            "compliance": 0.2 * s,
            "elements": 8.0,
            "time": between(4, 30, d[0]) * z.step,
            "ratio": 3.0,
        },
        8,
    ),
    "softening": CodedLaw(25, lambda s, z, d: {"size": 0.5 * z.q / s}),
    "quintic": CodedLaw(19, lambda s, z, d: {"force": 4 * s * z.c * z.q, "size": z.q}),
    "hyperbolic_sine": CodedLaw(
        20, lambda s, z, d: {"force": 0.5 * s * z.c * z.q, "size": z.q * between(0.2, 0.4, d[0])}
    ),
    "power_stiffness": CodedLaw(
        21, lambda s, z, d: {"force": 3 * s * z.c * z.q, "size": z.q, "power": 1.5 + 2.2 * d[0]}
    ),
    "round_contact": CodedLaw(
        22,
        lambda s, z, d: {
            "stiffness": between(10, 40, d[0]) * z.c / np.sqrt(z.q),
            "upper": z.q * (1 - 0.85 * s),
            "lower": z.q * (1 - 0.85 * s) if d[1] < 0.4 else 1e3 * z.q,
        },
    ),
    "soft_gap": CodedLaw(
        23, lambda s, z, d: {"half_gap": 0.5 * s * z.q, "other_side": between(0.6, 1.6, d[0])}
    ),
    "smooth_two_stiffnesses": CodedLaw(
        24,
        lambda s, z, d: {
            "extra": 3 * s * z.c,
            "from": 0.2 * (d[0] - 0.5) * z.q,
            "width": z.q * between(0.05, 0.2, d[1]),
        },
    ),
    "cross_stiffness": CodedLaw(50, lambda s, z, d: {"factor": 5 * s / z.q**2}),
    # escapes of a storage
    "leak": CodedLaw(30, lambda s, z, d: {"conductance": 2 * s * z.fr / (z.c * z.qr)}),
    "sharp_overflow": CodedLaw(
        31,
        lambda s, z, d: {
            "conductance": between(5, 20, d[0]) * z.fr / (z.c * z.qr),
            "level": z.c * z.q * (1 - 0.9 * s),
        },
    ),
    "turbulent_leak": CodedLaw(
        32,
        lambda s, z, d: {"conductance": 2 * s * z.fr / (z.c * z.qr), "size": z.c * z.qr},
    ),
    "weir": CodedLaw(
        33,
        lambda s, z, d: {
            "conductance": between(5, 15, d[0]) * z.fr / (z.c * z.qr),
            "level": z.c * z.q * (1 - 0.9 * s),
            "size": 0.3 * z.c * z.q,
        },
    ),
    "siphon": CodedLaw(
        34,
        lambda s, z, d: {
            "conductance": 2 * s * z.fr / np.sqrt(z.c * z.q),
            "start": (0.3 + 0.3 * d[0]) * z.c * z.q,
            "end": (0.3 + 0.3 * d[0]) * z.c * z.q * 0.2,
            "outlet": 0.0,
        },
    ),
}
