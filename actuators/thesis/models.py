"""The four stack models of the thesis as bond graphs, with printed or other constants."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from actuators.stack.bond_graph import stack_bond_graph
from actuators.stack.hysteresis import stack_al_janaideh, stack_ang
from actuators.stack.lumped import stack_lumped
from actuators.thesis.operators import polarisation_operator_printed
from actuators.thesis.tables import TABLE_6_1, TABLE_6_2
from actuators.thesis.values import named
from bondgraph.graph.bond_graph import BondGraph
from bondgraph.hysteresis import MaxwellResistiveCapacitor
from bondgraph.laws import Hysteretic


def stack_lumped_maxwell(
    transducer: float | None = None, *, external_force: bool = False
) -> BondGraph:
    """Return the lumped-parameter model of table 6.1 with the Maxwell elements of table 6.4.

    Parameters
    ----------
    transducer : float, optional
        T, N/V; by default the printed one, with which the loop comes out too small.
    external_force : bool
        Add the input ``F_e``.

    Returns
    -------
    BondGraph
        As `stack_lumped`; the moved mass is a third of the printed one.
    """
    return stack_lumped(
        Hysteretic(MaxwellResistiveCapacitor.stack_2hz()),
        capacitance=named(TABLE_6_1, "C"),
        transducer=named(TABLE_6_1, "T") if transducer is None else transducer,
        stiffness=named(TABLE_6_1, "k"),
        mass=named(TABLE_6_1, "m") / 3.0,
        damping=named(TABLE_6_1, "b"),
        external_force=external_force,
    )


def stack_bond_graph_ang(
    transducer: float | None = None, *, external_force: bool = False
) -> BondGraph:
    """Return the general bond graph of table 6.2 with Ang's inverse of sec 6.5.

    Parameters
    ----------
    transducer : float, optional
        T, m/C; by default the printed number, which the printed inverse was fitted with.
    external_force : bool
        Add the input ``F_e``, which the thesis leaves out in (5.4).

    Returns
    -------
    BondGraph
        As `stack_bond_graph`; the moved mass is a third of the printed one and the damping, which
        table 6.2 leaves out, that of table 6.1.
    """
    return stack_bond_graph(
        Hysteretic(polarisation_operator_printed()),
        transducer=named(TABLE_6_2, "T") if transducer is None else transducer,
        stiffness=named(TABLE_6_2, "k"),
        mass=named(TABLE_6_2, "m") / 3.0,
        damping=named(TABLE_6_1, "b"),
        resistance=named(TABLE_6_2, "R_e"),
        length=named(TABLE_6_2, "l"),
        external_force=external_force,
    )


PRINTED_MODELS: Mapping[str, Callable[[], BondGraph]] = {
    "stack_al_janaideh": stack_al_janaideh,
    "stack_ang": stack_ang,
    "stack_lumped_maxwell": stack_lumped_maxwell,
    "stack_bond_graph_ang": stack_bond_graph_ang,
}
"""The models of chapter 6 by name, each with its printed parameters."""
