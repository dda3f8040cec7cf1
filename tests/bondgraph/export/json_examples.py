"""Graphs and laws that hold everything that a document can."""

from __future__ import annotations

import jsonschema
import sympy as sp

from bondgraph import BondGraph
from bondgraph.export.graph_json.schema import graph_schema
from bondgraph.graph import elements as el
from bondgraph.graph.drives import Drive
from bondgraph.graph.modulation import TIME, displacement, effort, external, port_variables
from bondgraph.graph.sensors import Da, De, Df, Dq, Reading
from bondgraph.laws import (
    Ageing,
    AsymmetricCoulomb,
    AsymmetricDamping,
    Backlash,
    Bilinear,
    BoucWenMemory,
    ContactLoss,
    Coulomb,
    CurrentLimit,
    DahlFriction,
    DeadZone,
    DigressiveDamping,
    Diode,
    EndStop,
    FrictionAlongWay,
    FrictionUnderLoad,
    Gravity,
    GrowingDamping,
    HuntCrossley,
    Hysteretic,
    Law,
    LawSum,
    LettingGo,
    LuGre,
    Magnet,
    MaxwellSlip,
    NonlinearResistance,
    Odometer,
    Onset,
    Orifice,
    Overflow,
    Parametrised,
    Periodic,
    PiecewiseLinear,
    Polynomial,
    Push,
    QuadraticDrag,
    Radiation,
    Rectifier,
    Rounding,
    SaturatingInductance,
    Saturation,
    SelfHeating,
    SlewLimit,
    Sliding,
    StopSum,
    Stribeck,
    TableLaw,
    TimedSlope,
    Tone,
    Viscous,
    WarmUp,
    Wrapping,
)
from tests.bondgraph.hysteresis.examples import EXAMPLES

VALIDATOR = jsonschema.Draft202012Validator(graph_schema())
LAW_EXAMPLES: dict[str, Law] = {
    "coulomb": Coulomb(0.1 + 0.2, "N"),
    "stribeck": Stribeck(2.0, 0.5, 3e-3),
    "viscous": Viscous(4.0),
    "quadratic_drag": QuadraticDrag(5.0, "N*s2/m2"),
    "orifice": Orifice(0.02, 3.0, "m/s", "N"),
    "lugre": LuGre(1.0, 0.3, 1e-3, 2e5, 7.0),
    "saturation": Saturation(-3.0, 4.0, 0.125),
    "dead_zone": DeadZone(0.1, 0.2, 2.0),
    "unnamed_curve": PiecewiseLinear((-2.0, -0.5, 0.5, 1.75), 3.0, "V"),
    "polynomial": Polynomial(0.1, 1.5, 2.0, (2, 3, 5)),
    "rectifier": Rectifier(0.7),
    "rounding": Rounding(0.3, 0.05, 0.8, "V"),
    "slew_limit": SlewLimit(0.02, 0.01, "s/V"),
    "sliding": Sliding(EXAMPLES["dahl"]),
    "prandtl_ishlinskii": StopSum((0.1, 1.0), 0.2, 3.0, -1.0),
    "table": TableLaw((0.0, 1.0, 3.0), (0.0, 2.0, 2.5), "pchip", False, True, 0.7, "V"),
    "operator": Hysteretic(EXAMPLES["cascade of all"]),
    "backlash": Backlash(
        stiffness=3.0,
        inverse=True,
        stiffness_unit="m/N",
        width=0.2,
        centre=-0.1,
        size=2.0,
        unit="rad",
    ),
    "bilinear": Bilinear(0.3, -0.2, 5.0, 2.0, "rad", "N*m/rad"),
    "contact_loss": ContactLoss(stiffness=2.0, depth=0.1, size=3.0, edge=1.0, side=-1.0),
    "end_stop": EndStop(20.0, -0.3, 0.4, "low", 0.5, "rad", "N*m/rad"),
    "overflow": Overflow(inverse=True, depth=0.3, size=0.2, top=2.0),
    "periodic_force": Periodic(0.3, 2.0, 4.0, "N*m", "rad"),
    "odometer": Odometer(),
    "dahl": DahlFriction(0.4, 2e-3, "N*m", "rad"),
    "asymmetric_damping": AsymmetricDamping(-0.2, 3.0, "N*m*s/rad"),
    "digressive_damping": DigressiveDamping(stiffness=2.0, difference=0.3, flow=0.2),
    "asymmetric_coulomb": AsymmetricCoulomb(0.3, 0.2, "N*m"),
    "coulomb_along_way": FrictionAlongWay("q_k", 0.3, 0.1, 2.0, "N*m", "rad"),
    "coulomb_under_load": FrictionUnderLoad("e_F", 0.3, 0.05, "N", "N/Pa"),
    "letting_go": LettingGo("q_k", "", 2.0, 0.2, -0.1, 0.02, 3.0, "N*m*s/rad", "rad"),
    "maxwell_slip": MaxwellSlip((0.1, 0.3), 2.0, 0.4, 0.02, "N*m", "rad/s", "rad", "ways"),
    "nonlinear_resistance": NonlinearResistance(0.3, 2.0, "Pa", "m3/s"),
    "radiation": Radiation(0.4, 310.0, resistance=2.0),
    "magnet": Magnet(-0.3, -0.02, 0.01, 2.0, False, "N*m", "rad"),
    "saturating_inductance": SaturatingInductance(3.0, 0.2),
    "current_limit": CurrentLimit(low=-0.2, high=0.3, unit="mA"),
    "diode": Diode(share=0.2, onset=0.3, width=0.1, sense=-1.0, unit="mA"),
    "bouc_wen": BoucWenMemory(0.4, 2.0, -1.5, 3.0, "N*m/rad", 0.3),
    "hunt_crossley": HuntCrossley(
        5e3, -0.3, 0.2, "low", 0.3, "rad", "N*m/rad", loss=0.4, slowness=0.2, loss_unit="s/rad"
    ),
    "gravity": Gravity(2.0, 3.0, False, "mN*m"),
    "growing_damping": GrowingDamping(0.1, 0.3, 0.2, 2.0, "N*m*s/rad3", "rad"),
    "self_heating": SelfHeating(-0.1, 3.0, 0.2),
    "tone": Tone(7.0, 0.05, 3.0, "V", False),
    "warm_up": WarmUp(3.0, 0.2, "V"),
    "onset": Onset(2.0, 0.1, 0.3, 4.0, "V", True, False),
    "push": Push(2.0, 0.1, 0.3, 4.0, "V", True, False, 3.0),
    "ageing": Ageing(30.0, 0.2, "N/m"),
    "timed_slope": TimedSlope(Tone(7.0, 0.05, 3.0, "N/m", False)),
    "wrapping": Wrapping(2.5, -0.1),
    "sum": LawSum((StopSum((0.1,), rated=True, speed=2.0), Polynomial(0.1, orders=(3, 5)))),
    "lifted": Parametrised(Polynomial(0.1, 1.5, 2.0), ("centre", "half")),
}


