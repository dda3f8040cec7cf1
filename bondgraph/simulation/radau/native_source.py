"""C source of the general step of a `Program`: CasADi's functions, sizes, sparsities, the loop.

Derivatives by parameters and by memory are sparse matrices, each with its pattern in the source, so
one library serves any choice of directions.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import casadi as ca

from bondgraph.equations.program import Program
from bondgraph.simulation.banks import PlacedBank, bank_source
from bondgraph.support.native import LOOPS, vector_length

PARTS = ("algebra", "loop")
SHARED = 1e-8
"""Contacts that hold the same motion share its force by this: the least that changes it. It stands
in the matrix of Newton's method alone, so that a solution is exact."""
ROWS = "typedef double row_block __attribute__((vector_size(8 * LANES), aligned(8), may_alias));"


def lanes() -> int:
    """Return how many tangents of a play one instruction serves; a row is some of them."""
    return min(4, vector_length())


@dataclass(frozen=True, slots=True)
class GeneralFunctions:
    """What the loop calls; all arguments ``(t, v, u, p, m, h)`` with ``v = (x, z)``.

    Attributes
    ----------
    stage : casadi.Function
        ``-> (F, J)``, ``F = (f, g)`` and its Jacobian by v, dense.
    seed : casadi.Function
        ``-> (dF/dp, dF/dm)``, sparse.
    reading : casadi.Function
        ``-> y``
    slope : casadi.Function
        ``-> (dy/dv, dy/dp, dy/dm)``, sparse.
    advance : casadi.Function
        ``-> m+``
    moving : casadi.Function
        ``-> (dm+/dv, dm+/dp, dm+/dm)``, sparse.
    n_x : int
        How many of v are states.
    jumps : bool
        Whether the memory follows inputs at once, so that it must follow where they jump.
    held : int
        How many of the last of v are deviations of laws that jump.
    """

    stage: ca.Function
    seed: ca.Function
    reading: ca.Function
    slope: ca.Function
    advance: ca.Function
    moving: ca.Function
    n_x: int
    jumps: bool
    held: int

    @property
    def all(self) -> tuple[ca.Function, ...]:
        """Every function, in order."""
        return (self.stage, self.seed, self.reading, self.slope, self.advance, self.moving)

    @property
    def largest(self) -> int:
        """Most numbers that one of the sparse derivatives gives out."""
        sparse = (self.seed, self.slope, self.moving)
        return max(sum(f.nnz_out(i) for i in range(f.n_out())) for f in sparse)


def general_functions(program: Program) -> GeneralFunctions:
    """Return the functions of a program and their derivatives."""
    n_x, n_z = len(program.states), len(program.algebraic)
    t, h = ca.SX.sym("t"), ca.SX.sym("h")
    v = ca.SX.sym("v", n_x + n_z)
    u, p = ca.SX.sym("u", len(program.inputs)), ca.SX.sym("p", len(program.parameters))
    m = ca.SX.sym("m", len(program.memory))
    at = (t, v[:n_x], v[n_x:], u, p, m, h)
    rates, y = program.rhs(*at)
    value = ca.densify(ca.vertcat(rates, program.residual(*at)))
    later = program.advance(*at)

    def made(name: str, *columns: ca.SX) -> ca.Function:
        # plain names might be those of another library
        return ca.Function(f"bondsight_{name}", [t, v, u, p, m, h], list(columns), {"cse": True})

    def by(of: ca.SX, *variables: ca.SX) -> list[ca.SX]:
        return [ca.jacobian(of, w) for w in variables]

    return GeneralFunctions(
        made("stage", value, ca.densify(ca.jacobian(value, v))),
        made("seed", *by(value, p, m)),
        made("reading", ca.densify(y)),
        made("slope", *by(y, v, p, m)),
        made("advance", ca.densify(later)),
        made("moving", *by(later, v, p, m)),
        n_x,
        bool(ca.depends_on(later, ca.vertcat(v[n_x:], u))) if later.numel() else False,
        len(program.held),
    )


def general_source(
    program: Program, functions: GeneralFunctions, banks: tuple[PlacedBank, ...] = ()
) -> str:
    """Return the whole C source: functions of CasADi, sizes, patterns, the loop over a record."""
    generator = ca.CodeGenerator("code.c", {"with_header": False, "main": False})
    for f in functions.all:
        generator.add(f)
    # as in bondgraph.support.native: comparisons are much cheaper than calls that must look for NaN
    text = str(generator.dump())
    for name, sign in (("fmax", ">"), ("fmin", "<")):
        text = text.replace(f"return {name}(x, y);", f"return x {sign} y ? x : y;")
    sizes = {
        "NX": program.states,
        "NZ": program.algebraic,
        "NU": program.inputs,
        "NM": program.memory,
        "NY": program.outputs,
    }
    lines = [f"#define {k} {len(v)}" for k, v in sizes.items()]
    lines.append(f"#define VALUES {functions.largest + 1}")
    lines += _patterns("seed", functions.seed, "pm")
    lines += _patterns("slope", functions.slope, "vpm")
    lines += _patterns("moving", functions.moving, "vpm")
    lines += [f"#define NBANKS {len(banks)}", "#define SLOPES 1"]
    lines.append(f"#define JUMPS {int(functions.jumps)}")
    lines += [f"#define HELD {functions.held}", f"#define SHARED {SHARED}"]
    for what, values in (
        ("slot", [b.slot for b in banks]), ("stops", [int(b.bank.stops) for b in banks])
    ):  # fmt: skip
        lines.append(f"static const int bank_{what}[] = {{{', '.join(map(str, values)) or '0'}}};")
    loop = [Path(__file__).with_name(f"{n}.c").read_text() for n in PARTS]
    if banks:
        lines += [f"#define LANES {lanes()}", ROWS, "#define NB (b->wide)", bank_source()]
    return "\n".join([text, LOOPS, "#include <math.h>", "#include <string.h>", *lines, *loop])


def _patterns(name: str, function: ca.Function, letters: str) -> list[str]:
    """Return the columns and rows of the sparse outputs of a function."""
    lines = []
    for i, letter in enumerate(letters):
        pattern = function.sparsity_out(i)
        lines.append(f"#define {name.upper()}_{letter.upper()}_NZ {pattern.nnz()}")
        for what, numbers in (("colind", pattern.colind()), ("row", pattern.row())):
            values = ", ".join(map(str, numbers)) or "0"
            lines.append(f"static const casadi_int {name}_{letter}_{what}[] = {{{values}}};")
    return lines
