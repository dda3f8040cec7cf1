"""The general bond graph model of a piezo stack, corrected (thesis eq. 5.3 and 5.4).

Electrical loop, polarisation and body: ``E_C = C_nl(p)`` holds all dielectric behaviour, the
transducer ``T_2`` couples with ``E_2 = -F T / l`` so that the model creates no power.
"""

from __future__ import annotations

from bondgraph import TF, BondGraph, C, Df, Dq, I, One, R, Se, Zero
from bondgraph.laws import Law

SOURCE = (
    "P-840.1, thesis tables 3.1 and 6.2; T in m/C from x/q so that charge, resonance and "
    "short-circuit stiffness are physical (the printed 3.52 is N/V of the other model)"
)


def stack_bond_graph(
    law: Law | None = None,
    *,
    capacitance: float = 1.65e-6,
    transducer: float = 0.0327,
    stiffness: float = 65e6,
    mass: float = 5.3e-3,
    damping: float = 80.0,
    resistance: float = 5.0,
    length: float = 18e-3,
    sensors: tuple[str, ...] = ("x",),
    external_force: bool = False,
) -> BondGraph:
    """Piezo stack as a general bond graph, ``C_nl`` linear or with any operator.

    Parameters
    ----------
    law : Law, optional
        Law ``E = C_nl(p)`` of the polarisation, field (V/m) from dipole (C m).
    capacitance : float
        Capacitance at zero force, F; the linear coefficient of ``C_nl`` is ``C l^2``.
    transducer : float
        ``T = x / q`` of the free stack, m/C.
    stiffness : float
        Open-circuit stiffness, N/m.
    mass : float
        Effective moved mass (a third of the ceramics), kg.
    damping : float
        N s/m.
    resistance : float
        Of the leads and the amplifier output, ohm.
    length : float
        Stack length, m. A gauge choice: it scales dipole and field only.
    sensors : tuple of {"x", "i"}
        Displacement and current.
    external_force : bool
        Add the input ``F_e`` that pushes the body.

    Returns
    -------
    BondGraph
        States ``q_C_nl`` (dipole), ``q_k`` (elongation of the spring), ``p_m`` (momentum); the
        position is ``q_k + (T / l) q_C_nl``.

    Examples
    --------
    >>> stack = stack_bond_graph()
    >>> sorted(stack.parameters)
    ['C_nl', 'R_e', 'R_nl', 'T', 'k', 'l', 'm']
    >>> equations(stack).states
    ('q_C_nl', 'q_k', 'p_m')
    """
    with BondGraph("stack_bond_graph") as g:
        ell = g.parameter("l", length, "m", fixed=True, source="gauge: scales dipole and field")
        t = g.parameter("T", transducer, "m/C", spread=10.0, source=SOURCE)
        loop, polarisation = One("loop"), One("polarisation")
        force, body = Zero("force"), One("body")
        Se("V_in", unit="V") >> loop
        loop >> R("R_e", resistance, unit="ohm", spread=3.0, source=SOURCE)
        loop >> TF("T_1", ratio=ell) >> polarisation
        linear = None if law is not None and law.slope is not None else capacitance * length**2
        polarisation >> C("C_nl", linear, unit="C*m/(V/m)", spread=3.0, law=law, source=SOURCE)
        body >> force >> TF("T_2", ratio=ell / t) >> polarisation
        force >> C("k", stiffness=stiffness, unit="N/m", spread=2.0, source=SOURCE)
        if external_force:
            Se("F_e", unit="N") >> body
        body >> I(
            "m", mass, unit="kg", spread=2.0, source="a third of the ceramics, and the payload"
        )
        body >> R("R_nl", damping, unit="N*s/m", spread=10.0, source=SOURCE)
        if "i" in sensors:
            loop >> Df("i", unit="A")
        if "x" in sensors:
            body >> Dq("x", unit="m")
    return g
