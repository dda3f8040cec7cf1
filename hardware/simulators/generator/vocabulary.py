"""Which effect may hide where, by which laws: of the catalogue, of another form, or outside it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from hardware.simulators.generator.parameters import PLANTS


@dataclass(frozen=True, slots=True)
class Choice:
    """An effect, a law and a place of a plant."""

    effect: str
    law: str
    plant: str
    place: str


Places = Mapping[str, Sequence[str]]

SPRINGS: Places = {
    "chain": ("k_1", "k_2", "k_3"),
    "stack": ("k",),
    "motor": ("k_s",),
    "corner": ("k_t", "k_s"),
    "probe": ("k",),
}
DAMPERS: Places = {
    "chain": ("b_1", "b_2", "b_3"),
    "stack": ("b",),
    "motor": ("b_1", "b_2"),
    "corner": ("b_s",),
    "probe": ("b",),
}
HYSTERETIC: Places = {**SPRINGS, "stack": ("C_a", "k")}
LEAKING: Places = {"stack": ("C_a",), "tanks": ("C_1", "C_2", "C_3"), "probe": ("C_f",)}
VESSELS: Places = {"tanks": ("C_1", "C_2", "C_3")}
VALVES: Places = {"tanks": ("R_12", "R_23", "R_out")}
WINDINGS: Places = {"motor": ("R_w",), "stack": ("R_a",), "probe": ("R_g",)}
RESISTANCES: Places = {**WINDINGS, **VALVES}
INERTIAS: Places = {
    "chain": ("m_1", "m_2", "m_3"),
    "stack": ("m",),
    "motor": ("J_2",),
    "corner": ("m_b", "m_u"),
    "probe": ("m",),
}
CARRIERS: Places = {"chain": ("m_3",), "stack": ("m",), "motor": ("J_2",), "corner": ("m_b",)}
SOURCES: Places = {name: (plant.source[0],) for name, plant in PLANTS.items()}
SENSORS: Places = {name: tuple(plant.sensors) for name, plant in PLANTS.items()}
SPEEDS: Places = {"motor": ("w_1", "w_2"), "corner": ("v_u", "s_d")}
RATIOS: Places = {"stack": ("alpha",), "motor": ("K_m",), "probe": ("K_g",)}
CLOCK: Places = {name: ("clock",) for name in PLANTS}
TOOTHED: Places = {"motor": ("J_1",), "probe": ("m",)}
HOT: Places = {"motor": ("R_w",), "corner": ("b_s",), "stack": ("R_a",)}
CHANGING: Places = {
    "chain": ("k_1", "k_2", "k_3", "b_2"),
    "stack": ("k", "R_a"),
    "motor": ("R_w", "k_s"),
    "corner": ("k_t", "b_s"),
    "tanks": ("R_12", "R_23", "R_out"),
    "probe": ("k", "R_g"),
}
DISTURBED: Places = {**INERTIAS, "tanks": ("C_1", "C_2", "C_3")}

SINGLES: Sequence[tuple[str, str, Places]] = (
    ("hysteresis", "prandtl_ishlinskii", HYSTERETIC),
    ("creep", "kelvin_voigt", {**HYSTERETIC}),
    ("coulomb_friction", "coulomb", DAMPERS),
    ("stribeck_friction", "stribeck", DAMPERS),
    ("presliding_friction", "bristles", DAMPERS),
    ("quadratic_drag", "square_drag", DAMPERS),
    ("asymmetric_damping", "two_dampings", {**DAMPERS, "corner": ("b_s", "b_t")}),
    ("nonlinear_stiffness", "polynomial_stiffness", SPRINGS),
    ("bilinear_stiffness", "two_stiffnesses", SPRINGS),
    ("end_stop", "linear_stop", SPRINGS),
    ("backlash", "gap", SPRINGS),
    ("contact_loss", "preload", SPRINGS),
    ("nonlinear_ratio", "polynomial_ratio", RATIOS),
    ("position_periodic_force", "cogging", TOOTHED),
    ("saturation", "knee", SOURCES),
    ("slew_limit", "rate_limit", SOURCES),
    ("low_pass", "first_order", SOURCES),
    ("dead_zone", "dead_band", SOURCES),
    ("leakage", "leak", LEAKING),
    ("overflow", "sharp_overflow", VESSELS),
    ("added_mode", "attached_mass", CARRIERS),
    ("self_heating", "warming", HOT),
    ("square_root_flow", "turbulent", VALVES),
    ("nonlinear_resistance", "polynomial_resistance", RESISTANCES),
    ("sensor_lag", "sensor_first_order", SENSORS),
    ("sensor_drift", "linear_in_time", SENSORS),
    ("sensor_nonlinearity", "sensor_polynomial", SENSORS),
    ("sensor_rectification", "absolute_value", SPEEDS),
    ("periodic_error", "sine_error", SENSORS),
    ("quantisation", "rounding", SENSORS),
    ("delay", "dead_time", SOURCES),
    ("delay", "sensor_dead_time", SENSORS),
    ("clock_skew", "skew", CLOCK),
    ("external_disturbance", "sine_force", DISTURBED),
    ("time_varying_parameter", "linear_drift", CHANGING),
)
"""Effects by laws that a catalogue of physics may be expected to hold."""

FORMS: Sequence[tuple[str, str, Places]] = (
    ("hysteresis", "bouc_wen", SPRINGS),
    ("hysteresis", "two_yield", HYSTERETIC),
    ("hysteresis", "uneven_yield", HYSTERETIC),
    ("creep", "log_creep", {"stack": ("C_a", "k"), "chain": ("k_1", "k_2", "k_3")}),
    ("stribeck_friction", "rational_stribeck", DAMPERS),
    ("presliding_friction", "dahl", DAMPERS),
    ("quadratic_drag", "power_drag", DAMPERS),
    ("asymmetric_damping", "smooth_two_dampings", DAMPERS),
    ("nonlinear_stiffness", "quintic", SPRINGS),
    ("nonlinear_stiffness", "hyperbolic_sine", SPRINGS),
    ("nonlinear_stiffness", "power_stiffness", SPRINGS),
    ("nonlinear_stiffness", "softening", SPRINGS),
    ("bilinear_stiffness", "smooth_two_stiffnesses", SPRINGS),
    ("end_stop", "round_contact", SPRINGS),
    ("backlash", "soft_gap", SPRINGS),
    ("nonlinear_ratio", "falling_ratio", RATIOS),
    ("nonlinear_ratio", "levelling_ratio", RATIOS),
    ("position_periodic_force", "cogging_harmonics", TOOTHED),
    ("saturation", "hyperbolic_tangent", SOURCES),
    ("saturation", "hard_limit", SOURCES),
    ("slew_limit", "uneven_rate_limit", SOURCES),
    ("low_pass", "two_lags", SOURCES),
    ("dead_zone", "uneven_dead_band", SOURCES),
    ("dead_zone", "soft_dead_band", SOURCES),
    ("leakage", "turbulent_leak", LEAKING),
    ("overflow", "weir", VESSELS),
    ("added_mode", "attached_hardening_mass", CARRIERS),
    ("self_heating", "levelling_warming", HOT),
    ("square_root_flow", "orifice_power", VALVES),
    ("nonlinear_resistance", "varistor", RESISTANCES),
    ("sensor_lag", "sensor_two_lags", SENSORS),
    ("sensor_drift", "warming_up", SENSORS),
    ("sensor_nonlinearity", "compression", SENSORS),
    ("sensor_rectification", "weaker_side", SPEEDS),
    ("periodic_error", "two_harmonics", SENSORS),
    ("external_disturbance", "pulse_force", DISTURBED),
    ("external_disturbance", "bursts", DISTURBED),
    ("time_varying_parameter", "exponential_drift", CHANGING),
    ("time_varying_parameter", "periodic_parameter", CHANGING),
    ("time_varying_parameter", "sudden_change", CHANGING),
)
"""The same physics by another law: the family is the right answer."""

OUTSIDE: Sequence[tuple[str, str, Places]] = (
    ("unknown", "cross_stiffness", {"chain": ("k_1", "k_2", "k_3"), "corner": ("k_s", "k_t")}),
    ("unknown", "siphon", VESSELS),
    ("unknown", "diffusive_drag", DAMPERS),
    ("unknown", "displacement_damping", {**DAMPERS, "motor": ("b_s",)}),
    ("unknown", "plate_valve", {"tanks": ("R_12", "R_23", "R_out"), "corner": ("b_s",)}),
    ("unknown", "healing_fluid", {"chain": ("b_1", "b_2"), "corner": ("b_s",), "stack": ("b",)}),
    ("unknown", "eccentricity", {"motor": ("J_1", "J_2")}),
    ("unknown", "late_iron", {"motor": ("K_m",), "probe": ("K_g",), "stack": ("alpha",)}),
    ("unknown", "bent_path", {"chain": ("m_1", "m_2", "m_3"), "probe": ("m",), "stack": ("m",)}),
    ("unknown", "dropouts", SOURCES),
    ("unknown", "tiring_gain", SOURCES),
    ("unknown", "sticking_spool", SOURCES),
    ("unknown", "rate_dependent_gain", SOURCES),
)
"""Physics that no effect of the vocabulary describes."""


def choices(table: Sequence[tuple[str, str, Places]]) -> dict[tuple[str, str], list[Choice]]:
    """Return all choices of a table by effect and law."""
    return {
        (effect, law): [Choice(effect, law, p, e) for p, at in places.items() for e in at]
        for effect, law, places in table
    }
