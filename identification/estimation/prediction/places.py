"""Where the numbers of a filter stand in its vectors."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import accumulate

from bondgraph.simulation.lure import Compiled
from bondgraph.simulation.lure_layout import KernelLayout, layout


@dataclass(frozen=True, slots=True)
class Places:
    """Where each piece stands in the vector ``m``, and the length of ``z``.

    Attributes
    ----------
    n_p : int
        Entries of a packed covariance.
    packed : slice
        Matrices of a step as `discretise` packs them, its length behind them.
    direct : slice
        How deviations act on the laws' arguments at once, (n_w, n_w).
    added : slice
        Covariance added over a step, packed.
    noise, offset : slice
        Variance of each reading's noise, and its offset.
    laws : slice
        Parameters of the laws.
    """

    lay: KernelLayout
    n_p: int
    packed: slice
    direct: slice
    added: slice
    noise: slice
    offset: slice
    laws: slice
    n_m: int
    n_z: int


def places(compiled: Compiled) -> Places:
    """Sizes for `compiled`."""
    lay = layout(compiled, 0)
    n_p = lay.n_x * (lay.n_x + 1) // 2
    lengths = (lay.n_packed, lay.n_w**2, n_p, lay.n_y, lay.n_y, lay.n_q)
    ends = list(accumulate(lengths))
    packed, direct, added, noise, offset, laws = (
        slice(end - n, end) for end, n in zip(ends, lengths, strict=True)
    )
    n_z = lay.n_x + n_p + lay.n_w + lay.n_m
    return Places(lay, n_p, packed, direct, added, noise, offset, laws, ends[-1], n_z)
