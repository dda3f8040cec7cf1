"""A record in compiled code: one library for all models, and the laws of each beside it.

A row holds a number and its derivatives. The linear part of a step multiplies rows by numbers, so
that one instruction serves several directions (`march.c`); only the laws are code of their own.
"""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any

from casadi import Function

from bondgraph.simulation.banks import PlacedBank, bank_source
from bondgraph.simulation.lure_closing import ClosedLaws, ClosedPart
from bondgraph.simulation.lure_layout import KernelLayout
from bondgraph.support.native import MACHINE, STRAIGHT, build, c_source, vector_length

# products are rounded before they are added: what sticks stands still to the last bit
ROUNDED = (*MACHINE, "-ffp-contract=off")
MARCH = ("-O3", *ROUNDED)
LAWS = (*STRAIGHT, *ROUNDED)

ROWS = """
#include <math.h>
#include <string.h>
typedef long long int casadi_int;
#if LANES > 1
typedef double row_block __attribute__((vector_size(8 * LANES), aligned(8), may_alias));
#define FIRST(block, value) (block)[0] = (value)
#else
typedef double row_block;
#define FIRST(block, value) (block) = (value)
#endif
#define NB (b->wide)
"""


FEW = 4
"""Laws whose derivatives cost little beside a second library without them."""


def has_slopes(lay: KernelLayout, banks: Sequence[PlacedBank] = ()) -> bool:
    """Whether a step carries derivatives.

    Without directions it is the step with one lane of them, so that one library serves both; but
    plays, which are vectors themselves, and many laws have a step without.
    """
    return lay.n_d > 0 or (not banks and lay.n_w <= FEW)


def lanes_of(lay: KernelLayout, banks: Sequence[PlacedBank] = ()) -> int:
    """Return how many directions one instruction serves."""
    return vector_length() if has_slopes(lay, banks) else 1


def blocks_of(lay: KernelLayout, banks: Sequence[PlacedBank] = ()) -> int:
    """Return in how many blocks of lanes a row is cut."""
    return -(-(1 + lay.n_d) // lanes_of(lay, banks))


def march_source(slopes: bool, located: bool = False) -> str:
    """C source of ``run_record`` for all models, with derivatives or without.

    Steps of it that are `located` are halved where they and their halves differ.
    """
    head = f"#define LANES {vector_length() if slopes else 1}\n#define SLOPES {int(slopes)}\n"
    head += f"#define LOCATED {int(located)}\n"
    body = files("bondgraph.simulation").joinpath("march.c").read_text(encoding="utf-8")
    return f"{head}{ROWS}{bank_source()}\n#undef NB\n{body}"


def law_functions(laws: ClosedLaws) -> tuple[Function, ...]:
    """Return the functions that the code of laws is made of."""
    each = (f for part in laws.parts for f in _steps(part) if f is not None)
    return (*each, laws.after) if laws.parts else (laws.function,)


def _steps(part: ClosedPart) -> tuple[Function | None, ...]:
    return part.begin, part.step, part.end


def compiled_march(
    lay: KernelLayout, laws: ClosedLaws, slopes: bool, located: bool = False
) -> tuple[Path, ...]:
    """Compile the march and the laws; empty where that cannot be done.

    The march is the same for all models, the laws for all models that have them: few are compiled.
    """
    march = build(march_source(slopes, located), MARCH)
    if march is None or not lay.n_w:
        return () if march is None else (march,)
    code = build(c_source(*law_functions(laws)), LAWS)
    return () if code is None else (march, code)


class _Part(ctypes.Structure):
    _fields_ = (
        *((name, ctypes.c_void_p) for name in ("begin", "step", "end")),
        *((name, ctypes.c_longlong) for name in ("arguments", "most")),
    )


NUMBERS = (
    "n_w", "n_m", "n_q", "n_slopes", "n_parts", "sweeps", "numbers", "n_arg", "n_res", "n_banks",
)  # fmt: skip
LISTS = ("memory_row", "memory_column", "memories", "parameters", "bank_slot", "bank_stops")


class _Laws(ctypes.Structure):
    _fields_ = (
        *((name, ctypes.c_longlong) for name in NUMBERS),
        *((name, ctypes.POINTER(ctypes.c_longlong)) for name in LISTS),
        ("parts", ctypes.POINTER(_Part)),
        ("after", ctypes.c_void_p),
    )


def law_table(
    lay: KernelLayout, laws: ClosedLaws, banks: Sequence[PlacedBank], code: Path | None
) -> Any:
    """Return what the march knows of laws, as `march.c` takes it, with all that it points to."""
    library = None if code is None else ctypes.CDLL(str(code))

    def at(function: Function | None) -> Any:
        if function is None or library is None:
            return None
        return ctypes.cast(getattr(library, function.name()), ctypes.c_void_p)

    parts = laws.parts if lay.n_w else ()
    used = law_functions(laws) if lay.n_w else ()
    lists = {
        "memory_row": laws.rows, "memory_column": laws.columns, "memories": laws.memories,
        "parameters": laws.parameters, "bank_slot": [b.slot for b in banks],
        "bank_stops": [int(b.bank.stops) for b in banks],
    }  # fmt: skip
    table = _Laws(
        n_w=lay.n_w, n_m=lay.n_m, n_q=lay.n_q, n_slopes=len(laws.rows), n_parts=len(parts),
        sweeps=laws.sweeps if parts else 1, numbers=max((p.size for p in parts), default=0),
        n_arg=max((f.sz_arg() for f in used), default=0),
        n_res=max((f.sz_res() for f in used), default=0), n_banks=len(banks),
        **{n: (ctypes.c_longlong * (len(v) + 1))(*v) for n, v in lists.items()},
        parts=(_Part * (len(parts) + 1))(
            *(_Part(*map(at, _steps(p)), p.arguments, p.most) for p in parts)
        ),
        after=at(used[-1]) if used else None,
    )  # fmt: skip
    table.library = library
    return table
