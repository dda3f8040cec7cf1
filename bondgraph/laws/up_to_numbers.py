"""A law up to its numbers, as a key: laws of one structure share what was made for one of them."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, field

from bondgraph.laws.law import Law


@dataclass(frozen=True)
class UpToNumbers:
    """A law, equal to others of its structure with as many numbers.

    Attributes
    ----------
    structure : hashable
        See `Law.structure`.
    count : int
        Parameters.
    example : Law
        One of them.
    """

    structure: Hashable
    count: int
    example: Law = field(compare=False)

    @classmethod
    def of(cls, law: Law, count: int) -> UpToNumbers:
        """Return a law with `count` parameters up to their values."""
        return cls(law.structure, count, law)
