"""The matrices of a linear program, with the proof that it is linear."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bondgraph.support.errors import UnusableInput
from bondgraph.support.ops import FloatArray

if TYPE_CHECKING:
    import casadi as ca

    from bondgraph.equations.program import Program


@dataclass(frozen=True)
class LinearModel:
    """``dx/dt = A x + B u``, ``y = C x + D u`` with the names of x, u and y.

    Attributes
    ----------
    a, b, c, d : ndarray, shapes (n_x, n_x), (n_x, n_u), (n_y, n_x), (n_y, n_u); SI
    states, inputs, outputs : tuple of str
    """

    name: str
    a: FloatArray
    b: FloatArray
    c: FloatArray
    d: FloatArray
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]

    @property
    def system(self) -> Any:
        """The matrices as ``scipy.signal.StateSpace``, which keeps no names.

        ``lsim`` works on the matrices; ``bode``, ``poles`` and ``zeros`` of SciPy go through
        polynomials, which lose all digits when SI values are far apart: python-control does not.
        """
        from scipy import signal

        return signal.StateSpace(self.a, self.b, self.c, self.d)


def linear_model(program: Program) -> LinearModel:
    """Return the matrices of `program` at its nominal parameters; z is eliminated.

    The Jacobian of ``(dx/dt, y, g)`` by ``(x, z, u)`` is derived symbolically with the nominal
    numbers put in. The model is linear exactly if no entry still holds x, z, u or t, no operation
    jumps (the derivative of a sign is zero, too), and all of it is zero at zero. Inputs that are
    rates of others (``d_NAME``) stay inputs of their own.

    Raises
    ------
    UnusableInput
        A law has memory, an equation is not linear or has a constant, the algebraic equations are
        singular, or an entry is not finite; one line says which and what to use instead.
    """
    import casadi as ca

    if program.has_memory:
        names = ", ".join(c.element for c in program.laws if c.law.n_memory)
        raise UnusableInput(
            f"{program.name}: not linear, {names} has memory; casadi_functions(program), the "
            "NumPy, C and FMU exports and bondgraph.simulate carry memory"
        )
    sizes = (len(program.states), len(program.algebraic), len(program.inputs))
    t, h = ca.SX.sym("t"), ca.SX.sym("h")
    x, z, u = (ca.SX.sym(n, size) for n, size in zip("xzu", sizes, strict=True))
    at = (t, x, z, u, ca.SX(ca.DM(program.nominal)), ca.SX(0, 1), h)
    dx, y = program.rhs(*at)
    values = ca.vertcat(dx, y, program.residual(*at))
    v = ca.vertcat(x, z, u)
    jacobian = ca.jacobian(values, v)
    _require_constant(program, values, jacobian, ca.vertcat(t, v, h))
    zeros = ca.DM.zeros(v.numel() + 2)
    numbers = ca.Function("numbers", [ca.vertcat(t, v, h)], [ca.densify(jacobian), values])
    block, rest = (m.full() for m in numbers(zeros))
    _require_finite(program, block)
    _require_homogeneous(program, rest.ravel(), ca.which_depends(values, ca.vertcat(t, h), 1, True))
    return _eliminated(program, block)


def _rows(program: Program) -> tuple[str, ...]:
    rates = (f"the rate of {n}" for n in program.states)
    outputs = (f"the reading {n}" for n in program.outputs)
    return (*rates, *outputs, *(f"the equation for {n}" for n in program.algebraic))


def _require_constant(program: Program, values: ca.SX, jacobian: ca.SX, variables: ca.SX) -> None:
    """Refuse a Jacobian that depends on anything, and values that jump."""
    import casadi as ca

    for i, row in enumerate(_rows(program)):
        if ca.depends_on(jacobian[i, :], variables) or _jumps(values[i], variables):
            raise UnusableInput(
                f"{program.name}: not linear at the nominal parameters, {row} is the first that is "
                "not; in Python use bondgraph.export.control.to_nonlinear_control(program) or "
                "bondgraph.export.casadi_function.casadi_functions(program)"
            )


def _jumps(value: ca.SX, variables: ca.SX) -> bool:
    """Whether an operation is piecewise constant, so that its derivative says nothing."""
    import casadi as ca

    jumping = {
        ca.OP_SIGN, ca.OP_FLOOR, ca.OP_CEIL, ca.OP_FMOD, ca.OP_REMAINDER, ca.OP_COPYSIGN,
        ca.OP_LT, ca.OP_LE, ca.OP_EQ, ca.OP_NE, ca.OP_NOT, ca.OP_AND, ca.OP_OR, ca.OP_IF_ELSE_ZERO,
    }  # fmt: skip
    f = ca.Function("row", [variables], [value])
    return any(f.instruction_id(k) in jumping for k in range(f.n_instructions()))


def _require_homogeneous(program: Program, rest: FloatArray, timed: list[bool]) -> None:
    """Refuse constants and time, which A, B, C, D cannot hold."""
    for row, value, moves in zip(_rows(program), rest, timed, strict=True):
        if value != 0.0 or moves:
            what = "depends on time" if moves else f"is {value:.6g} with all signals at zero"
            raise UnusableInput(
                f"{program.name}: not linear but affine, {row} {what}; make it an input (a "
                "commanded source: Se instead of MSe, Sf instead of MSf), or in Python use "
                "bondgraph.export.control.to_nonlinear_control(program)"
            )


def _require_finite(program: Program, block: FloatArray) -> None:
    """Refuse what nominal parameters of zero or NaN make of the Jacobian."""
    if not np.isfinite(block).all():
        row = _rows(program)[int(np.argwhere(~np.isfinite(block))[0, 0])]
        raise UnusableInput(
            f"{program.name}: {row} is not finite at the nominal parameters; check their values"
        )


def _eliminated(program: Program, block: FloatArray) -> LinearModel:
    """Eliminate z from the constant Jacobian."""
    n_x, n_z, n_y = len(program.states), len(program.algebraic), len(program.outputs)
    top, below = block[: n_x + n_y], block[n_x + n_y :]
    if n_z:
        z = slice(n_x, n_x + n_z)
        if np.linalg.matrix_rank(below[:, z]) < n_z:
            raise UnusableInput(
                f"{program.name}: the equations for {', '.join(program.algebraic)} are singular at "
                "the nominal parameters; check their values"
            )
        top = top - top[:, z] @ np.linalg.solve(below[:, z], below)
        top = np.delete(top, np.arange(n_x, n_x + n_z), axis=1)
    return LinearModel(
        program.name,
        top[:n_x, :n_x],
        top[:n_x, n_x:],
        top[n_x:, :n_x],
        top[n_x:, n_x:],
        program.states,
        program.inputs,
        program.outputs,
    )
