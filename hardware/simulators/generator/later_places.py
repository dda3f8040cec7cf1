"""Where laws may hide in the plants that came with trial 2, and the laws that came with it."""

from __future__ import annotations

from collections.abc import Mapping

from hardware.simulators.generator.exam_places import EXAM_SINGLES, REWRITTEN, Table, widened
from hardware.simulators.generator.parameters import ALL_PLANTS, SHAKEN_PLANTS, WITHHELD_PLANTS
from hardware.simulators.generator.vocabulary import (
    CARRIERS,
    DAMPERS,
    SOURCES,
    SPRINGS,
    Places,
)

_PLANTS = {**SHAKEN_PLANTS, **WITHHELD_PLANTS}
_SPRINGS: Places = {
    "frame": ("k_1", "k_2"),
    "press": ("k_1", "k_2"),
    "table": ("k_c",),
    "speaker": ("k",),
}
_STRAIGHT: Places = {"frame": ("k_1", "k_2"), "press": ("k_2",), "table": ("k_c",)}
"""Springs that are not known to harden: there a smooth bend is missing physics."""
_DAMPERS: Places = {
    "frame": ("b_1", "b_2"),
    "press": ("b_1", "b_2"),
    "table": ("b_1", "b_c", "b_2"),
    "speaker": ("b",),
}
_MASSES: Places = {
    "frame": ("m_1", "m_2"),
    "press": ("m_1", "m_2"),
    "table": ("m_1", "m_2"),
    "speaker": ("m",),
}
_CARRIERS: Places = {"frame": ("m_2",), "press": ("m_2",), "table": ("m_2",), "speaker": ("m",)}
_WINDINGS: Places = {"table": ("R_w",), "speaker": ("R_e",)}
_RATIOS: Places = {"table": ("K_f",), "speaker": ("Bl",)}
_SOURCES: Places = {name: (plant.source[0],) for name, plant in _PLANTS.items()}
_SENSORS: Places = {name: tuple(plant.sensors) for name, plant in _PLANTS.items()}

LATER: Mapping[str, Places] = {
    law: places
    for laws, places in (
        (
            "prandtl_ishlinskii kelvin_voigt two_stiffnesses linear_stop gap preload bouc_wen "
            "two_yield uneven_yield log_creep softening smooth_two_stiffnesses round_contact "
            "soft_gap relay_continuum spread_creep letting_go_gap",
            _SPRINGS,
        ),
        ("cross_stiffness", {"frame": ("k_1", "k_2"), "press": ("k_1", "k_2")}),
        ("polynomial_stiffness quintic hyperbolic_sine power_stiffness", _STRAIGHT),
        (
            "coulomb stribeck bristles square_drag two_dampings rational_stribeck dahl power_drag "
            "smooth_two_dampings diffusive_drag displacement_damping lugre slip_bristles "
            "healing_fluid plate_valve",
            _DAMPERS,
        ),
        ("bent_path sine_force pulse_force bursts", _MASSES),
        ("attached_mass attached_hardening_mass", _CARRIERS),
        ("cogging cogging_harmonics", {"table": ("m_1",)}),
        ("polynomial_resistance varistor warming levelling_warming", _WINDINGS),
        ("polynomial_ratio falling_ratio levelling_ratio late_iron", _RATIOS),
        (
            "knee rate_limit first_order dead_band dead_time hyperbolic_tangent hard_limit "
            "uneven_rate_limit two_lags uneven_dead_band soft_dead_band dropouts tiring_gain "
            "sticking_spool rate_dependent_gain amplifier_slew",
            _SOURCES,
        ),
        (
            "sensor_first_order linear_in_time sensor_polynomial sine_error rounding "
            "sensor_dead_time sensor_two_lags warming_up compression two_harmonics",
            _SENSORS,
        ),
        ("skew", dict.fromkeys(_PLANTS, ("clock",))),
        (
            "linear_drift exponential_drift periodic_parameter sudden_change",
            {
                "frame": ("k_1", "k_2", "b_1"),
                "press": ("k_2", "b_1"),
                "table": ("R_w", "k_c", "b_1"),
                "speaker": ("R_e", "k", "b"),
            },
        ),
    )
    for law in laws.split()
}
"""Places of the four plants that came with trial 2, by law."""

LATER_REWRITTEN: Table = widened(REWRITTEN, LATER)
"""Known physics by laws that came with the development exam."""

_EVERY_SENSOR: Places = {name: tuple(plant.sensors) for name, plant in ALL_PLANTS.items()}
_SEVERAL: Places = {name: at for name, at in _EVERY_SENSOR.items() if len(at) > 1}
_ALL_SPRINGS: Places = {**SPRINGS, "servo": ("k_c",), **_SPRINGS}
_ALL_DAMPERS: Places = {**DAMPERS, "cylinder": ("b",), "servo": ("b_1", "b_2"), **_DAMPERS}

WRONG_GAIN: Table = (("sensor_gain", "wrong_gain", _EVERY_SENSOR),)
"""A sensor that is wrongly calibrated."""

LATER_SINGLES: Table = (*widened(EXAM_SINGLES, LATER), *WRONG_GAIN)
"""Effects by laws that the catalogue may be expected to hold, in every plant."""

MIXED_UP: Table = (
    ("unknown", "swapped", _SEVERAL),
    ("sensor_gain", "wrong_sign", _EVERY_SENSOR),
    ("sensor_gain", "wrong_unit", _EVERY_SENSOR),
)
"""Mistakes in the recording: two channels exchanged, a wrong sign, a forgotten conversion."""

WITHHELD_FORMS: Table = (
    ("nonlinear_stiffness", "magnet", {**SPRINGS, "servo": ("k_c",), **_STRAIGHT}),
    ("end_stop", "damped_contact", _ALL_SPRINGS),
    ("hysteresis", "tilted_loop", _ALL_SPRINGS),
    ("stribeck_friction", "exponential_stribeck", _ALL_DAMPERS),
    ("added_mode", "hanging_pendulum", {**CARRIERS, "servo": ("J_2",), **_CARRIERS}),
    (
        "saturation",
        "arctangent_limit",
        {**SOURCES, "cylinder": ("q_v",), "servo": ("T_m",), "oven": ("P",), **_SOURCES},
    ),
)
"""Known physics by laws that no development seed uses."""

WITHHELD_OUTSIDE: Table = (("unknown", "squeezed_film", _ALL_DAMPERS),)
"""Physics without a name that no development seed uses."""
