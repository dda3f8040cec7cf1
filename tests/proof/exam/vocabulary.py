"""Which law may hide where in the exam, and what it may rightly be called."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType

from tests.proof.trial.generator.parameters import EXAM_PLANTS
from tests.proof.trial.generator.scale import BESIDE
from tests.proof.trial.generator.vocabulary import (
    DAMPERS,
    FORMS,
    HYSTERETIC,
    LEAKING,
    OUTSIDE,
    SINGLES,
    SOURCES,
    SPRINGS,
    Places,
)

Table = Sequence[tuple[str, str, Places]]

_SOURCES: Places = {name: (plant.source[0],) for name, plant in EXAM_PLANTS.items()}
_SENSORS: Places = {name: tuple(plant.sensors) for name, plant in EXAM_PLANTS.items()}
_COUPLING: Places = {"servo": ("k_c",)}
_RUBBING: Places = {"cylinder": ("b",), "servo": ("b_1", "b_2")}
_LEAK: Places = {"cylinder": ("R_l",)}
_PUSHED: Places = {"cylinder": ("m",), "servo": ("J_2",), "oven": ("C_1", "C_2")}
_AGEING: Places = {"cylinder": ("b", "C_h"), "servo": ("b_2", "k_c"), "oven": ("R_12", "R_out")}
_ROTOR: Places = {"servo": ("J_1",)}
_HEATED: Places = {"oven": ("C_1", "C_2")}

_NEW: Mapping[str, Places] = {
    law: places
    for laws, places in (
        (
            "prandtl_ishlinskii two_stiffnesses linear_stop gap preload bouc_wen two_yield "
            "uneven_yield quintic hyperbolic_sine power_stiffness smooth_two_stiffnesses "
            "round_contact soft_gap",
            _COUPLING,
        ),
        ("polynomial_stiffness softening", {**_COUPLING, "cylinder": ("C_h",)}),
        ("kelvin_voigt log_creep", {**_COUPLING, **_HEATED}),
        (
            "coulomb stribeck bristles square_drag two_dampings rational_stribeck dahl power_drag "
            "smooth_two_dampings diffusive_drag",
            _RUBBING,
        ),
        (
            "knee rate_limit first_order dead_band dead_time hyperbolic_tangent hard_limit "
            "uneven_rate_limit two_lags uneven_dead_band soft_dead_band dropouts tiring_gain "
            "sticking_spool rate_dependent_gain",
            _SOURCES,
        ),
        (
            "sensor_first_order linear_in_time sensor_polynomial sine_error rounding "
            "sensor_dead_time sensor_two_lags warming_up compression two_harmonics",
            _SENSORS,
        ),
        ("cogging cogging_harmonics", _ROTOR),
        ("attached_mass attached_hardening_mass", {"cylinder": ("m",), "servo": ("J_2",)}),
        ("turbulent orifice_power varistor", _LEAK),
        ("polynomial_resistance", {**_LEAK, "oven": ("R_12", "R_out")}),
        ("leak", {"oven": ("C_1",)}),
        ("skew", dict.fromkeys(EXAM_PLANTS, ("clock",))),
        ("sine_force pulse_force bursts", _PUSHED),
        ("linear_drift exponential_drift periodic_parameter sudden_change", _AGEING),
        ("eccentricity", {"servo": ("J_2",)}),
        ("healing_fluid", {"cylinder": ("b",)}),
    )
    for law in laws.split()
}
"""Places of the three plants that only the exam has, by law."""


def widened(table: Table, new: Mapping[str, Places]) -> Table:
    """Return a table whose laws may also hide at new places."""
    return tuple((e, law, {**at, **new.get(law, {})}) for e, law, at in table)


def of_laws(table: Table, laws: str) -> Table:
    """Return the rows of some laws, named in one text."""
    kept = laws.split()
    return tuple(row for row in table if row[1] in kept)


EXAM_SINGLES: Table = widened(SINGLES, _NEW)
"""Effects by laws that the catalogue may be expected to hold."""

EXAM_FORMS: Table = widened(FORMS, _NEW)
"""The same physics, written otherwise than in the catalogue."""

REWRITTEN: Table = (
    ("backlash", "letting_go_gap", {**SPRINGS, **_COUPLING}),
    ("presliding_friction", "lugre", {**DAMPERS, **_RUBBING}),
    ("presliding_friction", "slip_bristles", {**DAMPERS, **_RUBBING}),
    ("hysteresis", "relay_continuum", {**HYSTERETIC, **_COUPLING}),
    (
        "creep",
        "spread_creep",
        {"stack": ("C_a", "k"), "chain": ("k_1", "k_2", "k_3"), **_COUPLING, **_HEATED},
    ),
    ("low_pass", "amplifier_slew", {**SOURCES, **_SOURCES}),
    ("leakage", "orifice_leak", {**LEAKING, "cylinder": ("C_h",)}),
)
"""Known physics by laws that only the exam has (`laws_exam`)."""

EXAM_OUTSIDE: Table = widened(OUTSIDE, _NEW)
"""Physics that no effect of the vocabulary describes."""

RARE_LAWS = "linear_stop round_contact preload hard_limit sharp_overflow weir"
"""Limits, stops and contacts: they act only where the motion is large."""

SLOW_LAWS = (
    "kelvin_voigt log_creep spread_creep prandtl_ishlinskii uneven_yield relay_continuum leak "
    "warming levelling_warming coulomb linear_in_time warming_up linear_drift exponential_drift"
)
"""What shows in minutes rather than in periods."""

DISTURBED_LAWS = (
    "sine_force pulse_force bursts linear_drift exponential_drift periodic_parameter sudden_change"
)
"""Forces from outside and parameters that change."""

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
        "nonlinear_ratio": ("ratio",),
        "position_periodic_force": ("restoring", "surface"),
        "saturation": ("command",),
        "slew_limit": ("command",),
        "low_pass": ("command",),
        "dead_zone": ("command",),
        "leakage": ("dissipative", "slow"),
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
