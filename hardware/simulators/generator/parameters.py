"""Nominal values of the plants: the only thing that the generator and the tool both may know.

Each true value is the nominal one times ``exp(uniform(-0.25, 0.25))``. A model of the tool copies
this table; everything else in this package stays unknown to it.

The plants, with their elements as the tables name them:

chain
    Force ``F`` on ``m_1``; wall - ``k_1 || b_1`` - ``m_1`` - ``k_2 || b_2`` - ``m_2`` -
    ``k_3 || b_3`` - ``m_3``.
stack
    Voltage ``V``, resistance ``R_a`` in series with the capacitance ``C_a``, whose voltage drives
    a mass through the transformer ``alpha``: force = alpha * voltage, current = alpha * velocity.
motor
    Voltage ``u``, winding ``R_w``, ``L_w``, gyrator ``K_m`` to the rotor ``J_1``, ``b_1``; gear
    with speed behind it = w_1 / n; shaft ``k_s || b_s``; load ``J_2``, ``b_2``.
corner
    Road velocity ``v_r``, tyre ``k_t || b_t``, ``m_u``, suspension ``k_s || b_s``, ``m_b``;
    deviations from the static equilibrium. ``s_d`` is the stroke, integral of ``v_u - v_b``.
tanks
    Inflow ``q_in`` into ``C_1`` - ``R_12`` - ``C_2`` - ``R_23`` - ``C_3`` - ``R_out`` - ambient.
probe
    Force ``F`` on ``m``, ``k``, ``b``; a coil (gyrator ``K_g``) drives ``R_g`` and ``C_f`` in
    series: emf = K_g * velocity, back force = K_g * current; ``v_f`` is the voltage of ``C_f``.

Three more came with the development exam:

cylinder
    Oil flow ``q_v`` into the chamber ``C_h`` with the leak ``R_l`` to the return line; piston
    ``A`` (force = A * pressure) moves ``m`` against ``b``; no spring: the position ``x``
    integrates. ``p`` is the pressure.
servo
    Torque ``T_m`` of a motor under current control on the rotor ``J_1``, ``b_1``; coupling
    ``k_c || b_c``; load ``J_2``, ``b_2``. ``a_1`` is the angle of the rotor, which integrates;
    ``w_2`` the speed of the load.
oven
    Heater ``P`` into ``C_1`` - ``R_12`` - ``C_2`` - ``R_out`` - ambient; temperatures ``T_1``,
    ``T_2`` and the power are deviations from the working point.

Two with accelerometers and force cells came with trial 2 and are drawn in development too:

frame
    Force ``F`` on ``m_1``; load cell ``f_1`` at the wall - ``k_1 || b_1`` - ``m_1`` -
    ``k_2 || b_2`` - ``m_2``; ``a_1``, ``a_2`` are accelerations.
press
    As the frame, but the spring ``k_1`` is known to harden: ``k_1 q + a_3_k_1 (q / 1 mm)^3``;
    sensors are the displacement ``x_1``, the acceleration ``a_2`` and the force ``f_2`` in
    ``k_2 || b_2``.

Two more are drawn by sealed trials only; no development seed may use them:

table
    Voltage ``u``, winding ``R_w``, ``L_w``, linear motor ``K_f`` on the carriage ``m_1``, ``b_1``;
    coupling ``k_c || b_c``; payload ``m_2``, ``b_2``. The position ``x_1`` integrates; ``a_2`` is
    the acceleration of the payload.
speaker
    Voltage ``u``, coil ``R_e``, ``L_e``, force factor ``Bl`` on the cone ``m``, ``b``, whose
    suspension is known to harden: ``k q + a_3_k (q / 1 mm)^3``; area ``S_d`` into the closed box
    ``C_b`` with its leak ``R_b``. ``a`` is the acceleration of the cone, ``p`` the pressure.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

SPREAD = 0.25
"""Half width of the spread of a true value, in natural logarithm."""


@dataclass(frozen=True, slots=True)
class KnownPlant:
    """A plant as both sides may know it.

    Parameters
    ----------
    source : tuple of str
        Name and unit of the command.
    sensors : mapping
        Names of the sensors and their units, in order.
    nominal : mapping
        Names of the elements, each with nominal value and unit, in the order of the C code.
    step : float
        Interval between samples, in s.
    """

    source: tuple[str, str]
    sensors: Mapping[str, str]
    nominal: Mapping[str, tuple[float, str]]
    step: float


PLANTS: Mapping[str, KnownPlant] = {
    "chain": KnownPlant(
        ("F", "N"),
        {"x_1": "m", "x_2": "m", "x_3": "m"},
        {
            "m_1": (1.0, "kg"),
            "m_2": (1.0, "kg"),
            "m_3": (1.0, "kg"),
            "k_1": (1.0e4, "N/m"),
            "k_2": (1.0e4, "N/m"),
            "k_3": (1.0e4, "N/m"),
            "b_1": (8.0, "N s/m"),
            "b_2": (8.0, "N s/m"),
            "b_3": (8.0, "N s/m"),
        },
        1.0 / 250.0,
    ),
    "stack": KnownPlant(
        ("V", "V"),
        {"i": "A", "x": "m"},
        {
            "R_a": (20.0, "ohm"),
            "C_a": (8.0e-6, "F"),
            "alpha": (5.0, "N/V"),
            "m": (0.5, "kg"),
            "k": (5.0e6, "N/m"),
            "b": (95.0, "N s/m"),
        },
        1.0 / 5000.0,
    ),
    "motor": KnownPlant(
        ("u", "V"),
        {"i": "A", "w_1": "rad/s", "w_2": "rad/s"},
        {
            "R_w": (2.0, "ohm"),
            "L_w": (2.0e-3, "H"),
            "K_m": (0.05, "N m/A"),
            "J_1": (5.0e-5, "kg m^2"),
            "b_1": (1.0e-4, "N m s/rad"),
            "n": (5.0, "1"),
            "k_s": (10.0, "N m/rad"),
            "b_s": (4.0e-3, "N m s/rad"),
            "J_2": (1.0e-3, "kg m^2"),
            "b_2": (2.0e-3, "N m s/rad"),
        },
        1.0 / 500.0,
    ),
    "corner": KnownPlant(
        ("v_r", "m/s"),
        {"v_u": "m/s", "v_b": "m/s", "s_d": "m"},
        {
            "k_t": (1.8e5, "N/m"),
            "b_t": (150.0, "N s/m"),
            "m_u": (40.0, "kg"),
            "k_s": (2.0e4, "N/m"),
            "b_s": (1200.0, "N s/m"),
            "m_b": (300.0, "kg"),
        },
        1.0 / 100.0,
    ),
    "tanks": KnownPlant(
        ("q_in", "m^3/s"),
        {"p_1": "Pa", "p_2": "Pa", "p_3": "Pa"},
        {
            "C_1": (1.0e-5, "m^3/Pa"),
            "C_2": (0.8e-5, "m^3/Pa"),
            "C_3": (1.2e-5, "m^3/Pa"),
            "R_12": (1.0e7, "Pa s/m^3"),
            "R_23": (1.0e7, "Pa s/m^3"),
            "R_out": (1.5e7, "Pa s/m^3"),
        },
        5.0,
    ),
    "probe": KnownPlant(
        ("F", "N"),
        {"x": "m", "v_f": "V"},
        {
            "m": (0.2, "kg"),
            "k": (8.0e3, "N/m"),
            "b": (2.0, "N s/m"),
            "K_g": (20.0, "V s/m"),
            "R_g": (200.0, "ohm"),
            "C_f": (1.0e-5, "F"),
        },
        1.0 / 500.0,
    ),
}
"""The plants of the trial by name."""

EXAM_PLANTS: Mapping[str, KnownPlant] = {
    "cylinder": KnownPlant(
        ("q_v", "m^3/s"),
        {"p": "Pa", "x": "m"},
        {
            "C_h": (4.0e-13, "m^3/Pa"),
            "R_l": (1.5e10, "Pa s/m^3"),
            "A": (1.0e-3, "m^2"),
            "m": (20.0, "kg"),
            "b": (600.0, "N s/m"),
        },
        1.0 / 1000.0,
    ),
    "servo": KnownPlant(
        ("T_m", "N m"),
        {"a_1": "rad", "w_2": "rad/s"},
        {
            "J_1": (2.0e-4, "kg m^2"),
            "b_1": (2.0e-3, "N m s/rad"),
            "k_c": (40.0, "N m/rad"),
            "b_c": (8.0e-3, "N m s/rad"),
            "J_2": (6.0e-4, "kg m^2"),
            "b_2": (3.0e-3, "N m s/rad"),
        },
        1.0 / 1000.0,
    ),
    "oven": KnownPlant(
        ("P", "W"),
        {"T_1": "K", "T_2": "K"},
        {
            "C_1": (400.0, "J/K"),
            "R_12": (0.2, "K/W"),
            "C_2": (1500.0, "J/K"),
            "R_out": (0.5, "K/W"),
        },
        5.0,
    ),
}
"""Plants that only the development exam draws, by name."""

SHAKEN_PLANTS: Mapping[str, KnownPlant] = {
    "frame": KnownPlant(
        ("F", "N"),
        {"a_1": "m/s^2", "a_2": "m/s^2", "f_1": "N"},
        {
            "m_1": (2.0, "kg"),
            "k_1": (3.0e4, "N/m"),
            "b_1": (25.0, "N s/m"),
            "m_2": (1.0, "kg"),
            "k_2": (1.2e4, "N/m"),
            "b_2": (8.0, "N s/m"),
        },
        1.0 / 400.0,
    ),
    "press": KnownPlant(
        ("F", "N"),
        {"x_1": "m", "a_2": "m/s^2", "f_2": "N"},
        {
            "m_1": (5.0, "kg"),
            "k_1": (8.0e4, "N/m"),
            "a_3_k_1": (0.2, "N"),
            "b_1": (60.0, "N s/m"),
            "m_2": (2.0, "kg"),
            "k_2": (5.0e4, "N/m"),
            "b_2": (30.0, "N s/m"),
        },
        1.0 / 500.0,
    ),
}
"""Plants with accelerometers and force cells, of trial 2 and its development, by name."""

WITHHELD_PLANTS: Mapping[str, KnownPlant] = {
    "table": KnownPlant(
        ("u", "V"),
        {"i": "A", "x_1": "m", "a_2": "m/s^2"},
        {
            "R_w": (3.0, "ohm"),
            "L_w": (3.0e-3, "H"),
            "K_f": (12.0, "N/A"),
            "m_1": (2.5, "kg"),
            "b_1": (20.0, "N s/m"),
            "k_c": (4.0e4, "N/m"),
            "b_c": (15.0, "N s/m"),
            "m_2": (1.2, "kg"),
            "b_2": (5.0, "N s/m"),
        },
        1.0 / 1000.0,
    ),
    "speaker": KnownPlant(
        ("u", "V"),
        {"i": "A", "a": "m/s^2", "p": "Pa"},
        {
            "R_e": (6.0, "ohm"),
            "L_e": (1.0e-3, "H"),
            "Bl": (7.0, "N/A"),
            "m": (0.02, "kg"),
            "k": (2.5e3, "N/m"),
            "a_3_k": (0.1, "N"),
            "b": (1.2, "N s/m"),
            "S_d": (0.02, "m^2"),
            "C_b": (1.4e-7, "m^3/Pa"),
            "R_b": (3.0e5, "Pa s/m^3"),
        },
        1.0 / 4000.0,
    ),
}
"""Plants that no development seed uses, by name."""

ALL_PLANTS: Mapping[str, KnownPlant] = {**PLANTS, **EXAM_PLANTS, **SHAKEN_PLANTS, **WITHHELD_PLANTS}
"""Every plant that the C code knows, in its order."""
