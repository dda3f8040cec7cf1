"""One accepted step of a model as a CasADi function: states integrated, memory advanced."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import casadi as ca

from bondgraph.support.errors import UnusableInput

if TYPE_CHECKING:
    from bondgraph.export.casadi_function import CasadiModel


def step_function(
    model: CasadiModel,
    interval: float,
    plugin: str = "cvodes",
    options: Mapping[str, Any] | None = None,
) -> ca.Function:
    """Return ``(t, x, u, u_next, p, m, z_guess) -> (x_next, m_next, y, z)`` over `interval`.

    Inputs are linear from `u` to `u_next`; the memory is that of the start of the step, and the
    reading `y` is that of its end. A whole record runs compiled by ``mapaccum`` (see
    `CasadiModel.step`).

    Parameters
    ----------
    model : CasadiModel
    interval : float
        Length of the step, s.
    plugin : str
        Integrator of CasADi. ``"idas"`` and ``"collocation"`` keep algebraic unknowns open, the
        others have them solved at every evaluation. IDAS can refuse to correct a start that is
        consistent to rounding (``IDA_LINESEARCH_FAIL``), and from an uncorrected one
        (``{"calc_ic": False}``) it bears moderate tolerances only; the others do not mind.
    options : mapping, optional
        Of the integrator, such as ``{"abstol": 1e-12, "reltol": 1e-9}``.

    Raises
    ------
    UnusableInput
        The interval is not positive.
    """
    if not interval > 0.0:
        raise UnusableInput(
            f"{model.names.name}: a step of {interval} s goes nowhere; give a positive interval"
        )
    t, x, z, u, p, m, _ = model.equations.mx_in()
    u_next = ca.MX.sym("u_next", u.shape[0])
    guess = ca.MX.sym("z_guess", z.shape[0])
    end, guess_end = x, guess
    if model.names.states:
        first = model.rhs(t, x, u, p, m, 0, guess)[2]
        given = ca.vertcat(t, u, u_next, p, m)
        solver = _integrator(model, interval, plugin, dict(options or {}))
        run = solver(x0=x, z0=first, p=given) if _keeps_z(solver) else solver(x0=x, p=given)
        end, guess_end = run["xf"], run["zf"] if _keeps_z(solver) else first
    at_end = (t + interval, end, u_next, p, m, interval, guess_end)
    _, y, z_end = model.rhs(*at_end)
    return ca.Function(
        "step",
        [t, x, u, u_next, p, m, guess],
        [end, model.advance(*at_end[:-1], z_end), y, z_end],
        ["t", "x", "u", "u_next", "p", "m", "z_guess"],
        ["x_next", "m_next", "y", "z"],
    )


def _keeps_z(solver: ca.Function) -> bool:
    return bool(solver.size1_in("z0"))


def _integrator(
    model: CasadiModel, interval: float, plugin: str, options: dict[str, Any]
) -> ca.Function:
    """Integrator over local time with the inputs linear in it; z open for idas and collocation."""
    opened = bool(model.names.algebraic) and plugin in ("idas", "collocation")
    kind: Any = ca.SX if opened or not model.names.algebraic else ca.MX
    shapes = {n: model.equations.size_in(n) for n in ("t", "x", "z", "u", "p", "m")}
    v: dict[str, Any] = {n: kind.sym(n, *s) for n, s in shapes.items()}
    last, tau = kind.sym("u_next", *shapes["u"]), kind.sym("tau")
    now = v["u"] + (last - v["u"]) * (tau / interval)
    given = ca.vertcat(v["t"], v["u"], last, v["p"], v["m"])
    problem = {"t": tau, "x": v["x"], "p": given}
    at = v["t"] + tau
    if kind is ca.SX:
        dx, _, g = model.equations(at, v["x"], v["z"], now, v["p"], v["m"], tau)
        problem |= {"ode": dx} | ({"z": v["z"], "alg": g} if opened else {})
    else:
        guess = ca.DM(model.names.guess)
        problem["ode"] = model.rhs(at, v["x"], now, v["p"], v["m"], tau, guess)[0]
    return ca.integrator("integrate", plugin, problem, 0.0, interval, options)
