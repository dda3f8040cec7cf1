"""Displacements whose zero is a matter of their laws' own numbers."""

from __future__ import annotations

import numpy as np

from bondgraph.simulation.first_order_hold import blocks
from bondgraph.simulation.lure import Compiled


def own_origins(compiled: Compiled) -> tuple[int, ...]:
    """Return the positions of states that may begin anywhere: their laws and offsets follow.

    All that depends on such a displacement are laws that say themselves where it is zero, as a
    wave's sine and cosine do, and readings, whose offsets a fit moves. Where it begins and where
    its zero is cannot be told apart: one of the two has to stay.
    """
    free = [use.law.own_origin for use in compiled.laws]
    if not any(free):
        return ()
    parts = blocks(compiled, compiled.block(compiled.nominal()))
    others = np.vstack([parts.a, parts.cs[~np.array(free)]])
    waves = parts.cs[np.array(free)]
    unseen = ~np.any(others, axis=0) & np.any(waves, axis=0)
    return tuple(int(i) for i in np.flatnonzero(unseen))
