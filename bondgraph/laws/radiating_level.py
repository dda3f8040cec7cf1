"""The temperature that radiation beside conduction takes, as a function for SymPy."""

from __future__ import annotations

from typing import Any

import sympy as sp

STEPS = 12


class radiating_level(sp.Function):  # type: ignore[misc]
    """Relative rise ``v`` where ``(1 - share) v + share ((1 + v)^4 - 1) / 4`` is the heat ``w``.

    The name is what SymPy shows.
    """

    nargs = 2

    @classmethod
    def eval(cls, w: Any, share: Any) -> Any:
        """No heat, no rise."""
        return sp.S.Zero if w == 0 else None

    def fdiff(self, argindex: int = 1) -> sp.Expr:
        """Return the derivative by heat or share, of the implicit function."""
        share, y = self.args[1], 1 + self
        slope = 1 - share + share * y**3
        return 1 / slope if argindex == 1 else (self - (y**4 - 1) / 4) / slope

    def _eval_evalf(self, prec: int) -> Any:
        w, share = (a.evalf() for a in self.args)
        if not (w.is_number and share.is_number):
            return None
        v = w
        for _ in range(STEPS):  # rising and convex: comes down from a guess that is too high
            flow = (1 - share) * v + share * ((1 + v) ** 4 - 1) / 4
            v = v - (flow - w) / (1 - share + share * (1 + v) ** 3)
        return v
