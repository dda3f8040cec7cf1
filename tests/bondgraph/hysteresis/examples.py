"""One or more operators of every kind, for the tests that hold for all of them."""

from __future__ import annotations

from typing import Any

import numpy as np

from bondgraph.hysteresis import (
    AlJanaideh,
    Ang,
    AngRateDependent,
    BoucWen,
    Cascade,
    Dahl,
    DeadZones,
    GeneralisedPrandtlIshlinskii,
    HysteresisWithCreep,
    KelvinVoigtCreep,
    KrasnoselskiiPokrovskii,
    LogCreep,
    MaxwellResistiveCapacitor,
    Operator,
    Parallel,
    PrandtlIshlinskii,
    Preisach,
    RateDependentPrandtlIshlinskii,
    kuhnen_modified,
)
from bondgraph.support.ops import NUMPY

STEP = 0.02
"""Time between samples for operators that depend on it, s."""

PI = PrandtlIshlinskii((0.0, 0.3, 1.0, 2.5), (1.2, 0.6, -0.4, 0.9))
ZONES = DeadZones((-2.0, -0.5, 0.0, 0.7, 3.0), (0.3, -0.2, 1.0, 0.5, -0.8))
SPRINGS = MaxwellResistiveCapacitor((2.0, 1.0, 0.5), (0.4, 0.5, 1.2))
ENVELOPE = AlJanaideh(q=1.0, c=1.5, sigma=0.4, alpha=0.5, beta=0.3, count=6)
CREEP = LogCreep((50.0, 5.0, 0.5), (0.0, 0.4), (0.1, 0.2))
LINEAR = KelvinVoigtCreep(1.0, (0.3, -0.1, 0.2), (0.01, 0.1, 3.0))
RATE = RateDependentPrandtlIshlinskii((0, 0.3, 1), (0, 0.002, 0.003), (1.2, 0.6, -0.4), 0.05)
MODEL = HysteresisWithCreep(PI, CREEP)

_WEIGHTS = ((0.0, 0.3, 1.0), (1.2, 0.6, 0.4))
_BENT = (2.0, 0.3, 0.1, 0.5, -0.2)
_TANH = (4.0, 0.2, 0.1, 0.0, -0.2)
_WIDE = (40.0, 0.025, 0.1, 0.0, -0.2)
_LEFT, _RIGHT = (2.0, 0.3, 0.1, 0.2, -0.2), (1.8, 0.4, 0.0, 0.2, 0.2)

