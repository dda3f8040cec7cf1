"""Laws that only the development exam hides: known physics, written as no catalogue writes it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from hardware.simulators.generator.law import CodedLaw, Numbers, between, bristle
from hardware.simulators.generator.scale import PlaceScale


def _lugre(s: float, z: PlaceScale, d: Sequence[float]) -> Numbers:
    level = 1.5 * s * z.force
    stiffness = level / (z.q * between(0.03, 0.25, d[0]))
    speed = between(0.1, 0.5, d[2]) * z.fr
    return {
        "level": level,
        "stiffness": stiffness,
        "damping": 0.2 * np.sqrt(stiffness * z.mass),
        "extra": between(0.3, 1.2, d[1]) * level,
        "speed": speed,
        "fade": 2 * speed,
    }


def _letting_go(s: float, z: PlaceScale, d: Sequence[float]) -> Numbers:
    half_gap = 0.5 * s * z.q
    depth = max(0.2 * half_gap, 0.01 * z.q)
    return {"half_gap": half_gap, "partner": float(z.partner), "depth": depth}


def _abrupt(z: PlaceScale) -> float:
    """Rate that asks for 300 sub-steps: what switches on and off is met to first order only."""
    return 450 / z.step


EXAM_LAWS: Mapping[str, CodedLaw] = {
    "letting_go_gap": CodedLaw(26, _letting_go, fastest=lambda p, z: _abrupt(z)),
    "spread_creep": CodedLaw(
        27,
        lambda s, z, d: {
            "compliance": 0.06 * s,
            "elements": 16.0,
            "time": between(2, 8, d[0]) * z.step,
            "ratio": 1.9,
            "growth": between(0.95, 1.15, d[1]),
        },
        16,
        lambda p, z: 1 / p["time"],
    ),
    "relay_continuum": CodedLaw(
        28,
        lambda s, z, d: {"level": 2 * s * z.c * z.q, "reach": z.q * between(0.3, 1.2, d[0])},
    ),
    "orifice_leak": CodedLaw(
        35,
        lambda s, z, d: {
            "conductance": 2 * s * z.fr / np.sqrt(z.c * z.qr),
            "round": 0.05 * z.c * z.qr,
        },
    ),
    "lugre": CodedLaw(66, _lugre, 1, bristle),
    "slip_bristles": CodedLaw(
        67,
        lambda s, z, d: {
            "stiffness": 2 * s * z.force / (z.q * (reach := between(0.05, 0.4, d[0]))),
            "reach": z.q * reach,
            "elements": 24.0,
        },
        fastest=lambda p, z: 3 * float(np.sqrt(p["stiffness"] / z.mass)) if z.mass != 1 else 0.0,
    ),
    "amplifier_slew": CodedLaw(
        105,
        lambda s, z, d: {
            "rate": 0.4 / (s * z.step),
            "damping": between(0.4, 1.0, d[0]),
            "slew": z.rate * (1 - 0.9 * s**0.4),
        },
        2,
        lambda p, z: max(2 * p["rate"], _abrupt(z)),
    ),
}
"""The laws by name; kinds of ``c/laws.h`` and ``c/run.c``."""
