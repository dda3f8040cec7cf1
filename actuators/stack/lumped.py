"""The nonlinear lumped-parameter model of a piezo stack (thesis eq. 5.1; Goldfarb, Celanovic).

``V_in = V_h + V_t`` with a hysteretic store ``V_h = H(q)`` in the electrical loop and
``q = T x + C V_t`` behind it; the body obeys ``m x'' + b x' + k x = T V_t + F_e``.
"""

from __future__ import annotations

from bondgraph import TF, BondGraph, C, Df, Dq, GraphError, I, One, R, Se, Zero
from bondgraph.laws import Law

TABLE = "P-840.1, thesis table 6.1"
T_SOURCE = f"{TABLE}; with the Maxwell elements of table 6.4 the loop asks for 3.83 N/V"
C_SOURCE = f"{TABLE} (1.5 uC/V); the data sheet's free capacitance, clamped C - T^2/k = 1.309 uF"
M_SOURCE = "a third of the 16 g of the ceramics: fixed at one end, it moves like 5.33 g at the tip"


def stack_lumped(
    law: Law | None = None,
    *,
    capacitance: float = 1.5e-6,
    transducer: float = 3.52,
    stiffness: float = 65e6,
    mass: float = 16e-3 / 3.0,
    damping: float = 80.0,
    resistance: float | None = None,
    sensors: tuple[str, ...] = ("x",),
    external_force: bool = False,
) -> BondGraph:
    """Piezo stack as lumped parameters, with any law ``V_h = H(q)`` in the electrical loop.

    Without `resistance` the source and the two electrical stores form a voltage loop: ``H`` has
    derivative causality and the charge is ``q = (I + C H)^-1 [C V_in + T x]``.

    Parameters
    ----------
    law : Law, optional
        Law of the hysteretic store, voltage (V) from charge (C), such as
        ``Hysteretic(MaxwellResistiveCapacitor.stack_2hz())``; left out: the linear model.
    capacitance : float
        F.
    transducer : float
        ``T``: force from voltage, N/V, and charge from displacement, C/m.
    stiffness : float
        Short-circuit stiffness, N/m.
    mass : float
        Effective moved mass (a third of the ceramics), kg.
    damping : float
        N s/m.
    resistance : float, optional
        Of the leads and the amplifier output, ohm; with it every store is free.
    sensors : tuple of {"x", "i"}
        Displacement and current; the current needs a resistance.
    external_force : bool
        Add the input ``F_e`` that pushes the body.

    Returns
    -------
    BondGraph
        States ``q_k`` (the displacement ``x``) and ``p_m``; with a resistance also ``q_C`` and,
        with a law, ``q_H``.

    Raises
    ------
    GraphError
        The current is asked for without a resistance.

    Examples
    --------
    >>> sorted(stack_lumped().parameters)
    ['C', 'T', 'b', 'k', 'm']
    """
    if "i" in sensors and resistance is None:
        raise GraphError(
            "stack_lumped: without a resistance the current i is the derivative of a charge that "
            "the source imposes; give resistance= (the amplifier's output and the leads, ohm)"
        )
    with BondGraph("stack_lumped") as g:
        t = g.parameter("T", transducer, "N/V", spread=2.0, source=T_SOURCE)
        loop, clamp, body = One("loop"), Zero("clamp"), One("body")
        Se("V_in", unit="V") >> loop
        if resistance is not None:
            loop >> R(
                "R_e", resistance, unit="ohm", spread=3.0, source="leads and amplifier output"
            )
        loop >> clamp >> C("C", capacitance, unit="F", spread=2.0, source=C_SOURCE)
        if law is not None:
            loop >> C("H", law=law, unit="F", source="thesis table 6.4 for the Maxwell elements")
        clamp >> TF("T_em", ratio=1 / t) >> body
        if external_force:
            Se("F_e", unit="N") >> body
        body >> I("m", mass, unit="kg", spread=2.0, source=M_SOURCE)
        body >> R("b", damping, unit="N*s/m", spread=10.0, source=TABLE)
        body >> C("k", stiffness=stiffness, unit="N/m", spread=2.0, source=TABLE)
        if "i" in sensors:
            loop >> Df("i", unit="A")
        if "x" in sensors:
            body >> Dq("x", unit="m")
    return g
