"""Displacements whose zero is a matter of their laws' own numbers."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from bondgraph.equations.relation import LawUse
from bondgraph.simulation.first_order_hold import blocks
from bondgraph.simulation.lure import Compiled


def own_origins(compiled: Compiled, free: Collection[str]) -> tuple[int, ...]:
    """Return the positions of states that may begin anywhere: their laws and offsets follow.

    Parameters
    ----------
    free : collection of str
        Parameters that take any value; one that is held, or only known to lie somewhere, holds the
        place of its law.

    Returns
    -------
    tuple of int

    All that depends on such a displacement are laws that say themselves where it is zero, as a
    wave's sine and cosine do, and readings, whose offsets a fit moves. Where it begins and where
    its zero is cannot be told apart: one of the two has to stay.
    """
    follows = np.array([_follows(use, free) for use in compiled.laws], bool)
    if not follows.any():
        return ()
    parts = blocks(compiled, compiled.block(compiled.nominal()))
    others, waves = np.vstack([parts.a, parts.cs[~follows]]), parts.cs[follows]
    unseen = ~np.any(others, axis=0) & np.any(waves, axis=0)
    return tuple(int(i) for i in np.flatnonzero(unseen))


def _follows(use: LawUse, free: Collection[str]) -> bool:
    own = [f"{n}_{use.element}" for n in use.law.own_origin]
    return bool(own) and all(n in free for n in own)
