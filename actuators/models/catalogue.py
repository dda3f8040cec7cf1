"""Models by name, for the command line."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from actuators.electrostatic.moving_plate import moving_plate, moving_plate_charge
from actuators.models.plants import PLANT_MODELS
from actuators.models.plants.stack import stack
from actuators.models.textbook import mass_with_viscous_friction, resonator, thermal_lag
from actuators.stack.bond_graph import stack_bond_graph
from actuators.stack.field import stack_field_charge, stack_field_curved, stack_field_voltage
from actuators.stack.lumped import stack_lumped
from actuators.stack.switching_disc import switching_disc
from actuators.thesis.models import PRINTED_MODELS
from actuators.ultrasonic.stage import ultrasonic_stage
from bondgraph import BondGraph


def stack_with_payload(*, external_force: bool = False) -> BondGraph:
    """Return the linear stack that moves 0.1 kg through a 20 ohm lead; reads ``x`` and ``i``."""
    return stack_bond_graph(
        mass=0.1, resistance=20.0, damping=150.0, sensors=("x", "i"), external_force=external_force
    )


def stack_on_bench() -> BondGraph:
    """Return the plant ``stack`` with the numbers of `stack_with_payload`: the virtual bench's.

    The same linear machine in other words: ``C_a = C/(1 + k T^2 C)`` is the capacitance at constant
    length, ``alpha = k T C_a`` the force per volt, ``k - alpha^2/C_a`` the stiffness at constant
    voltage.
    """
    return stack(
        resistance=20.0, capacitance=1.48e-6, coupling=3.15, mass=0.1, stiffness=58.3e6,
        damping=150.0,
    )  # fmt: skip


MODELS: dict[str, Callable[..., BondGraph]] = {
    "stack_bond_graph": stack_bond_graph,
    "stack_lumped": stack_lumped,
    "stack_with_payload": stack_with_payload,
    "stack_on_bench": stack_on_bench,
    "stack_field_voltage": stack_field_voltage,
    "stack_field_charge": stack_field_charge,
    "stack_field_curved": stack_field_curved,
    "switching_disc": switching_disc,
    "moving_plate": moving_plate,
    "moving_plate_charge": moving_plate_charge,
    **PRINTED_MODELS,
    "ultrasonic_stage": ultrasonic_stage,
    "mass_with_viscous_friction": mass_with_viscous_friction,
    "resonator": resonator,
    "thermal_lag": thermal_lag,
    **PLANT_MODELS,
}

LOADED: dict[str, Callable[[], BondGraph]] = {
    name: partial(MODELS[name], external_force=True)
    for name in (
        "stack_bond_graph", "stack_lumped", "stack_with_payload", "stack_field_voltage",
        "stack_field_charge", "stack_field_curved", "stack_lumped_maxwell", "stack_bond_graph_ang",
    )
}  # fmt: skip
"""Models with the force ``F_e`` on their end, which recordings seldom hold: for reading."""
