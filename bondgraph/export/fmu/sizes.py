"""The numbers of a program as a C header, and typical sizes of its states."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from bondgraph.equations.program import Program
from bondgraph.export.fmu.equations import Equations


def size_header(
    program: Program,
    found: Equations,
    largest_step: float,
    tolerance: float,
    events: Sequence[int],
    switches: int,
    nominal: Sequence[float],
) -> str:
    """``sizes.h``: lengths, start values and options; no name of the model appears in C."""
    counts = {
        "N_X": len(program.states),
        "N_Z": len(program.algebraic),
        "N_U": len(program.inputs),
        "N_P": len(program.parameters),
        "N_M": len(program.memory),
        "N_Y": len(program.outputs),
        "N_S": found.n_s,
        "N_T": len(events),
        "N_E": len(events) + switches,
        "TIMED": int(any(call.law.timed for call in program.laws)),
        **dict(zip(("SZ_ARG", "SZ_RES", "SZ_IW", "SZ_W"), found.work, strict=True)),
    }
    rate_of = [
        program.inputs.index(name[2:])
        if name in program.input_rates and name[2:] in program.inputs
        else -1
        for name in program.inputs
    ]
    lines = ['#include "token.h"', *(f"#define {name} {n}" for name, n in counts.items())]
    lines += [
        f"#define LARGEST_STEP {float(largest_step)!r}",
        f"#define TOLERANCE {float(tolerance)!r}",
        "#define TURN_TOLERANCE 10.0",
        _array("double", "START_U", "N_U", [0.0] * len(program.inputs)),
        _array("double", "START_P", "N_P", map(float, program.nominal)),
        _array("double", "START_V", "(N_X + N_Z)", map(float, (*program.start, *program.guess))),
        _array("double", "START_M", "N_M", map(float, program.virgin)),
        _array("double", "NOMINAL_X", "N_X", map(float, nominal)),
        _array("int", "RATE_OF", "N_U", rate_of),
        _array("int", "EVENT_OF", "N_T", events),
    ]
    return "\n".join(lines) + "\n"


def _array(kind: str, name: str, length: str, values: Iterable[float | int]) -> str:
    # one element more, because C has no empty arrays
    return f"static const {kind} {name}[{length} + 1] = {{{', '.join(map(repr, (*values, 0)))}}};"


def state_sizes(program: Program, found: Equations) -> np.ndarray:
    """Largest amplitude of each state under an input of amplitude 1, shape (n_x,).

    Linearised at the start, over frequencies at and below the moduli of the eigenvalues; a state
    that no input reaches gets its own start value or 1.
    """
    n_x, n_z = len(program.states), len(program.algebraic)
    a, b = found.linear
    if n_z:
        through = np.linalg.lstsq(a[n_x:, n_x:], np.hstack([a[n_x:, :n_x], b[n_x:]]), rcond=None)[0]
        inner = a[:n_x, n_x:] @ through
        a, b = a[:n_x, :n_x] - inner[:, :n_x], b[:n_x] - inner[:, n_x:]
    start = np.abs(np.array(program.start))
    rest = np.where(start > 0.0, start, 1.0)
    if not (n_x and b.size and np.isfinite(a).all() and np.isfinite(b).all()):
        return rest
    fast = np.abs(np.linalg.eigvals(a))
    fast = fast[fast > 1e-9 * fast.max(initial=0.0)]
    grid = np.concatenate([fast, 0.1 * fast]) if fast.size else np.array([1.0])
    size = np.zeros(n_x)
    for w in grid:
        # an undamped resonance is taken beside its peak
        response = np.linalg.lstsq((1j + 1e-3) * w * np.eye(n_x) - a, b.astype(complex), rcond=None)
        size = np.maximum(size, np.abs(response[0]).max(axis=1))
    return np.asarray(np.maximum(np.where(size > 0.0, size, rest), start))