UNTIMED: dict[str, Operator] = {
    "prandtl_ishlinskii": PI,
    "prandtl_ishlinskii linear": PrandtlIshlinskii((0.0,), (2.0,)),
    "prandtl_ishlinskii spring": PrandtlIshlinskii((0.0, 0.4, 1.5), (2.0, -0.7, -0.9)),
    "dead_zone": ZONES,
    "ang": Ang(PI, ZONES),
    "ang_inverse": Ang(PI, ZONES).inverse(),
    "kuhnen_modified": kuhnen_modified((0, 0.5, 1), (1, 0.5, 0.2), (-1, 1, 3), (0.3, 1, 0.6, 0.2)),
    "al_janaideh": ENVELOPE,
    "maxwell_resistive_capacitor": SPRINGS,
    "generalised": GeneralisedPrandtlIshlinskii(*_WEIGHTS, _BENT, _BENT),
    "generalised, two envelopes": GeneralisedPrandtlIshlinskii(*_WEIGHTS, _LEFT, _RIGHT),
    "generalised, tanh": GeneralisedPrandtlIshlinskii(*_WEIGHTS, _TANH, _TANH),
    "inverse of generalised": GeneralisedPrandtlIshlinskii(*_WEIGHTS, _WIDE, _WIDE).inverse(),
    "preisach": Preisach(
        (0.0, 0.5, 1.3),
        (-3.0, -0.4, 1.0, 2.5),
        (0.3, 0.7, 0.1, 0.6, 0.2, 0.4, 0.0, 0.9, 0.3),
        0.8,
    ),
    "krasnoselskii_pokrovskii": KrasnoselskiiPokrovskii(
        -2.0, 0.9, 4, 1.1, (0.5, 0.2, 0.7, 0.1, 0.3, 0.6, 0.2, 0.4, 0.1, 0.8)
    ),
    "bouc_wen": BoucWen(0.5, 1.2, 1.5, 0.6, 0.3),
    "bouc_wen, softening": BoucWen(2.5, -1.2, 1.5, 0.6, -0.3),
    "bouc_wen, skewed": BoucWen(0.5, 1.2, 1.5, 0.6, 0.3, 0.2),
    "dahl": Dahl(2.0, 6.0),
    "cascade": Cascade(PI, ZONES),
    "cascade, bent input": Cascade(ZONES, PI),
    "cascade, two memories": Cascade(PI, ENVELOPE),
    "parallel": Parallel(PI, SPRINGS),
    "parallel springs": Parallel(SPRINGS, PrandtlIshlinskii((0.0, 0.4), (2.0, -0.7))),
}
TIMED: dict[str, Operator] = {
    "log_creep": CREEP,
    "kelvin_voigt_creep": LINEAR,
    "kelvin_voigt_creep passive": KelvinVoigtCreep(1.0, (0.3, 0.2), (0.01, 3.0)),
    "inverse of kelvin_voigt_creep": LINEAR.inverse(),
    "hysteresis_with_creep": MODEL,
    "hysteresis_with_creep, envelope": HysteresisWithCreep(ENVELOPE, CREEP),
    "hysteresis_with_creep, bent line": HysteresisWithCreep(ZONES, CREEP),
    "inverse of hysteresis_with_creep": MODEL.inverse(),
    "rate_dependent": RATE,
    "rate_dependent, linear": RateDependentPrandtlIshlinskii((0,), (0,), (2.0,)),
    "inverse of rate_dependent": RATE.inverse(),
    "rate_dependent_closed_form_inverse": RATE.closed_form_inverse(),
    "ang_rate_dependent": AngRateDependent((0, 0.3, 1), (1.2, 0.6, -0.4), (0.001, 0.002, 0.0005)),
    "inverse of ang_rate_dependent": AngRateDependent(
        (0, 0.3, 1), (1.2, 0.6, -0.4), (0.001, 0.002, 0.0005)
    ).inverse(),
    "cascade of all": Cascade(MODEL, ZONES),
    "cascade with linear creep": Cascade(LINEAR, PI),
    "parallel with creep": Parallel(PI, LINEAR),
}
EXAMPLES: dict[str, Operator] = {**UNTIMED, **TIMED}


def invertible(operators: dict[str, Any]) -> dict[str, Any]:
    """Those with an exact inverse."""
    not_these = "generalised, two envelopes"
    return {n: o for n, o in operators.items() if hasattr(o, "inverse") and n != not_these}


FORWARD: dict[str, Any] = {
    n: o
    for n, o in EXAMPLES.items()
    if (n in TIMED and "inverse" not in n) or n.startswith(("cascade", "parallel", "kuhnen"))
} | {"hysteresis_with_creep, rate": HysteresisWithCreep(RATE, CREEP)}
"""Timed and composed ones."""

WITH_INVERSES: dict[str, Any] = {
    **FORWARD,
    **{f"inverse of {name}": o.inverse() for name, o in invertible(FORWARD).items()},
    "closed form": RATE.closed_form_inverse(),
}
EVERY: dict[str, Any] = {**EXAMPLES, **WITH_INVERSES}


def wander(seed: int, n: int = 60, size: float = 5.0) -> np.ndarray:
    """Random record with reversals of all sizes."""
    rng = np.random.default_rng(seed)
    return np.asarray(size * rng.uniform(-1, 1, n) * rng.choice([0.05, 0.3, 1.0], n))


def wandered_memory(operator: Operator, seed: int) -> Any:
    """Memory with a past, and the input it was left at."""
    x = wander(seed)
    return operator.run(x, step=STEP)[1], float(x[-1])


def step_by_step(operator: Operator, x: Any, memory: Any) -> Any:
    outputs = []
    for value in x:
        outputs.append(float(operator.value(NUMPY, float(value), memory, STEP)))
        memory = operator.advance(NUMPY, float(value), memory, STEP)
    return np.array(outputs), memory
