"""What progress says for good."""

from __future__ import annotations


class Notice(str):
    """A text of progress that is worth reading after the next one has taken its place.

    Examples
    --------
    >>> Notice("check the unit of T")
    'check the unit of T'
    """

    __slots__ = ()
