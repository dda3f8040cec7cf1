"""Shortest of some runs against its bound."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Measured:
    """A duration and what it may be.

    Parameters
    ----------
    name : str
        What was run.
    seconds, bound : float
        s.
    """

    name: str
    seconds: float
    bound: float


def best(work: Callable[[], object], repeats: int = 5) -> float:
    """Shortest of some runs (s)."""
    taken = []
    for _ in range(repeats):
        begin = time.perf_counter()
        work()
        taken.append(time.perf_counter() - begin)
    return min(taken)


def judged(found: Iterable[Measured]) -> int:
    """Print every duration with its bound; return 1 if one is beyond, else 0."""
    beyond = 0
    for m in found:
        over = m.seconds >= m.bound
        beyond += over
        print(f"{m.name:58s} {m.seconds:10.3g} s of {m.bound:g} s{'  BEYOND' if over else ''}")
    return int(beyond > 0)
