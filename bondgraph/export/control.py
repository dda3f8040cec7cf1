"""Program -> python-control: a linear or a nonlinear system that keeps all names."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from bondgraph.equations.program import Program
from bondgraph.export.linear import LinearModel, linear_model
from bondgraph.signals.files.checks import optional
from bondgraph.support.errors import UnusableInput, unknown_name
from bondgraph.support.ops import FloatArray


def to_control(program: Program) -> Any:
    """Return a linear `program` at its nominal parameters as ``control.StateSpace``.

    Names of states, inputs and outputs are kept. Mind that ``control.linearize`` drops names
    unless told ``copy_names=True``.

    Raises
    ------
    UnusableInput
        It is not linear or has memory (see `linear_model`), or python-control is not installed.
    """
    m = linear_model(program)
    return optional("control", "to_control", "control").StateSpace(
        m.a, m.b, m.c, m.d, name=_system_name(m.name),
        states=list(m.states), inputs=list(m.inputs), outputs=list(m.outputs),
        remove_useless_states=False,
    )  # fmt: skip


def to_nonlinear_control(program: Program) -> Any:
    """Return `program` as ``control.NonlinearIOSystem``; algebraic unknowns are solved inside.

    Its ``params`` are the parameters at nominal values, to be changed by name. Newton's method
    starts from ``program.guess`` at every call, so a result never depends on the calls before.

    Raises
    ------
    UnusableInput
        A law has memory, or python-control is not installed.
    UnknownName
        When called with a parameter the model does not have.
    """
    if program.has_memory:
        names = ", ".join(c.element for c in program.laws if c.law.n_memory)
        raise UnusableInput(
            f"{program.name}: {names} has memory, which changes at accepted steps only, and a "
            "NonlinearIOSystem has continuous states only; casadi_functions(program), the NumPy, C "
            "and FMU exports and bondgraph.simulate carry it"
        )
    evaluate = _Evaluation(program)
    return optional("control", "to_nonlinear_control", "control").NonlinearIOSystem(
        evaluate.rates, evaluate.readings, name=_system_name(program.name),
        states=list(program.states), inputs=list(program.inputs), outputs=list(program.outputs),
        params=dict(zip(program.parameters, program.nominal, strict=True)),
    )  # fmt: skip


def control_module(program: Program) -> str:
    """Return a Python module whose ``system()`` builds the ``control.StateSpace`` of `program`.

    It needs python-control and nothing of this project; numbers read back to the same bits.

    Raises
    ------
    UnusableInput
        It is not linear or has memory; see `linear_model`.
    """
    m = linear_model(program)
    title = " ".join(ascii(m.name)[1:-1].replace('"', "'").replace("\\", "/").split())
    lines = [
        f'"""Linear state space of {title}, SI units; by Bondsight (pip install control)."""',
        "",
        "import control",
        "",
        f"NAME = {_system_name(m.name)!a}",
        *(f"{k} = {_names(v)}" for k, v in _lists(m).items()),
        *(f"{k.upper()} = {getattr(m, k).tolist()!r}" for k in "abcd"),
        "",
        "",
        "def system():",
        '    """Return the control.StateSpace with the names of its states, inputs, outputs."""',
        "    return control.StateSpace(",
        "        A, B if STATES else [], C if STATES else [], D, name=NAME,",
        "        states=STATES, inputs=INPUTS, outputs=OUTPUTS, remove_useless_states=False,",
        "    )",
    ]
    return "\n".join(lines) + "\n"


def _lists(m: LinearModel) -> dict[str, tuple[str, ...]]:
    return {"STATES": m.states, "INPUTS": m.inputs, "OUTPUTS": m.outputs}


def _names(names: tuple[str, ...]) -> str:
    return "[" + ", ".join(ascii(n) for n in names) + "]"


def _system_name(name: str) -> str:
    """Return the name as python-control takes it: a dot means a subsystem there."""
    return name.replace(".", "_")


class _Evaluation:
    """Rates and readings as python-control calls them; no state between calls."""

    def __init__(self, program: Program) -> None:
        import casadi as ca

        from bondgraph.export.casadi_function import casadi_functions

        self._rhs = casadi_functions(program).rhs
        self._names = program.parameters
        self._where = program.name
        self._nothing = ca.DM(0, 1)
        self._guess = ca.DM(program.guess) if program.guess else self._nothing

    def rates(self, t: float, x: FloatArray, u: FloatArray, params: Mapping[str, float]) -> Any:
        """Return dx/dt, shape (n_x,)."""
        return self._call(t, x, u, params)[0].full().ravel()

    def readings(self, t: float, x: FloatArray, u: FloatArray, params: Mapping[str, float]) -> Any:
        """Return y, shape (n_y,)."""
        return self._call(t, x, u, params)[1].full().ravel()

    def _call(self, t: float, x: FloatArray, u: FloatArray, params: Mapping[str, float]) -> Any:
        for name in params.keys() - set(self._names):
            raise unknown_name("parameter", name, self._where, self._names)
        p = [params[n] for n in self._names] or self._nothing
        found: Any = self._rhs(t, x, u, p, self._nothing, 0.0, self._guess)
        return found
