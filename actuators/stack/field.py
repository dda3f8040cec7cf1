"""The linear (or curved) piezo stack as one energy: a C field between circuit and moved body.

The body obeys ``m x'' + b x' + dW/dx = F_e``; the circuit sees ``dW/dq``. Nothing else is assumed,
so power is conserved and the two couplings are equal by construction.

Where the other models coincide with it (linear; n layers of area A and thickness t; form h for
brevity, other forms by `Uniaxial.to`):

| model | meaning of its parameters | in constants of the material |
| --- | --- | --- |
| `stack_bond_graph` | C free, k open circuit, ``T = x/q`` free | ``C_nl = l^2 n A/(t beta^T)``, \
``k = A c^D/(n t)``, ``T = h t/(A c^D)`` |
| `stack_lumped` | C clamped, k short circuit, ``T = F/V`` blocked | ``C = n A/(t beta^S)``, \
``k = A c^E/(n t)``, ``T = A h/(t beta^S)`` |

with ``beta^T = beta^S - h^2/c^D`` and ``c^E = c^D - h^2/beta^S``. By hand: eliminating the dipole
``p = l q`` of `stack_bond_graph` (stack actuator thesis, eq. 5.3 and 5.4, with
``E_2 = -F T/l``) leaves ``V = q/C - T F``, ``F = k (x - T q)``, the gradient of
``k (x - T q)^2/2 + q^2/(2 C)``: form g. Eliminating V_t of `stack_lumped` (eq. 5.1) leaves
``V = (q - T x)/C``, ``F = k x - T V``, the gradient of ``k x^2/2 + (q - T x)^2/(2 C)``: form e. So
all three have the same transfer functions. Their default numbers differ: the data sheet gives one
stiffness, and the models take it for different electrical conditions.
"""

from __future__ import annotations

from typing import Any

from actuators.materials.ceramics import material
from actuators.materials.constitutive import Form
from actuators.materials.piezo_field import LINEAR, Curvature, Layers, piezo_field
from actuators.materials.uniaxial import Uniaxial
from actuators.stack.charge_drive import current_driven
from bondgraph import BondGraph, De, Df, Dq, GraphError, I, One, R, Se, Zero

_PIC255 = material("PIC255")

CERAMIC = Uniaxial("d", _PIC255.value("s33"), _PIC255.value("d33"), _PIC255.value("eps33"))
"""PIC255, stack actuator thesis, table 2.1."""

LAYERS = Layers(25e-6, 50e-6, 360)
"""A stack of the length (18 mm) and stroke (15 um at 100 V) of the P-840.1.

Area and thickness are not in its data sheet: 25 mm^2 fits its stiffness, 360 layers its stroke with
d33. The small-signal capacitance of such a stack is 2.8 uF, the data sheet says 1.5 uF.
"""

CURVED = Curvature(0.1, 5e9)
"""Illustrative, not measured: at 100 V electrostriction is a tenth of the stroke, and saturation
takes 7 % of the charge."""

_M = "a third of the ceramics, and the payload"
_S = "stack actuator thesis, table 2.1 (PIC255)"
_L = "length and stroke of the P-840.1"
_NAMES: dict[str, tuple[tuple[str, str], tuple[str, str], tuple[str, str]]] = {
    "d": (("s33_E", "m^2/N"), ("d33", "m/V"), ("eps33_T", "F/m")),
    "e": (("c33_E", "N/m^2"), ("e33", "C/m^2"), ("eps33_S", "F/m")),
    "g": (("s33_D", "m^2/N"), ("g33", "V*m/N"), ("beta33_T", "m/F")),
    "h": (("c33_D", "N/m^2"), ("h33", "V/m"), ("beta33_S", "m/F")),
}


