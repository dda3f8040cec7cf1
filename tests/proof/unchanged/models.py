"""Small textbook models of the recordings of this proof; for ``--model models:NAME``."""

from __future__ import annotations

from vocabulary import (  # type: ignore[import-not-found]
    TF,
    BondGraph,
    C,
    De,
    Df,
    Dq,
    I,
    One,
    R,
    Se,
    Sf,
    Zero,
)


def positioner(law: object = None, stiffness_law: object = None) -> BondGraph:
    """Return a mass on a spring; reads its position."""
    with BondGraph("positioner") as g:
        body = One("body")
        Se("F", unit="N") >> body >> I("m", 0.5, unit="kg")
        body >> R("d", 4.0, unit="N*s/m", law=law)
        body >> C("k", stiffness=2e3, unit="N/m", law=stiffness_law)
        body >> Dq("x", unit="m")
    return g


def rough_positioner() -> BondGraph:
    """Return the positioner with wrong values."""
    with BondGraph("rough_positioner") as g:
        body = One("body")
        Se("F", unit="N") >> body >> I("m", 0.4, unit="kg")
        body >> R("d", 5.0, unit="N*s/m")
        body >> C("k", stiffness=1.7e3, unit="N/m")
        body >> Dq("x", unit="m")
    return g


def damper() -> BondGraph:
    """Return a viscous damper pushed with a velocity; reads the force."""
    with BondGraph("damper") as g:
        node = Zero("node")
        node >> Sf("v", unit="m/s")
        node >> R("c", 1e3, unit="N*s/m")
        node >> De("F", unit="N")
    return g


def pushed_damper() -> BondGraph:
    """Return the viscous damper whose force counts with the velocity."""
    with BondGraph("pushed_damper") as g:
        node = Zero("node")
        Sf("v", unit="m/s") >> node
        node >> R("c", 1e5, unit="N*s/m")
        node >> De("F", unit="N")
    return g


def carriage() -> BondGraph:
    """Return a driven mass with viscous friction; reads the velocity."""
    with BondGraph("carriage") as g:
        body = One("body")
        Se("F", unit="N") >> body >> I("m", 20.0, unit="kg")
        body >> R("c", 60.0, unit="N*s/m")
        body >> Df("v", unit="m/s")
    return g


def motor() -> BondGraph:
    """Return a motor of first order, voltage to speed; the inertia is the gauge."""
    with BondGraph("motor") as g:
        shaft = One("shaft")
        Se("u", unit="V") >> shaft >> I("J", 0.1, fixed=True)
        shaft >> R("b", 0.02)
        shaft >> Df("w")
    return g


def drives() -> BondGraph:
    """Return two inertias on an elastic belt; the motors' inertia is the gauge."""
    with BondGraph("drives") as g:
        motors, pulley = One("motors"), One("pulley")
        belt, stretch = Zero("belt"), One("stretch")
        Se("u", unit="V") >> TF("K", ratio=0.05) >> motors
        motors >> I("J_m", 1.0, fixed=True)
        motors >> R("b_m", 7.0)
        motors >> belt >> pulley
        belt >> stretch >> C("k_b", stiffness=60.0)
        stretch >> R("d_b", 0.01)
        pulley >> I("J_p", 0.16)
        pulley >> R("b_p", 0.6)
        pulley >> Df("y", unit="1")
    return g


def capacitor() -> BondGraph:
    """Return a linear capacitor for each area; reads the polarisation."""
    with BondGraph("capacitor") as g:
        disc = One("disc")
        Se("V_in", unit="V") >> disc
        disc >> R("R_e", 37.0, unit="ohm*m2", fixed=True)
        disc >> C("C_p", 2.7e-5, unit="F/m2")
        disc >> Dq("P", unit="C/m2")
    return g


def ball() -> BondGraph:
    """Return a ball that rolls on a beam, the tilt as the effort; reads the position."""
    with BondGraph("ball") as g:
        rolling = One("rolling")
        Se("a", unit="rad") >> rolling >> I("m", 0.14)
        rolling >> R("d", 0.01)
        rolling >> Dq("x", unit="m")
    return g
