"""Where equations switch: the differences that decide between two pieces of a law."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import casadi as ca

MOST = 64
"""Differences beyond which a law is as good as smooth, and none is told."""

DECIDING = {
    ca.OP_FMIN: 2, ca.OP_FMAX: 2, ca.OP_LT: 2, ca.OP_LE: 2, ca.OP_FABS: 1, ca.OP_SIGN: 1,
}  # fmt: skip
"""Operations that have pieces, and how many operands decide between them."""


def switches(expression: Any, symbols: Sequence[Any], moving: Any, kept: Any) -> Any:
    """Return what crosses zero where `expression` changes its piece, as a column of unknowns.

    Only what depends on `moving`, and not on `kept`: what laws remember turns elsewhere. Empty
    where there are more than `MOST`.

    Parameters
    ----------
    expression : casadi.SX
    symbols : sequence of casadi.SX
        All that it depends on.
    moving, kept : casadi.SX
        Some of `symbols`.
    """
    function = ca.Function("pieces", list(symbols), [ca.densify(expression)], {"cse": True})
    known: dict[int, Any] = {}
    found: list[Any] = []
    for k in range(function.n_instructions()):
        op, ins = function.instruction_id(k), function.instruction_input(k)
        if op == ca.OP_OUTPUT:
            continue
        if op == ca.OP_INPUT:
            made = symbols[ins[0]][ins[1]]
        elif op == ca.OP_CONST:
            made = ca.SX(function.instruction_constant(k))
        else:
            operands = [known[i] for i in ins]
            if (count := DECIDING.get(op)) is not None:
                found.append(operands[0] if count == 1 else operands[0] - operands[1])
            make = ca.SX.unary if len(operands) == 1 else ca.SX.binary
            made = make(op, *operands)
        known[function.instruction_output(k)[0]] = made
    own = [d for d in found if ca.depends_on(d, moving) and not ca.depends_on(d, kept)]
    different: list[Any] = []
    for d in own:
        if not any(ca.is_equal(d, other, DEEP) for other in different):
            different.append(d)
    return ca.vertcat(ca.SX(0, 1), *(different if len(different) <= MOST else ()))


DEEP = 4
"""Operations down to which two differences are compared."""