def stack_field_voltage(
    constants: Uniaxial = CERAMIC,
    layers: Layers = LAYERS,
    *,
    form: Form | None = None,
    curvature: Curvature = LINEAR,
    mass: float | None = 5.3e-3,
    damping: float | None = 80.0,
    resistance: float | None = None,
    sensors: tuple[str, ...] = ("x",),
    external_force: bool = False,
) -> BondGraph:
    """Piezo stack as a field, driven by a voltage.

    Without `resistance` the source imposes the voltage of the field, whose charge is then solved
    from it (derivative causality); with it the charge is a state.

    Parameters
    ----------
    constants : Uniaxial
        In numbers; they become the parameters of the graph (``s33_E``, ``d33``, ``eps33_T`` in
        form d and so on).
    layers : Layers
        Parameters ``A``, ``t_layer`` and ``n_layers``.
    form : {"d", "e", "g", "h"}, optional
        Form in which the constants become parameters; their own when not given.
    curvature : Curvature
        Higher terms of the energy: parameters ``M_33``, ``z_33`` if not 0.
    mass : float, optional
        Effective moved mass, kg; None for a massless tip.
    damping : float, optional
        N s/m.
    resistance : float, optional
        Of the leads and the amplifier output, ohm.
    sensors : tuple of {"x", "i", "u"}
        Displacement, current and voltage of the stack.
    external_force : bool
        Add the input ``F_e`` that pulls the tip.

    Raises
    ------
    GraphError
        Neither mass, nor damping, nor force: nothing at the tip.
    BadConstant
        The coupling factor reaches 1.
    """
    if mass is None and damping is None and not external_force:
        raise GraphError(
            "stack_field: nothing is bonded to the tip of the stack; give mass=, damping= or "
            "external_force=True"
        )
    held = constants.to(form or constants.form)
    with BondGraph("stack_field_voltage") as g:
        stack = piezo_field("stack", *_declared(g, held, layers, curvature))
        loop, terminal, body = One("loop"), Zero("terminal"), One("body")
        Se("V_in", unit="V") >> loop >> terminal >> stack
        if resistance is not None:
            loop >> R(
                "R_e", resistance, unit="ohm", spread=3.0, source="leads and amplifier output"
            )
        body >> stack
        if external_force:
            Se("F_e", unit="N") >> body
        if mass is not None:
            body >> I("m", mass, unit="kg", spread=2.0, source=_M)
        if damping is not None:
            body >> R("b", damping, unit="N*s/m", spread=10.0, source="P-840.1, thesis table 6.1")
        if "i" in sensors:
            loop >> Df("i", unit="A")
        if "u" in sensors:
            terminal >> De("u", unit="V")
        if "x" in sensors:
            body >> Dq("x", unit="m")
    return g


def stack_field_charge(
    constants: Uniaxial = CERAMIC,
    layers: Layers = LAYERS,
    *,
    leak: float | None = None,
    **options: Any,
) -> BondGraph:
    """Piezo stack as a field, its charge imposed by the current ``i_in``.

    Parameters
    ----------
    leak : float, optional
        Resistance ``R_leak`` across the stack, ohm; without it the charge never comes back.
    **options
        Of `stack_field_voltage`.
    """
    driven = stack_field_voltage(constants, layers, **options)
    graph = current_driven(driven, name="stack_field_charge")
    if leak is None:
        return graph
    across = R("R_leak", leak, unit="ohm", spread=10.0, source="insulation of the stack")
    return graph.with_branch("terminal", (across,))


def stack_field_curved(*, external_force: bool = False) -> BondGraph:
    """Return the voltage-driven stack with electrostriction and saturation, `CURVED`."""
    return stack_field_voltage(curvature=CURVED, sensors=("x", "i"), external_force=external_force)


def _declared(
    g: BondGraph, constants: Uniaxial, layers: Layers, curvature: Curvature
) -> tuple[Uniaxial, Layers, Curvature]:
    """Turn numbers into parameters of the graph; zero curvature stays away."""
    named = zip(_NAMES[constants.form], constants.values, strict=True)
    symbols = [
        g.parameter(n, v, unit, spread=2.0, source=_S, positive=v > 0) for (n, unit), v in named
    ]
    body = Layers(
        g.parameter("A", layers.area, "m^2", spread=1.5, source=_L),
        g.parameter("t_layer", layers.thickness, "m", spread=1.5, source=_L),
        g.parameter("n_layers", layers.number, fixed=True, source=_L),
    )
    m, z = curvature.electrostriction, curvature.saturation
    higher = Curvature(
        g.parameter("M_33", m, "m^4/C^2", positive=m > 0) if m else 0,
        g.parameter("z_33", z, "V*m^5/C^3") if z else 0,
    )
    return Uniaxial(constants.form, *symbols), body, higher
