"""Where laws may hide in the plants of the development exam, and the laws that came with it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from hardware.simulators.generator.parameters import EXAM_PLANTS
from hardware.simulators.generator.vocabulary import (
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
