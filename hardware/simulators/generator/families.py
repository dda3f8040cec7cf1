"""The vocabulary of effects and their families, as the contract of the verdict has it."""

from __future__ import annotations

from types import MappingProxyType

FAMILIES: MappingProxyType[str, tuple[str, ...]] = MappingProxyType(
    {
        "memory": ("hysteresis", "creep"),
        "friction": (
            "coulomb_friction",
            "stribeck_friction",
            "presliding_friction",
            "quadratic_drag",
            "asymmetric_damping",
        ),
        "restoring": (
            "nonlinear_stiffness",
            "bilinear_stiffness",
            "end_stop",
            "backlash",
            "contact_loss",
            "cross_coupling",
        ),
        "transduction": ("nonlinear_ratio", "position_periodic_force"),
        "drive": ("saturation", "slew_limit", "low_pass", "dead_zone", "inner_resistance"),
        "storage": (
            "leakage",
            "internal_leakage",
            "overflow",
            "added_mode",
            "linear_spring",
            "linear_loss",
            "linear_inertia",
            "linear_capacity",
            "eddy_current_loss",
            "self_heating",
        ),
        "flow": (
            "square_root_flow",
            "nonlinear_resistance",
            "diode",
            "current_limit",
            "voltage_drop",
        ),
        "measurement": (
            "sensor_lag",
            "sensor_offset",
            "sensor_gain",
            "sensor_drift",
            "sensor_nonlinearity",
            "sensor_rectification",
            "periodic_error",
            "quantisation",
        ),
        "time": ("delay", "clock_skew"),
        "outside": ("external_disturbance", "time_varying_parameter", "unknown"),
    }
)
"""Effects by family; a test holds the catalogue to it."""

FAMILY_OF: MappingProxyType[str, str] = MappingProxyType(
    {effect: family for family, effects in FAMILIES.items() for effect in effects}
)
"""Family of each effect."""
