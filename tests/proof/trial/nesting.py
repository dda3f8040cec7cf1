"""Which effects contain another as a special case."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from identification.diagnosis.catalogue import CATALOGUE


def containing(effect: str, simpler: Mapping[str, Sequence[str]] | None = None) -> tuple[str, ...]:
    """Return `effect` and every effect that contains it, directly or through another.

    Parameters
    ----------
    simpler : mapping of str to sequence of str, optional
        What each effect contains; that of the catalogue if not given.

    Examples
    --------
    >>> containing("a", {"a": (), "b": ("a",), "c": ("b",), "d": ()})
    ('a', 'b', 'c')
    """
    inside = {e.name: e.simpler for e in CATALOGUE} if simpler is None else simpler
    found = [effect]
    for name in found:
        found += [n for n, parts in inside.items() if name in parts and n not in found]
    return tuple(sorted(found))
