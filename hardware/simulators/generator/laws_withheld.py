"""Laws that only sealed trials hide: no development seed uses them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from hardware.simulators.generator.law import CodedLaw, between
from hardware.simulators.generator.scale import PlaceScale


def _stiff(force: float, depth: float, z: PlaceScale) -> float:
    """Return the rate of an inertia on a contact that gives a force at a depth."""
    return float(np.sqrt(force / depth / z.mass)) if z.mass != 1 else 0.0


WITHHELD_LAWS: Mapping[str, CodedLaw] = {
    "magnet": CodedLaw(
        29,
        lambda s, z, d: {
            "force": s * z.c * z.q * (reach := between(1.15, 2.5, d[0])) / 2,
            "distance": z.q * reach,
            "both": 1.0 if d[1] < 0.5 else 0.0,
        },
    ),
    "damped_contact": CodedLaw(
        36,
        lambda s, z, d: {
            "factor": 8 * z.c / np.sqrt(z.q),
            "upper": (gap := z.q * (1 - 0.9 * s)),
            "lower": gap * (1 + d[0]) if d[1] < 0.5 else 1e6 * z.q,
            "damping": between(0.3, 1.5, d[2]) / z.fr,
        },
        fastest=lambda p, z: _stiff(8 * z.c * z.q, z.q, z),
    ),
    "tilted_loop": CodedLaw(
        37,
        lambda s, z, d: {
            "turn": s * z.c,
            "length": z.q * between(0.1, 0.6, d[0]),
            "far": s * z.c * 0.4 * d[1],
        },
        1,
        lambda p, z: z.f / p["length"],
    ),
    "exponential_stribeck": CodedLaw(
        68,
        lambda s, z, d: {
            "level": s * z.force,
            "extra": between(0.5, 1.5, d[0]) * s * z.force,
            "speed": between(0.1, 0.5, d[1]) * z.fr,
            **{f"_{k}": 0.0 for k in range(3, 9)},
            "smooth": 0.004 * z.fr,
        },
        fastest=lambda p, z: (p["level"] + p["extra"]) / (p["smooth"] * z.mass),
    ),
    "squeezed_film": CodedLaw(
        69,
        lambda s, z, d: {
            "factor": 2 * s * z.c,
            "gap": z.q * between(1.3, 3, d[0]),
        },
        fastest=lambda p, z: 130 * p["factor"] / z.mass if z.mass != 1 else 0.0,
    ),
    "hanging_pendulum": CodedLaw(
        78,
        lambda s, z, d: {
            "mass": 0.6 * s * z.c,
            "length": z.q * between(2, 6, d[1]),
            "rate": (rate := 2 * np.pi * between(0.03, 0.12, d[0]) / z.step),
            "damping": 0.06 * rate,
        },
        2,
    ),
    "arctangent_limit": CodedLaw(106, lambda s, z, d: {"size": z.um * 0.35 / s}),
}
"""The laws by name; kinds of ``c/laws.h``, ``c/plants.h`` and ``c/run.c``."""
