"""A small library of components with ports, ready for `bondgraph.graph.composing.hierarchy.use`.

Every port says the unit of its effort. Power is positive from the first port to the last. Each
number is a parameter named like its element and may be bound when the component is used.
"""

from __future__ import annotations

import sympy as sp

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.composing.diffusion import warburg
from bondgraph.graph.composing.hierarchy import Port, use
from bondgraph.graph.composing.library import ComponentLibrary
from bondgraph.graph.elements import GY, TF, C, I, MSe, MSf, One, R, Zero
from bondgraph.graph.modulation import effort
from bondgraph.laws import QuadraticDrag


def mass_spring_damper(
    mass: float = 1.0, stiffness: float = 100.0, damping: float = 1.0
) -> BondGraph:
    """Segment of a chain: a mass behind a spring and a damper in parallel.

    ``F = k x + d (v_left - v)``, ``dx/dt = v_left - v``, ``m dv/dt = F - F_right``. Ports ``left``
    (velocity given, force F taken, N) and ``right`` (of the mass, N). Parameters ``m`` (kg),
    ``k`` (N/m), ``d`` (N s/m).
    """
    with BondGraph("mass_spring_damper") as g:
        link, between, body = Zero("link"), One("between"), One("body")
        Port("left", unit="N") >> link >> body
        link >> between >> C("k", stiffness=stiffness, unit="N/m")
        between >> R("d", damping, unit="N*s/m")
        body >> I("m", mass, unit="kg")
        body >> Port("right", unit="N")
    return g


def two_mass_oscillator(
    mass: float = 1.0, stiffness: float = 100.0, damping: float = 1.0
) -> BondGraph:
    """Two masses joined by a spring and a damper: a mass, then a segment.

    ``m_1 dv_1/dt = F_left - F``, ``m dv/dt = F - F_right`` with ``F = k x + d (v_1 - v)``. Ports
    ``left`` and ``right`` (of the masses, N). Parameters ``m_1`` and ``segment_m`` (kg),
    ``segment_k`` (N/m), ``segment_d`` (N s/m).
    """
    with BondGraph("two_mass_oscillator") as g:
        body = One("body")
        segment = use(mass_spring_damper(mass, stiffness, damping), "segment")
        Port("left", unit="N") >> body >> I("m_1", mass, unit="kg")
        body >> segment.left
        segment.right >> Port("right", unit="N")
    return g


def rc_section(resistance: float = 1e3, capacitance: float = 1e-6) -> BondGraph:
    """Low-pass section: a resistor in series, a capacitor across.

    ``u_left = R i + u``, ``C du/dt = i - i_right``. Ports ``left``, ``right`` (V). Parameters ``R``
    (ohm), ``C`` (F).
    """
    with BondGraph("rc_section") as g:
        loop, node = One("loop"), Zero("node")
        Port("left", unit="V") >> loop >> R("R", resistance, unit="ohm")
        loop >> node >> C("C", capacitance, unit="F")
        node >> Port("right", unit="V")
    return g


def lc_section(
    inductance: float = 1e-3, capacitance: float = 1e-6, resistance: float = 0.1
) -> BondGraph:
    """Section of a line or filter: a coil with its resistance in series, a capacitor across.

    ``L di/dt = u_left - R i - u``, ``C du/dt = i - i_right``. Ports ``left``, ``right`` (V).
    Parameters ``L`` (H), ``R`` (ohm), ``C`` (F).
    """
    with BondGraph("lc_section") as g:
        loop, node = One("loop"), Zero("node")
        Port("left", unit="V") >> loop >> I("L", inductance, unit="H")
        loop >> R("R", resistance, unit="ohm")
        loop >> node >> C("C", capacitance, unit="F")
        node >> Port("right", unit="V")
    return g


def electrical_transformer(turns: float = 10.0, resistance: float = 1.0) -> BondGraph:
    """Ideal transformer with the resistance of its primary winding.

    ``u_primary = R i + n u_secondary``, ``i_secondary = n i``. Ports ``primary``, ``secondary``
    (V). Parameters ``n`` (turns of the primary over those of the secondary), ``R`` (ohm).
    """
    with BondGraph("electrical_transformer") as g:
        loop = One("loop")
        Port("primary", unit="V") >> loop >> R("R", resistance, unit="ohm")
        loop >> TF("n", ratio=turns) >> Port("secondary", unit="V", common="effort")
    return g


