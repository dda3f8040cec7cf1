"""A program as C99: CasADi's code for the functions below a plain C interface."""

from __future__ import annotations

import re
from collections.abc import Iterable
from importlib.resources import files
from typing import Any

from bondgraph.equations.program import Program
from bondgraph.export.identifiers import ascii_identifier, comment, distinct
from bondgraph.export.linearised import linearised, slope_of_residual
from bondgraph.support.errors import BondsightError

_INPUTS = ("t", "x", "z", "u", "p", "m", "h")
_CALLS = (
    ("rhs", ("dx", "y")),
    ("residual", ("g",)),
    ("advance", ("next",)),
    ("linearised", ("matrix",)),
    ("slope", ("matrix",)),
)
_HEAD = """/* Model @: printed by Bondsight. Plain C99 with math.h: no heap, no global state. */
#ifndef @_INCLUDED
#define @_INCLUDED

#ifdef __cplusplus
extern "C" {
#endif
"""
_TAIL = """
#ifdef __cplusplus
}
#endif

#endif
"""


def c_code(program: Program) -> dict[str, str]:
    """Return a header, a source and an example program in C99 for `program`.

    The header names every position of the vectors (``NAME_STATE_q_C``, ``NAME_INPUT_V``,
    ``NAME_PARAMETER_R``, ``NAME_MEMORY_..``, ``NAME_OUTPUT_..``) and declares ``NAME_start``,
    ``NAME_unknowns``, ``NAME_rates``, ``NAME_outputs``, ``NAME_advance`` and ``NAME_step``.
    Newton's method uses exact Jacobians. The example reads inputs from its standard input and
    writes outputs, so it is a simulator at once.

    A law that jumps, such as dry friction, has no value at the jump: where it sticks the functions
    return ``NAME_NO_CONVERGENCE``.

    Parameters
    ----------
    program : Program

    Returns
    -------
    dict of str to str
        Text by file name: ``NAME.h``, ``NAME.c``, ``NAME_example.c``. NAME is the model's name in
        letters, digits and underscores.

    Raises
    ------
    BondsightError
        If the functions of the program cannot be written as C.
    """
    name = ascii_identifier(program.name)
    if not name[0].isalpha():
        name = f"model{name}" if name.startswith("_") else f"model_{name}"
    source = f'#include "{name}.h"\n\n#include <math.h>\n#include <stddef.h>\n'
    parts = [
        source,
        *_functions(program, name),
        _start(program),
        _written("linear.c"),
        _written("runtime.c"),
    ]
    texts = {
        f"{name}.h": _header(program),
        f"{name}.c": "\n".join(parts),
        f"{name}_example.c": _written("example.c"),
    }
    return {file: text.replace("@", name) for file, text in texts.items()}


def _written(file: str) -> str:
    """Return a part that is the same for every model; ``@`` stands for its name."""
    return files("bondgraph.export").joinpath("sources", file).read_text(encoding="utf-8")


def _header(program: Program) -> str:
    groups = (
        ("STATE", "STATES", "x", program.states),
        ("ALGEBRAIC", "ALGEBRAIC", "z", program.algebraic),
        ("INPUT", "INPUTS", "u", program.inputs),
        ("PARAMETER", "PARAMETERS", "p", program.parameters),
        ("MEMORY", "MEMORY", "m", program.memory),
        ("OUTPUT", "OUTPUTS", "y", program.outputs),
    )
    lines = [_HEAD]
    for single, plural, vector, names in groups:
        lines += [f"/* Positions in {vector}. */", "enum {"]
        for original, text in distinct(names).items():
            note = _note(program, original)
            lines.append(f"  @_{single}_{text},{f' /* {note} */' if note else ''}")
        lines += [f"  @_N_{plural}", "};", ""]
    sizes = {vector.upper(): len(names) for _, _, vector, names in groups}
    sizes["XZ"] = sizes["X"] + sizes["Z"]
    lines.append("/* Lengths for declaring arrays, at least 1. */")
    lines.append(f"enum {{ {', '.join(f'@_SIZE_{k} = {max(n, 1)}' for k, n in sizes.items())} }};")
    return "\n".join(lines) + "\n" + _written("interface.h") + _TAIL


def _note(program: Program, name: str) -> str:
    unit = comment(program.units.get(name, "").replace("@", "."))
    rate = f"time derivative of {comment(name[2:])}" if name in program.input_rates else ""
    return ", ".join(n for n in (unit, rate) if n)


def _start(program: Program) -> str:
    lines = ["void @_start(double *x, double *z, double *p, double *m)", "{"]
    for vector, values in (
        ("x", program.start),
        ("z", program.guess),
        ("p", program.nominal),
        ("m", program.virgin),
    ):
        if values:
            lines += [f"  if ({vector}) {{", *_assigned(vector, values), "  }"]
        else:
            lines.append(f"  (void){vector};")
    return "\n".join([*lines, "}", ""])


def _assigned(vector: str, values: Iterable[float]) -> list[str]:
    return [f"    {vector}[{i}] = {float(v)!r};" for i, v in enumerate(values)]


def _functions(program: Program, name: str) -> list[str]:
    """CasADi's C code, and a plain function around each entry."""
    import casadi as ca

    made = {
        "rhs": program.rhs,
        "residual": program.residual,
        "advance": program.advance,
        "linearised": linearised(program),
        "slope": slope_of_residual(program),
    }
    generator = ca.CodeGenerator("generated", {"with_header": False, "main": False})
    renamed: dict[str, Any] = {}
    for key, function in made.items():
        v = [ca.SX.sym(n, *function.size_in(i)) for i, n in enumerate(_INPUTS)]
        results = [ca.densify(r) for r in function.call(v)]
        renamed[key] = ca.Function(f"generated_{key}", v, results)
        generator.add(renamed[key])
    text = str(generator.dump())
    if re.search(r"\b(malloc|calloc|free)\b", text):
        raise BondsightError(f"{program.name}: CasADi's C code for it would need the heap")
    text = re.sub(r"\bgenerated_", "@_casadi_", text)
    return [
        "/* Below: CasADi's code; its entries keep a fixed form, so some arguments are idle. */",
        "#if defined(__GNUC__)\n#pragma GCC diagnostic push",
        '#pragma GCC diagnostic ignored "-Wunused-parameter"\n#endif',
        text.replace("\n\n\n", "\n"),
        "#if defined(__GNUC__)\n#pragma GCC diagnostic pop\n#endif\n",
        *(_wrapped(key, renamed[key], outputs) for key, outputs in _CALLS),
    ]


def _wrapped(key: str, function: Any, outputs: tuple[str, ...]) -> str:
    arguments = [f"double {n}" if n in "th" else f"const double *{n}" for n in _INPUTS]
    results = ", ".join(f"double *{n}" for n in outputs)
    # work arrays may be longer than the lists of arguments
    given = ", ".join(f"&{n}" if n in "th" else n for n in _INPUTS)
    return "\n".join(
        [
            f"static void @_call_{key}({', '.join(arguments[:4])},",
            f"    {', '.join(arguments[4:])}, {results})",
            "{",
            f"  const double *arg[{max(function.sz_arg(), 7)}] = {{{given}}};",
            f"  double *res[{max(function.sz_res(), len(outputs))}] = {{{', '.join(outputs)}}};",
            f"  casadi_int iw[{max(function.sz_iw(), 1)}] = {{0}};",
            f"  double w[{max(function.sz_w(), 1)}] = {{0.0}};",
            f"  (void)@_casadi_{key}(arg, res, iw, w, 0);",
            "}",
            "",
        ]
    )
