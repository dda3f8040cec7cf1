"""Sizes of a compiled step, and where its matrices stand in one packed vector."""

from __future__ import annotations

from dataclasses import dataclass

from bondgraph.simulation.lure import Compiled


@dataclass(frozen=True, slots=True)
class KernelLayout:
    """Sizes of a kernel: n_z carried numbers (states, deviations, memory), n_d directions."""

    n_x: int
    n_u: int
    n_w: int
    n_m: int
    n_y: int
    n_q: int
    n_d: int

    @property
    def n_z(self) -> int:
        """Carried numbers."""
        return self.n_x + self.n_w + self.n_m

    @property
    def n_out(self) -> int:
        """Numbers given out a sample: outputs, then the laws' arguments and deviations."""
        return self.n_y + 2 * self.n_w

    @property
    def pieces(self) -> tuple[tuple[int, int], ...]:
        """Shapes of the packed matrices, in order."""
        v = self.n_u + self.n_w
        return (
            (self.n_x, self.n_x),
            (self.n_x, v),
            (self.n_x, v),
            (self.n_w, self.n_x),
            (self.n_w, self.n_u),
            (self.n_w, self.n_w),
            (self.n_y, self.n_x),
            (self.n_y, v),
        )

    @property
    def n_packed(self) -> int:
        """Length of the packed matrices and the step behind them."""
        return sum(r * c for r, c in self.pieces) + 1


def layout(compiled: Compiled, n_d: int) -> KernelLayout:
    """Sizes for `compiled` with `n_d` sensitivity directions."""
    n_m = sum(port.law.n_memory for port in compiled.laws)
    n_y = compiled.n_y + len(compiled.observed)
    return KernelLayout(
        compiled.n_x, compiled.n_u, compiled.n_w, n_m, n_y, len(compiled.law_parameters), n_d
    )
