"""What progress says for good."""

from __future__ import annotations

from collections.abc import Callable


class Notice(str):
    """A text of progress that is worth reading after the next one has taken its place.

    Examples
    --------
    >>> Notice("check the unit of T")
    'check the unit of T'
    """

    __slots__ = ()


class Heard:
    """Progress that remembers the notices which it passes on.

    Parameters
    ----------
    say : callable
        Told a text and a fraction.
    """

    def __init__(self, say: Callable[[str, float], None]) -> None:
        self._say = say
        self.notices: list[str] = []

    def __call__(self, text: str, fraction: float) -> None:
        """Pass a text on."""
        if isinstance(text, Notice):
            self.notices.append(str(text))
        self._say(text, fraction)
