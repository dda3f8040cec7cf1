"""Exact derivatives of a program for the Newton steps of an export."""

from __future__ import annotations

from typing import Any

from bondgraph.equations.program import Program


def linearised(program: Program, name: str = "linearised") -> Any:
    """Return ``(t, x, z, u, p, m, h) -> d(dx, g)/d(x, z)``, dense, SX.

    Shape (n_x + n_z, n_x + n_z).
    """
    return _slopes(program, name, with_states=True)


def slope_of_residual(program: Program, name: str = "slope_of_residual") -> Any:
    """Return ``(t, x, z, u, p, m, h) -> dg/dz``, dense, SX, shape (n_z, n_z)."""
    return _slopes(program, name, with_states=False)


def _slopes(program: Program, name: str, with_states: bool) -> Any:
    import casadi as ca

    f = program.rhs
    v = [ca.SX.sym(f.name_in(i), *f.size_in(i)) for i in range(f.n_in())]
    rows, columns = program.residual(*v), v[2]
    if with_states:
        rows, columns = ca.vertcat(f(*v)[0], rows), ca.vertcat(v[1], v[2])
    matrix = ca.densify(ca.jacobian(rows, columns))
    return ca.Function(name, v, [matrix], ["t", "x", "z", "u", "p", "m", "h"], ["matrix"])
