"""What a concealed law may rightly be called: names, kinds of physics, and elements."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType

from hardware.simulators.generator.scale import BESIDE

_NAMES: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "bouc_wen": ("presliding_friction",),
        "dahl": ("hysteresis",),
        "slip_bristles": ("hysteresis",),
        "smooth_two_stiffnesses": ("nonlinear_stiffness",),
        "soft_gap": ("nonlinear_stiffness",),
        "preload": ("bilinear_stiffness",),
        "turbulent_leak": ("square_root_flow",),
        "orifice_leak": ("square_root_flow", "nonlinear_resistance"),
        "orifice_power": ("nonlinear_resistance",),
        "amplifier_slew": ("slew_limit",),
        "tilted_loop": ("presliding_friction",),
    }
)
"""Further names that are as true as the effect's own, by law: one function of one port."""

_ONE_SIDED = ("linear_stop", "round_contact", "damped_contact")

_BESIDE = ("bouc_wen", "dahl", "lugre", "slip_bristles", "letting_go_gap", "tilted_loop")
"""Laws that a spring and the damper beside it can hold alike."""

_KINDS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "hysteresis": ("memory",),
        "creep": ("slow",),
        "coulomb_friction": ("dissipative",),
        "stribeck_friction": ("dissipative",),
        "presliding_friction": ("dissipative", "memory"),
        "quadratic_drag": ("dissipative",),
        "asymmetric_damping": ("dissipative",),
        "nonlinear_stiffness": ("restoring",),
        "bilinear_stiffness": ("restoring",),
        "end_stop": ("restoring",),
        "backlash": ("restoring",),
        "contact_loss": ("restoring",),
        "cross_coupling": ("restoring", "dissipative"),
        "nonlinear_ratio": ("ratio",),
        "position_periodic_force": ("restoring", "surface"),
        "saturation": ("command",),
        "slew_limit": ("command",),
        "low_pass": ("command",),
        "dead_zone": ("command",),
        "leakage": ("dissipative", "slow"),
        "internal_leakage": ("slow", "dissipative"),
        "overflow": ("dissipative", "restoring"),
        "added_mode": ("mode",),
        "self_heating": ("slow", "dissipative"),
        "square_root_flow": ("dissipative",),
        "nonlinear_resistance": ("dissipative",),
        "sensor_lag": ("sensing",),
        "sensor_gain": ("sensing",),
        "sensor_drift": ("sensing",),
        "sensor_nonlinearity": ("sensing",),
        "sensor_rectification": ("sensing",),
        "periodic_error": ("sensing",),
        "quantisation": ("sensing",),
        "clock_skew": ("sensing",),
        "external_disturbance": ("exogenous",),
        "time_varying_parameter": ("time",),
        # by law: the same effect at two sorts of places, or outside the vocabulary
        "dead_time": ("command",),
        "sensor_dead_time": ("sensing",),
        "letting_go_gap": ("restoring", "surface"),
        "cross_stiffness": ("surface",),
        "squeezed_film": ("surface",),
        "swapped": ("sensing",),
        "siphon": ("memory", "dissipative"),
        "diffusive_drag": ("slow", "mode", "dissipative"),
        "displacement_damping": ("surface",),
        "plate_valve": ("dissipative", "mode"),
        "healing_fluid": ("slow", "dissipative"),
        "eccentricity": ("surface", "ratio"),
        "late_iron": ("ratio", "slow"),
        "bent_path": ("surface",),
        "dropouts": ("command", "time"),
        "tiring_gain": ("command", "slow"),
        "sticking_spool": ("command",),
        "rate_dependent_gain": ("command",),
    }
)

KINDS = (
    "restoring", "dissipative", "memory", "slow", "mode", "ratio", "command", "sensing", "time",
    "exogenous", "surface",
)  # fmt: skip
"""Sorts of physics that a finding may name without a law."""


def names_of(effect: str, law: str, draws: Sequence[float]) -> tuple[str, ...]:
    """Return the names that are right, the effect's own first; none outside the vocabulary.

    Parameters
    ----------
    draws : sequence of float
        A stop with a draw of 0.4 or more in its second place stands on one side only: the function
        of a spring with two slopes.
    """
    if effect == "unknown":
        return ()
    one_sided = law in _ONE_SIDED and draws[1] >= 0.4
    return (effect, *_NAMES.get(law, ()), *(("bilinear_stiffness",) if one_sided else ()))


def kinds_of(effect: str, law: str) -> tuple[str, ...]:
    """Return the kinds that are right, the most telling first."""
    return _KINDS.get(law) or _KINDS[effect]


def places_of(plant: str, law: str, place: str) -> tuple[str, ...]:
    """Return the elements that are right, the one with the law first."""
    if law == "orifice_leak" and plant == "cylinder":
        return (place, "R_l")
    if law in _BESIDE:
        pairs = [(k, b) for (p, k), b in BESIDE.items() if p == plant]
        both = [pair for pair in pairs if place in pair]
        return (place, *(e for e in (both[0] if both else ()) if e != place))
    return (place,)
