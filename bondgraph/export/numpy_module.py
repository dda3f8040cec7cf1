"""A program as a plain Python module that needs NumPy and nothing else."""

from __future__ import annotations

import keyword
import re
from collections import Counter
from collections.abc import Sequence
from importlib.resources import files
from typing import Any

from bondgraph.equations.program import LawCall, Program
from bondgraph.export.identifiers import comment, distinct
from bondgraph.export.linearised import linearised
from bondgraph.export.tape import tape, tape_of, written
from bondgraph.export.tape_languages import PYTHON, PYTHON_HELPERS, READABLE, used_helpers
from bondgraph.support.errors import BondsightError

_VECTORS = ("x", "z", "u", "p")
_OWN = frozenset(
    "t x z u p m h math np abs min max float int range rates readings residuals memory".split()
)
_RESERVED = frozenset({*keyword.kwlist, *_OWN, *PYTHON_HELPERS})
WIDTH = 10_000
"""Readable equations are written on one line; only what is used twice gets a name."""


def numpy_module(program: Program) -> str:
    """Return the source of a Python module that evaluates and simulates `program`.

    The module has the names and numbers of the model (``STATES``, ``INPUTS``, ``PARAMETERS``,
    ``OUTPUTS``, ``UNITS``, ``NOMINAL``, ...), ``rates``, ``outputs`` and ``advance`` of
    ``(t, x, u, p, memory, h)``, ``unknowns`` for the algebraic unknowns, and
    ``simulate(time, inputs, ...)`` with an L-stable third-order step. Its ``evaluate`` holds the
    readable equations in their order. Names that Python or the module uses get a trailing
    underscore, only inside ``evaluate``.

    A law that jumps, such as dry friction, has no value at the jump: where it sticks the module
    raises ``NoConvergence`` instead of an answer.

    Parameters
    ----------
    program : Program

    Returns
    -------
    str
        Python 3.9 or later, ASCII.

    Raises
    ------
    BondsightError
        If an expression or an operation of a law has no rule in Python.

    Examples
    --------
    >>> from bondgraph import BondGraph, C, One, R, Se
    >>> from bondgraph.equations.codegen import program
    >>> with BondGraph("rc") as g:
    ...     loop = One("loop")
    ...     _ = Se("V") >> loop >> R("R_1", 1e3)
    ...     _ = loop >> C("C_1", 1e-6)
    >>> "STATES = ('q_C_1',)" in numpy_module(program(g))
    True
    """
    laws = _law_names(program)
    body = "\n\n".join(
        [
            *(_law(name, c) for name, c in zip(laws, program.laws, strict=True)),
            _evaluate(program, laws),
            _jacobian(program),
        ]
    )
    helpers = "\n\n".join(PYTHON_HELPERS[n] for n in used_helpers(body))
    step = files("bondgraph.export").joinpath("sources", "runtime.py.txt")
    parts = [_head(program), helpers, body, step.read_text(encoding="utf-8")]
    text = "\n\n".join(p for p in parts if p)
    if not text.isascii():
        raise BondsightError(f"{program.name}: the printed module is not plain ASCII")
    return text


def _head(program: Program) -> str:
    known = {*program.states, *program.inputs, *program.parameters, *program.outputs}
    units = {n: unit for n, unit in program.units.items() if unit and n in known}
    constants = {
        "STATES": program.states,
        "ALGEBRAIC": program.algebraic,
        "INPUTS": program.inputs,
        "INPUT_RATES": program.input_rates,
        "PARAMETERS": program.parameters,
        "MEMORY": program.memory,
        "OUTPUTS": program.outputs,
        "UNITS": units,
        "NOMINAL": tuple(map(float, program.nominal)),
        "START": tuple(map(float, program.start)),
        "GUESS": tuple(map(float, program.guess)),
        "VIRGIN": tuple(map(float, program.virgin)),
    }
    lines = [
        f'"""Model {_plain(program.name)}, printed by Bondsight. SI units; needs NumPy only."""',
        "",
        "import math  # noqa: F401",
        "",
        "import numpy as np",
        "",
        *(f"{name} = {value!a}" for name, value in constants.items()),
    ]
    return "\n".join(lines) + "\n"


def _plain(text: str) -> str:
    return comment(text).replace('"', "'")


def _law(name: str, call: LawCall) -> str:
    """Value and memory of a law as two functions."""
    return "\n\n".join(
        _printed(f"{kind}_{name}", function, single, f"{words} of {_plain(call.element)}.")
        for kind, function, single, words in (
            ("value", call.value, True, "Law (less its linear slope)"),
            ("advance", call.advance, False, "Memory, after s has been accepted,"),
        )
    )