def every_element() -> BondGraph:
    """A graph (of no physical meaning) with every class and every field off its default."""
    with BondGraph("every element, \N{GREEK SMALL LETTER MU} 'quoted' \"twice\"") as g:
        a = g.parameter("a", 0.1 + 0.2, "V/m", lower=1e-300, upper=5, scale=3.0, source="sheet")
        b = g.parameter("b", -2.0, positive=False, fixed=True, spread=2.5)
        g.parameter("tau", 1e-3, "s")
        q1, q2 = port_variables("q", 2)
        x = displacement("spring")
        el.Zero("zero")
        el.One("one_junction")
        el.X0("switched", on=False)
        el.X1("switched_too")
        el.Se("V", unit="V", drive=Drive(Saturation(), "tau", "tau"), offset="b", gain="a")
        el.Sf("Q", unit="m3/s", drive=Drive(lag="tau"), measured=True, given="rate")
        el.MSe("gravity", value=a * sp.cos(x) + external("command") ** 2 * TIME)
        el.MSf("pump", unit="m3/s", value=sp.Max(effort("V"), 0, b) / sp.pi)
        el.R("R_1", 5, unit="ohm", fixed=True, spread=1.5, source="line\nbreak")
        el.C("spring", stiffness=a / 3, unit="N/m", law=LAW_EXAMPLES["polynomial"])
        el.C("C_1", sp.Symbol("a", positive=True))
        el.I("mass", "a")
        el.I("gyrating", sp.Symbol("R_1", positive=True) * sp.Rational(2, 3))
        el.TF("lever", ratio=a**b, unit="1")
        el.GY("motor", 1.5, spread=3.0)
        el.MTF("cam", ratio=sp.sin(x) * sp.exp(-x / a) + sp.E)
        el.MGY("dynamo", ratio=sp.Piecewise((a, x < 0), (sp.tanh(x), x <= b), (1, True)))
        el.RE("reaction", 0.25)
        el.RS("heater", 7.0, heat="entropy")
        el.CField("plates", energy=q1**2 / (2 * a) * (1 + q2), units=("V", "N"), ports=2)
        el.IField("coils", matrix=((2.0, "a"), (b * a, 3)), ports=2)
        el.RField("valves", law=(sp.Symbol("f1", real=True) * a, sp.sqrt(a), 0), ports=3)
        De(
            "voltage",
            unit="V",
            law=DeadZone(),
            lag="tau",
            delay="tau",
            clock="b",
            gain="a",
            drift=("b", "a"),
            natural_frequency=a * 2,
            damping_ratio=0.7,
            offset="b",
            resolution=0.25,
        )
        Df("current", unit="A")
        Dq("position", unit="m")
        Da("shake", unit="m/s^2")
        Reading("force", effort("spring") - a, unit="N")
        for tail, head in (("V", "one_junction"), ("one_junction", "lever"), ("lever", "zero")):
            g.bond(g[tail], g[head])
        g.bond(g["zero"], g["plates"])
        g.bond(g["one_junction"], g["plates"])
    return g


def assert_same(a: BondGraph, b: BondGraph) -> None:
    assert (a.name, a.bonds) == (b.name, b.bonds)
    assert list(a.elements) == list(b.elements)
    for name, e in a.elements.items():
        other = b.elements[name]
        assert type(other) is type(e)
        assert other == e
        assert repr(other) == repr(e)
    assert a.parameters == b.parameters
    assert repr(a.parameters) == repr(b.parameters)