def dc_motor(
    resistance: float = 1.0,
    inductance: float = 1e-3,
    torque_constant: float = 0.05,
    inertia: float = 1e-5,
    friction: float = 1e-6,
) -> BondGraph:
    """Permanent magnet DC motor.

    ``L di/dt = u - R i - K omega``, ``J domega/dt = K i - b omega - M_shaft``. Ports ``terminal``
    (V), ``shaft`` (N m). Parameters ``R`` (ohm), ``L`` (H), ``K`` (V s), ``J`` (kg m^2), ``b``
    (N m s).
    """
    with BondGraph("dc_motor") as g:
        armature, rotor = One("armature"), One("rotor")
        Port("terminal", unit="V") >> armature >> R("R", resistance, unit="ohm")
        armature >> I("L", inductance, unit="H")
        armature >> GY("K", ratio=torque_constant, unit="V*s") >> rotor
        rotor >> I("J", inertia, unit="kg*m^2")
        rotor >> R("b", friction, unit="N*m*s")
        rotor >> Port("shaft", unit="N*m")
    return g


def voice_coil(
    resistance: float = 5.0,
    inductance: float = 1e-3,
    force_constant: float = 10.0,
    mass: float = 0.05,
) -> BondGraph:
    """Voice coil with its moved mass.

    ``L di/dt = u - R i - K v``, ``m dv/dt = K i - F``. Ports ``terminal`` (V), ``coil`` (N).
    Parameters ``R`` (ohm), ``L`` (H), ``K`` (N/A), ``m`` (kg).
    """
    with BondGraph("voice_coil") as g:
        loop, body = One("loop"), One("body")
        Port("terminal", unit="V") >> loop >> R("R", resistance, unit="ohm")
        loop >> I("L", inductance, unit="H")
        loop >> GY("K", ratio=force_constant, unit="N/A") >> body >> I("m", mass, unit="kg")
        body >> Port("coil", unit="N")
    return g


def elastic_gearbox(
    reduction: float = 10.0, friction: float = 1e-6, stiffness: float = 1e3
) -> BondGraph:
    """Gearbox with friction at the fast side and an elastic slow shaft.

    ``omega_fast = i omega_g``, ``M_fast = b omega_fast + M / i``, ``M = k phi``,
    ``dphi/dt = omega_g - omega_slow``. Ports ``fast``, ``slow`` (N m). Parameters ``i``, ``b``
    (N m s), ``k`` (N m/rad).
    """
    with BondGraph("elastic_gearbox") as g:
        ratio = g.parameter("i", reduction)
        fast, shaft = One("fast_shaft"), Zero("slow_shaft")
        Port("fast", unit="N*m") >> fast >> R("b", friction, unit="N*m*s")
        fast >> TF("gear", ratio=1 / ratio) >> shaft
        shaft >> C("k", stiffness=stiffness, unit="N*m/rad")
        shaft >> Port("slow", unit="N*m")
    return g


def rack_and_pinion(radius: float = 0.02) -> BondGraph:
    """Pinion that drives a rack.

    ``v = r omega``, ``M = r F``. Ports ``pinion`` (N m), ``rack`` (N). Parameter ``r`` (m).
    """
    with BondGraph("rack_and_pinion") as g:
        Port("pinion", unit="N*m") >> TF("r", ratio=radius, unit="m") >> Port("rack", unit="N")
    return g


