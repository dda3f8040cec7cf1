"""Laws of inertias, ratios, sources and slow changes; kinds of ``c/plants.h``, ``c/run.c``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from hardware.simulators.generator.law import Build, CodedLaw, Numbers, between
from hardware.simulators.generator.scale import PlaceScale


def _resonator(cubic: float) -> Build:
    def build(s: float, z: PlaceScale, d: Sequence[float]) -> Numbers:
        w = 2 * np.pi * between(0.04, 0.16, d[0]) / z.step
        m = 0.5 * s * z.c
        soft = cubic * m * w * w / z.q**2
        return {"mass": m, "stiffness": m * w * w, "damping": 0.08 * m * w, "cubic": soft}

    return build


def _wave(z: PlaceScale, d: Sequence[float]) -> tuple[float, float]:
    return 2 * np.pi * between(0.01, 0.15, d[0]) / z.step, 2 * np.pi * d[1]


def _turns(z: PlaceScale, d: Sequence[float]) -> float:
    """Waves per unit of displacement: whole numbers a turn where the place turns."""
    return float(round(between(3, 12, d[0]))) if z.q > 1 else 2 * np.pi * between(2, 7, d[0]) / z.q


def _sudden(s: float, z: PlaceScale, d: Sequence[float]) -> Numbers:
    start = z.span * (0.2 + 0.4 * d[0])
    return {"force": s * z.force, "start": start, "end": start + z.span * (0.05 + 0.3 * d[1])}


OTHER_LAWS: Mapping[str, CodedLaw] = {
    # any coefficient
    "linear_drift": CodedLaw(1, lambda s, z, d: {"change": (0.9 if d[0] < 0.7 else -0.6) * s}),
    "exponential_drift": CodedLaw(2, lambda s, z, d: {"change": 0.9 * s, "pace": 0.1 + 0.4 * d[0]}),
    "periodic_parameter": CodedLaw(
        3,
        lambda s, z, d: {
            "change": 0.8 * s,
            "rate": 2 * np.pi * between(2, 9, d[0]) / z.span,
            "phase": 6 * d[1],
        },
    ),
    "sudden_change": CodedLaw(4, lambda s, z, d: {"change": 0.9 * s, "moment": 0.25 + 0.5 * d[0]}),
    # inertias and flows
    "sine_force": CodedLaw(
        70,
        lambda s, z, d: {"force": s * z.force, "rate": _wave(z, d)[0], "phase": _wave(z, d)[1]},
    ),
    "pulse_force": CodedLaw(71, _sudden),
    "bursts": CodedLaw(
        77,
        lambda s, z, d: {
            "force": s * z.force,
            "length": between(10, 60, d[0]) * z.step,
            "key": d[1],
        },
    ),
    "cogging": CodedLaw(
        72,
        lambda s, z, d: {"force": s * z.force, "waves": _turns(z, d), "phase": 6 * d[1]},
        fastest=lambda p, z: 6 * p["waves"] * z.f,
    ),
    "cogging_harmonics": CodedLaw(
        76,
        lambda s, z, d: {"force": s * z.force, "waves": _turns(z, d), "phase": 6 * d[1]},
        fastest=lambda p, z: 18 * p["waves"] * z.f,
    ),
    "eccentricity": CodedLaw(
        75,
        lambda s, z, d: {
            "factor": s * z.force / z.fr**2,
            "waves": 1.0 if z.q > 1 else 2 * np.pi / z.q,
            "phase": 6 * d[1],
        },
        fastest=lambda p, z: 6 * p["waves"] * z.f,
    ),
    "attached_mass": CodedLaw(73, _resonator(0.0), 2),
    "attached_hardening_mass": CodedLaw(73, _resonator(0.3), 2),
    "bent_path": CodedLaw(74, lambda s, z, d: {"factor": 4 * s / z.q**2}),
    # transformers and gyrators
    "polynomial_ratio": CodedLaw(
        80,
        lambda s, z, d: {
            "change": -0.7 * s,
            "size": z.q,
            "skew": 0.0 if d[0] < 0.5 else 0.4,
        },
    ),
    "falling_ratio": CodedLaw(81, lambda s, z, d: {"change": 4 * s, "size": z.q}),
    "levelling_ratio": CodedLaw(82, lambda s, z, d: {"change": 0.9 * s, "size": 0.4 * z.q}),
    "late_iron": CodedLaw(
        83,
        lambda s, z, d: {"change": 4 * s, "size": z.q, "time": between(5, 60, d[0]) * z.step},
        1,
    ),
    # the source
    "dead_time": CodedLaw(
        90,
        # whole parts of an interval, so that the jumps of a held command fall between the steps
        lambda s, z, d: {"time": max(1, round(1000 * s)) * z.step / 200},
        fastest=lambda p, z: 299.9 / z.step,
    ),
    "hard_limit": CodedLaw(91, lambda s, z, d: {"limit": z.um * (1 - 0.9 * s)}),
    "knee": CodedLaw(
        92, lambda s, z, d: {"limit": 0.35 * z.um / np.sqrt(s), "sharpness": 6 + 14 * d[0]}
    ),
    "hyperbolic_tangent": CodedLaw(93, lambda s, z, d: {"limit": z.um * 0.4 / s}),
    "dead_band": CodedLaw(94, lambda s, z, d: {"upper": s * 0.7 * z.um, "lower": s * 0.7 * z.um}),
    "uneven_dead_band": CodedLaw(
        94, lambda s, z, d: {"upper": s * 0.7 * z.um, "lower": s * 0.7 * z.um * (0.1 + 0.4 * d[0])}
    ),
    "soft_dead_band": CodedLaw(102, lambda s, z, d: {"width": s * 0.7 * z.um}),
    "first_order": CodedLaw(
        95, lambda s, z, d: {"time": 6 * s * z.step}, 1, lambda p, z: 1 / p["time"]
    ),
    "two_lags": CodedLaw(
        96, lambda s, z, d: {"time": 3 * s * z.step}, 2, lambda p, z: 1 / p["time"]
    ),
    "rate_limit": CodedLaw(
        97, lambda s, z, d: {"up": z.rate * (1 - 0.97 * s), "down": z.rate * (1 - 0.97 * s)}
    ),
    "uneven_rate_limit": CodedLaw(
        97, lambda s, z, d: {"up": z.rate * (1 - 0.97 * s), "down": z.rate * 2}
    ),
    "dropouts": CodedLaw(
        98,
        lambda s, z, d: {"loss": s, "length": between(10, 80, d[0]) * z.step, "key": d[1]},
    ),
    "tiring_gain": CodedLaw(
        99,
        lambda s, z, d: {
            "change": 0.5 * s,
            "size": z.ur**2,
            "time": z.span * between(0.01, 0.05, d[0]),
        },
        1,
    ),
    "sticking_spool": CodedLaw(101, lambda s, z, d: {"threshold": 0.5 * s * z.um, "key": d[0]}),
    "rate_dependent_gain": CodedLaw(
        104,
        lambda s, z, d: {"change": 2 * s, "time": 5 * z.step, "size": 0.5 * z.um},
        1,
    ),
}
