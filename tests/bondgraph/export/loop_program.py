"""A program with an algebraic unknown, written by hand: a cubic resistor in a loop."""

from __future__ import annotations

import casadi as ca
import sympy as sp

from bondgraph.equations.program import Program, ProgramStep


def cubic_loop(cubic: float = 1.0, linear: float = 1.0) -> Program:
    """``dx/dt = -x + z``, ``0 = b z + k z^3 - x - u``, ``y = z``."""
    labels = ["t", "x", "z", "u", "p", "m", "h"]
    sizes = {"p": 2, "m": 0}
    v = [ca.SX.sym(n, sizes.get(n, 1)) for n in labels]
    _, x, z, u, p, _, _ = v
    xs, zs, us, k, b = (sp.Symbol(n, real=True) for n in ("x", "z", "u", "k", "b"))
    return Program(
        name="cubic_loop",
        states=("x",),
        algebraic=("z",),
        inputs=("u",),
        parameters=("k", "b"),
        memory=(),
        outputs=("y",),
        input_rates=(),
        units={"x": "C", "z": "A", "u": "V"},
        nominal=(cubic, linear),
        start=(0.0,),
        guess=(0.0,),
        virgin=(),
        steps=(
            ProgramStep("e_loop", b * zs + k * zs**3 - xs - us, None, "sum of efforts at loop"),
        ),
        laws=(),
        rates=(zs - xs,),
        readings=(zs,),
        residuals=(sp.Symbol("e_loop", real=True),),
        rhs=ca.Function("rhs", v, [z - x, z], labels, ["dx", "y"]),
        residual=ca.Function("residual", v, [p[1] * z + p[0] * z**3 - x - u], labels, ["g"]),
        advance=ca.Function("advance", v, [ca.SX(0, 1)], labels, ["m_next"]),
    )
