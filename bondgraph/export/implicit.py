"""Algebraic unknowns solved inside a CasADi function, on the scale the equations have."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca

TOLERANCE = 1e-12
ROUNDING = 1e-15
ITERATIONS = 100
PASSES = 2  # a wild first step gives a wrong size; the second pass starts at the solution


def solve_algebraic(residual: ca.Function, z_guess: ca.MX, known: Sequence[ca.MX]) -> ca.MX:
    """Return z with ``residual(t, x, z, u, p, m, h) = 0``, by CasADi's Newton with line search.

    CasADi compares residuals with an absolute tolerance, which means nothing for newtons beside
    microcoulombs. The residuals are therefore multiplied by the inverse of their Jacobian at the
    guess, and z is measured in its own size: that of the guess and of the first Newton step, not
    less than what the rounding of the residuals allows.

    Parameters
    ----------
    residual : casadi.Function
        ``(t, x, z, u, p, m, h) -> g``, SX, shape (n_z,).
    z_guess : casadi.MX, shape (n_z,)
        Its Jacobian must be regular there.
    known : sequence of casadi.MX
        t, x, u, p, m, h.

    Returns
    -------
    casadi.MX, shape (n_z,)
        Evaluation raises where Newton's method does not converge.
    """
    n_z = residual.size1_in(2)
    if not n_z:
        return ca.MX(0, 1)
    v = [ca.SX.sym(residual.name_in(i), *residual.size_in(i)) for i in range(residual.n_in())]
    t, x, z, u, p, m, h = v
    g = residual(*v)
    slope = ca.densify(ca.jacobian(g, z))
    others = ca.vertcat(x, z, u)
    terms = ca.fabs(ca.jacobian(g, others)) @ ca.fabs(others)
    at_guess = ca.Function("at_guess", v, [g, slope, terms])
    zeta, m0, d = ca.SX.sym("zeta", n_z), ca.SX.sym("inverse", n_z, n_z), ca.SX.sym("size", n_z)
    scaled = (m0 @ residual(t, x, d * zeta, u, p, m, h)) / d
    given = ca.vertcat(t, x, u, p, m, h, ca.vec(m0), d)
    solver = ca.rootfinder(
        "solve_z",
        "newton",
        {"x": zeta, "p": given, "g": scaled},
        {"abstol": TOLERANCE, "abstolStep": TOLERANCE, "max_iter": ITERATIONS},
    )

    found = z_guess
    for _ in range(PASSES):
        first, j, rounding = at_guess(*known[:2], found, *known[2:])
        inverse = ca.solve(j, ca.MX.eye(n_z), "qr")
        floor = ROUNDING / TOLERANCE * (ca.fabs(inverse) @ rounding)
        size = ca.fabs(found) + ca.fabs(inverse @ first) + floor + 1e-300
        values = ca.vertcat(*known, ca.vec(inverse), size)
        found = size * solver(x0=found / size, p=values)["x"]
    return found
