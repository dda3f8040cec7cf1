"""The instructions of a CasADi SX function as plain data, and as expressions of a language.

`tape` reads a function into single assignments, each with a name from a fixed list of operations;
`written` prints them in a `Notation` (such as `PYTHON` of `tape_languages`), folding values that
are used once into the line that uses them. Every operation keeps its order, so the printed text
computes what CasADi computes. `tape_of` reads SymPy in the same way.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import sympy as sp

from bondgraph.support.errors import BondsightError

Operand = str | float
"""A target of an earlier instruction or an input entry (text), or a constant (number)."""

OPERATIONS: Mapping[str, int] = dict.fromkeys(
    "assign neg exp log sqrt sq twice sin cos tan asin acos atan sinh cosh tanh asinh acosh atanh "
    "not floor ceil fabs sign erf inv log1p expm1".split(),
    1,
) | dict.fromkeys(
    "add sub mul div pow constpow lt le eq ne and or fmod copysign if_else_zero fmin fmax atan2 "
    "hypot remainder".split(),
    2,
)
"""Every operation of a tape and its number of operands.

They are CasADi's: ``sq`` a^2, ``twice`` 2a, ``inv`` 1/a; ``lt le eq ne not and or`` give 1 or 0;
``if_else_zero`` is b where a is not 0, else exactly 0 even if b is not finite; ``fmod`` takes the
sign of a, ``remainder`` rounds to even.
"""


class Instruction(NamedTuple):
    """``target := op(args)``; each target is assigned once."""

    target: str
    op: str
    args: tuple[Operand, ...]


@dataclass(frozen=True, slots=True)
class AssignmentTape:
    """A function as single assignments.

    Attributes
    ----------
    instructions : tuple of Instruction
        In order of evaluation.
    outputs : tuple of tuple of Operand
        For each output its entries, column after column; structural zeros are 0.0.
    shapes : tuple of (int, int)
        Shape of each output.
    """

    instructions: tuple[Instruction, ...]
    outputs: tuple[tuple[Operand, ...], ...]
    shapes: tuple[tuple[int, int], ...]


def tape(
    function: Any, names: Sequence[Sequence[str]] | None = None, *, prefix: str = "v"
) -> AssignmentTape:
    """Read a CasADi function of SX type.

    Parameters
    ----------
    function : casadi.Function
        SX, with dense inputs.
    names : sequence of sequence of str, optional
        Text for every entry of every input. Default: ``NAME`` of a scalar, else ``NAME[i]``.
    prefix : str, optional
        Targets are ``PREFIX0``, ``PREFIX1``, ...

    Returns
    -------
    AssignmentTape

    Raises
    ------
    BondsightError
        If the function is no SX function, an input is sparse, the names do not fit, or an
        operation has no rule here.

    Examples
    --------
    >>> import casadi as ca
    >>> s, m = ca.SX.sym("s"), ca.SX.sym("m", 2)
    >>> found = tape(ca.Function("f", [s, m], [ca.fmax(s, m[1]) + 3.0], ["s", "m"], ["w"]))
    >>> [tuple(i) for i in found.instructions]
    [('v0', 'fmax', ('s', 'm[1]')), ('v1', 'add', ('v0', 3.0))]
    >>> found.outputs
    (('v1',),)
    """
    entries = _input_entries(function, names)
    known = _operation_names()
    register: dict[int, Operand] = {}
    instructions: list[Instruction] = []
    shapes = tuple(tuple(function.size_out(i)) for i in range(function.n_out()))
    outputs: list[list[Operand]] = [[0.0] * (rows * columns) for rows, columns in shapes]
    for k in range(function.n_instructions()):
        op = known.get(function.instruction_id(k), "")
        into, out_of = function.instruction_output(k), function.instruction_input(k)
        if op == "const":
            register[into[0]] = float(function.instruction_constant(k))
        elif op == "input":
            register[into[0]] = entries[out_of[0]][out_of[1]]
        elif op == "output":
            at = _dense_position(function, into[0], into[1])
            outputs[into[0]][at] = register[out_of[0]]
        elif op in OPERATIONS:
            args = tuple(register[i] for i in out_of[: OPERATIONS[op]])
            target = f"{prefix}{len(instructions)}"
            instructions.append(Instruction(target, op, args))
            register[into[0]] = target
        else:
            raise BondsightError(
                f"{function.name()}: CasADi's operation {op or function.instruction_id(k)!r} has "
                "no rule in a tape; write the law with the functions of bondgraph.support.ops.Ops"
            )
    return AssignmentTape(tuple(instructions), tuple(map(tuple, outputs)), shapes)


def tape_of(
    expression: Any, named: Callable[[sp.Symbol], str], *, prefix: str = "v"
) -> AssignmentTape:
    """Read a SymPy expression, or a number, whose symbols are called as `named` says.

    Raises
    ------
    BondsightError
        If a node of the expression has no rule in CasADi.

    Examples
    --------
    >>> a, b = sp.symbols("a b")
    >>> [tuple(i) for i in tape_of(a - b, str).instructions]
    [('v0', 'sub', ('a', 'b'))]
    """
    import casadi as ca

    from bondgraph.equations.casadi_printer import to_casadi

    form = sp.sympify(expression)
    free = sorted(form.free_symbols, key=str)
    values = [ca.SX.sym(f"a{i}") for i in range(len(free))]
    out = ca.densify(ca.SX(to_casadi(form, dict(zip(free, values, strict=True)))))
    function = ca.Function("expression", values, [out])
    return tape(function, [[named(s)] for s in free], prefix=prefix)


def _input_entries(function: Any, names: Sequence[Sequence[str]] | None) -> list[tuple[str, ...]]:
    if not function.is_a("SXFunction"):
        raise BondsightError(
            f"{function.name()} is a {function.class_name()}, not an SXFunction; expand it first"
        )
    found: list[tuple[str, ...]] = []
    for i in range(function.n_in()):
        name, size = str(function.name_in(i)), int(function.numel_in(i))
        if size != function.nnz_in(i):
            raise BondsightError(f"{function.name()}: input {name} is sparse; make it dense")
        default = (name,) if size == 1 else tuple(f"{name}[{j}]" for j in range(size))
        given = default if names is None else tuple(names[i])
        if len(given) != size:
            raise BondsightError(
                f"{function.name()}: input {name} has {size} entries but {len(given)} names"
            )
        found.append(given)
    return found


def _operation_names() -> dict[int, str]:
    import casadi as ca

    wanted = (*OPERATIONS, "const", "input", "output", "parameter", "call")
    return {int(getattr(ca, f"OP_{op.upper()}")): op for op in wanted}


def _dense_position(function: Any, output: int, nonzero: int) -> int:
    pattern = function.sparsity_out(output)
    return int(pattern.get_col()[nonzero] * pattern.size1() + pattern.row(nonzero))


@dataclass(frozen=True, slots=True)
class Rule:
    """How a language writes an operation.

    Attributes
    ----------
    template : str
        With ``{0}`` and ``{1}`` for the operands; one that stands twice is never folded.
    level : int
        How tightly the whole binds; a call or a parenthesis has `ATOM`.
    needs : tuple of int
        Least level of each operand that may stand without parentheses.
    """

    template: str
    level: int
    needs: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Notation:
    """A language: a rule for every operation, and how it writes a number."""

    rules: Mapping[str, Rule]
    number: Callable[[float], str]


@dataclass(frozen=True, slots=True)
class WrittenTape:
    """A tape in a language.

    Attributes
    ----------
    lines : tuple of (str, str)
        Target and expression, in order of evaluation.
    outputs : tuple of tuple of str
        Expression of each entry of each output, as in `AssignmentTape.outputs`.
    """

    lines: tuple[tuple[str, str], ...]
    outputs: tuple[tuple[str, ...], ...]


def written(program: AssignmentTape, notation: Notation, *, width: int = 72) -> WrittenTape:
    """Print a tape; a value used once is folded into its use up to `width` characters.

    Parameters
    ----------
    program : AssignmentTape
    notation : Notation
        A language.
    width : int, optional
        0 prints every instruction on its own line.

    Raises
    ------
    BondsightError
        If the notation has no rule for an operation.

    Examples
    --------
    >>> import casadi as ca
    >>> from bondgraph.export.tape_languages import PYTHON
    >>> s, m = ca.SX.sym("s"), ca.SX.sym("m", 2)
    >>> f = ca.Function("f", [s, m], [3.0 * (ca.fmax(s, m[1]) + s)], ["s", "m"], ["w"])
    >>> written(tape(f), PYTHON).outputs
    (('3.0 * (max(s, m[1]) + s)',),)
    """
    uses = Counter(a for i in program.instructions for a in i.args if isinstance(a, str))
    uses.update(a for entries in program.outputs for a in entries if isinstance(a, str))
    repeated = {a for i in program.instructions for a in _repeated(i, notation)}
    folded: dict[str, tuple[str, int]] = {}
    lines: list[tuple[str, str]] = []

    def text(operand: Operand, least: int) -> str:
        if isinstance(operand, str):
            body, level = folded.get(operand, (operand, ATOM))
        else:
            body = notation.number(operand)
            level = UNARY if body.startswith("-") else ATOM
        return body if level >= least else f"({body})"

    for target, op, args in program.instructions:
        rule = notation.rules.get(op)
        if rule is None:
            raise BondsightError(f"this notation has no rule for the operation {op!r}")
        body = rule.template.format(*(text(a, n) for a, n in zip(args, rule.needs, strict=True)))
        if uses[target] == 1 and target not in repeated and len(body) <= width:
            folded[target] = (body, rule.level)
        elif uses[target]:
            lines.append((target, body))
    outputs = tuple(tuple(text(a, LOOSE) for a in entries) for entries in program.outputs)
    return WrittenTape(tuple(lines), outputs)


def _repeated(instruction: Instruction, notation: Notation) -> set[Operand]:
    """Operands that the notation writes more than once."""
    rule = notation.rules.get(instruction.op)
    template = rule.template if rule else ""
    return {a for i, a in enumerate(instruction.args) if template.count(f"{{{i}}}") > 1}


ATOM, UNARY, TIMES, PLUS, COMPARE, LOOSE = 6, 5, 4, 3, 2, 0
"""Levels of a `Rule`, from the tightest to none."""
