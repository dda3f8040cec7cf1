"""The twelve pairs of effects that look alike, each with the plant and the sensors that show it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class LookalikePair:
    """Two effects that a poor excitation cannot tell apart.

    Parameters
    ----------
    plant : str
        Name of the plant.
    sensors : tuple of str
        Sensors that are recorded.
    members : two tuples of str
        Effect, law and place of both; an empty effect is a wrong value of the parameter `place`.
    """

    plant: str
    sensors: tuple[str, ...]
    members: tuple[tuple[str, str, str], tuple[str, str, str]]


PAIRS: Sequence[LookalikePair] = (
    LookalikePair(
        "chain",
        ("x_1", "x_2", "x_3"),
        (("coulomb_friction", "coulomb", "b_2"), ("hysteresis", "bouc_wen", "k_2")),
    ),
    LookalikePair(
        "probe",
        ("x", "v_f"),
        (("coulomb_friction", "coulomb", "b"), ("stribeck_friction", "stribeck", "b")),
    ),
    LookalikePair(
        "probe",
        ("x",),
        (
            ("nonlinear_stiffness", "polynomial_stiffness", "k"),
            ("sensor_nonlinearity", "sensor_polynomial", "x"),
        ),
    ),
    LookalikePair(
        "probe",
        ("x",),
        (("saturation", "hyperbolic_tangent", "F"), ("nonlinear_stiffness", "softening", "k")),
    ),
    LookalikePair(
        "stack",
        ("i", "x"),
        (("saturation", "hard_limit", "V"), ("slew_limit", "rate_limit", "V")),
    ),
    LookalikePair(
        "probe",
        ("x",),
        (("low_pass", "first_order", "F"), ("delay", "sensor_dead_time", "x")),
    ),
    LookalikePair(
        "probe",
        ("x", "v_f"),
        (("clock_skew", "skew", "clock"), ("time_varying_parameter", "linear_drift", "k")),
    ),
    LookalikePair(
        "stack",
        ("i", "x"),
        (("creep", "kelvin_voigt", "C_a"), ("leakage", "leak", "C_a")),
    ),
    LookalikePair(
        "chain",
        ("x_1",),
        (("dead_zone", "dead_band", "F"), ("backlash", "gap", "k_1")),
    ),
    LookalikePair(
        "motor",
        ("i", "w_1", "w_2"),
        (("quadratic_drag", "square_drag", "b_2"), ("coulomb_friction", "coulomb", "b_2")),
    ),
    LookalikePair(
        "chain",
        ("x_1", "x_2", "x_3"),
        (("hysteresis", "bouc_wen", "k_1"), ("hysteresis", "prandtl_ishlinskii", "k_1")),
    ),
    LookalikePair(
        "motor",
        ("i", "w_1"),
        (("", "", "K_m"), ("nonlinear_ratio", "polynomial_ratio", "K_m")),
    ),
)
"""The pairs, in the order of the design of the trial."""