def _printed(name: str, function: Any, single: bool, words: str) -> str:
    n_m, n_q = function.numel_in(1), function.numel_in(2)
    entries = [["s"], [f"m[{i}]" for i in range(n_m)], [f"q[{i}]" for i in range(n_q)], ["h"]]
    text = written(tape(function, entries), PYTHON)
    lines = [f"def {name}(s, m, q, h):", f'    """{words}"""']
    lines += [f"    {target} = {expression}" for target, expression in text.lines]
    entries_out = text.outputs[0]
    lines.append(f"    return {entries_out[0]}" if single else f"    return {_list(entries_out)}")
    return "\n".join(lines) + "\n"


def _list(entries: Sequence[str]) -> str:
    return "[" + ", ".join(entries) + "]"


def _law_names(program: Program) -> tuple[str, ...]:
    """Return one name a law; an element with several gets numbers."""
    count = Counter(c.element for c in program.laws)
    keys = [
        c.element if count[c.element] == 1 else f"{c.element}_{i}"
        for i, c in enumerate(program.laws)
    ]
    return tuple(distinct(keys).values())


def _evaluate(program: Program, laws: tuple[str, ...]) -> str:
    """Print the readable equations."""
    columns = dict(
        zip(
            _VECTORS,
            (program.states, program.algebraic, program.inputs, program.parameters),
            strict=True,
        )
    )
    own = [n for names in columns.values() for n in names]
    generated = {f"{kind}_{n}" for kind in ("value", "advance") for n in laws}
    local = distinct([*own, *(s.target for s in program.steps)], _RESERVED | generated)
    names = {"time": "t", "one": "1.0"} | local
    lines = [
        "def evaluate(t, x, z, u, p, m, h):",
        '    """Return rates, outputs, residuals and the memory after acceptance."""',
    ]
    part = "part"
    while any(name.startswith(part) for name in local.values()):
        part += "_"

    def right(expression: Any) -> str:
        """Text of an expression; parts that are used twice stand on lines before it."""
        own = tape_of(expression, lambda s: names[s.name], prefix=f"{part}{len(lines)}_")
        found = written(own, READABLE, width=WIDTH)
        lines.extend(f"    {target} = {text}" for target, text in found.lines)
        return found.outputs[0][0]

    def called(call: LawCall) -> str:
        memory = f"m[{call.memory.start}:{call.memory.stop}]"
        parameters = ", ".join(names[n] for n in call.parameters)
        return f"{right(call.argument)}, {memory}, [{parameters}], h"

    for column, members in columns.items():
        if members:
            lines.append(f"    {', '.join(local[n] for n in members)}, = {column}")
    for s in program.steps:
        if s.law is None:
            text = right(s.expression)
        else:
            text = f"value_{laws[s.law]}({called(program.laws[s.law])})"
        lines.append(f"    {local[s.target]} = {text}  # {comment(s.comment)}")
    for target, expressions in (
        ("rates", program.rates),
        ("readings", program.readings),
        ("residuals", program.residuals),
    ):
        lines.append(f"    {target} = {_list([right(e) for e in expressions])}")
    lines.append("    memory = []")
    calls = sorted(zip(laws, program.laws, strict=True), key=lambda pair: pair[1].memory.start)
    lines += [f"    memory += advance_{n}({called(c)})" for n, c in calls if c.law.n_memory]
    lines.append("    return rates, readings, residuals, memory")
    return "\n".join(lines) + "\n"


def _jacobian(program: Program) -> str:
    function = linearised(program)
    entries = [
        [re.sub(r"\[0\]$", "", f"{n}[0]")] if n in "th" else [f"{n}[{i}]" for i in range(size)]
        for n, size in ((function.name_in(i), function.numel_in(i)) for i in range(7))
    ]
    text = written(tape(function, entries), PYTHON)
    rows, columns = function.size_out(0)
    cells = text.outputs[0]
    lines = [
        "def jacobian(t, x, z, u, p, m, h):",
        '    """Return the derivative of rates and residuals by x and z, row by row."""',
        *(f"    {target} = {expression}" for target, expression in text.lines),
        "    return [",
        *(f"        {_list([cells[c * rows + r] for c in range(columns)])}," for r in range(rows)),
        "    ]",
    ]
    return "\n".join(lines) + "\n"
