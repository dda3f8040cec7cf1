"""Recordings that the tool was diagnosed with while it was built: they prove less."""

from __future__ import annotations

from functools import partial

from actuators.stack_bond_graph import stack_bond_graph
from actuators.textbook import mass_with_viscous_friction, resonator, thermal_lag
from identification.blind.real.case import Folder, Published, RealCase, Truth
from identification.data import Loaded, load

__all__ = ["CASES"]


def _load(folder: Folder, name: str) -> Loaded:
    return load(name, folder)


def _piezo(folder: Folder) -> Loaded:
    recording, split = load("piezo-actuator-sine", folder)
    return Loaded(recording.select({"V_in": "V", "x": "x"}), split)


_STACK = ("C_nl", "V_in", "R_e", "T_1", "T_2", "k", "m", "R_nl", "x")
_DEAD_TIME = "dead time of two to three samples"

CASES = (
    RealCase(
        name="piezo_sine",
        label="seen before",
        dataset="piezo_actuator",
        load=_piezo,
        model=stack_bond_graph,
        truth=(
            Truth(
                "hysteresis", _STACK,
                "plays leave 0.6 % of the swing, any static curve 13.5 %; one amplitude and one "
                "frequency do not show where",
            ),
        ),
        published=Published(
            0.5, "% of range", "Prandtl-Ishlinskii or asymmetric Bouc-Wen operators, quasi-static",
            "order of magnitude for other actuators",
        ),
    ),
    RealCase(
        name="emps",
        label="seen before",
        dataset="emps",
        load=partial(_load, name="emps"),
        model=mass_with_viscous_friction,
        truth=(
            Truth("coulomb_friction", ("F_v",), "Coulomb friction and a constant offset"),
            Truth("stribeck_friction", ("F_v",), "contains Coulomb friction"),
        ),
        published=Published(
            0.452, "mm", "dynoNet; linear models 5.53 mm",
            "other record (pulses), free run instead of windows",
        ),
        comment="the offset of the force is a nuisance; closed loop",
    ),
    RealCase(
        name="silverbox",
        label="seen before",
        dataset="silverbox",
        load=partial(_load, name="silverbox"),
        model=resonator,
        truth=(Truth("nonlinear_stiffness", ("k",), "cubic spring, small even part"),),
        published=Published(
            0.301, "mV", "GP-NARX; linear models 6.96 mV",
            "same multisines, another boundary (75 % by the protocol too)",
        ),
    ),
    RealCase(
        name="hair_dryer",
        label="seen before",
        dataset="hair_dryer",
        load=partial(_load, name="hair_dryer"),
        model=thermal_lag,
        truth=(
            Truth("delay", ("u", "y"), _DEAD_TIME),
            Truth("low_pass", ("u",), "a second lag beside the dead time"),
            Truth("sensor_lag", ("y",), "a second lag beside the dead time"),
            Truth("added_mode", ("C_th", "R_th", "u", "y"), "a second lag beside the dead time"),
        ),
    ),
)  # fmt: skip