def hydraulic_cylinder(
    area: float = 1e-3,
    compliance: float = 1e-13,
    leakage: float = 1e12,
    mass: float = 1.0,
    friction: float = 100.0,
) -> BondGraph:
    """Cylinder with one compressible chamber, leakage and the mass of piston and rod.

    ``C dp/dt = Q - p / R - A v``, ``m dv/dt = A p - d v - F``. Ports ``oil`` (Pa), ``rod`` (N).
    Parameters ``A`` (m^2), ``C`` (volume over bulk modulus, m^3/Pa), ``R`` (Pa s/m^3), ``m``
    (kg), ``d`` (N s/m).
    """
    with BondGraph("hydraulic_cylinder") as g:
        a = g.parameter("A", area, "m^2")
        chamber, piston = Zero("chamber"), One("piston")
        Port("oil", unit="Pa") >> chamber >> C("C", compliance, unit="m^3/Pa")
        chamber >> R("R", leakage, unit="Pa*s/m^3")
        chamber >> TF("face", ratio=1 / a) >> piston >> I("m", mass, unit="kg")
        piston >> R("d", friction, unit="N*s/m")
        piston >> Port("rod", unit="N")
    return g


def hydraulic_line(
    resistance: float = 1e8, inertance: float = 1e6, compliance: float = 1e-13
) -> BondGraph:
    """Section of a pipe: laminar resistance and inertance in series, then the oil's compliance.

    ``L dQ/dt = p_left - R Q - p``, ``C dp/dt = Q - Q_right``. Ports ``left``, ``right`` (Pa).
    Parameters ``R`` (Pa s/m^3), ``L`` (Pa s^2/m^3), ``C`` (m^3/Pa).
    """
    with BondGraph("hydraulic_line") as g:
        bore, node = One("bore"), Zero("node")
        Port("left", unit="Pa") >> bore >> R("R", resistance, unit="Pa*s/m^3")
        bore >> I("L", inertance, unit="Pa*s^2/m^3")
        bore >> node >> C("C", compliance, unit="m^3/Pa")
        node >> Port("right", unit="Pa")
    return g


def thermal_section(resistance: float = 1.0, capacity: float = 100.0) -> BondGraph:
    """Wall layer in the pseudo thermal domain: a resistance, then a heat capacity.

    ``T_left - T = R Q``, ``C dT/dt = Q - Q_right``. Ports ``left``, ``right`` (K). Parameters ``R``
    (K/W), ``C`` (J/K).
    """
    with BondGraph("thermal_section") as g:
        flow, node = One("flow"), Zero("node")
        Port("left", unit="K") >> flow >> R("R", resistance, unit="K/W")
        flow >> node >> C("C", capacity, unit="J/K")
        node >> Port("right", unit="K")
    return g


def propeller(
    thrust: float = 0.02, torque: float = 1e-3, lag: float = 0.1, inertia: float = 1e-4
) -> BondGraph:
    """Propeller at the bollard: thrust with the square of the speed, behind a first-order lag.

    ``M = J domega/dt + k_M |omega| omega``, ``tau dT/dt + T = ratio k_M |omega| omega``, ``F = T``:
    the flow takes time to form. Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control,
    2011, chapter 9. Ports ``shaft`` (N m), ``hull`` (N, pushed). Parameters ``c_2_load`` (``k_M``,
    N m s^2), ``ratio`` (thrust over torque, 1/m), ``tau`` (s), ``J`` (kg m^2).
    """
    with BondGraph("propeller") as g:
        arm, tau = g.parameter("ratio", thrust / torque, "1/m"), g.parameter("tau", lag, "s")
        shaft, wake, hull = One("blades"), Zero("wake"), One("hub")
        (
            Port("shaft", unit="N*m")
            >> shaft
            >> R("load", sp.S.Zero, law=QuadraticDrag(torque, "N*m*s2"))
        )
        shaft >> I("J", inertia, unit="kg*m^2")
        MSf("formed", arm * effort("load")) >> wake
        wake >> C("memory", tau)
        wake >> R("decay", sp.S.One)
        MSe("thrust", effort("decay")) >> hull >> Port("hull", unit="N")
    return g


COMPONENTS = ComponentLibrary(
    "components",
    {
        f.__name__: f
        for f in (
            mass_spring_damper,
            two_mass_oscillator,
            rc_section,
            lc_section,
            electrical_transformer,
            dc_motor,
            voice_coil,
            elastic_gearbox,
            rack_and_pinion,
            hydraulic_cylinder,
            hydraulic_line,
            thermal_section,
            warburg,
            propeller,
        )
    },
)
"""All components of this file."""
