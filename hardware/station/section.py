"""One table of a station file, read key by key; what nobody asked for is refused by name."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, final

from bondgraph.support.errors import UnusableInput, real_number, unknown_name

__all__ = ["Section"]

_MISSING = object()


@final
class Section:
    """A table of plain values with the place it came from.

    Parameters
    ----------
    values : mapping
        Keys and plain values.
    where : str
        File and table, for messages.
    """

    def __init__(self, values: Mapping[str, Any], where: str) -> None:
        self._values = dict(values)
        self._asked: set[str] = set()
        self.where = where

    def __contains__(self, key: str) -> bool:
        """Whether the key is given."""
        return key in self._values

    def text(self, key: str, default: str | None = None, choices: Sequence[str] = ()) -> str:
        """Return a text, one of `choices` if there are any."""
        value = self._take(key, _MISSING if default is None else default)
        if not isinstance(value, str):
            raise UnusableInput(f"{self.where}: {key} = {value!r} must be a text in quotes")
        if choices and value not in choices:
            raise UnusableInput(str(unknown_name(key, value, self.where, choices)))
        return value

    def number(self, key: str, default: float | None = None) -> float:
        """Return a finite number."""
        value = self._take(key, _MISSING if default is None else default)
        if isinstance(value, bool):
            raise UnusableInput(f"{self.where}: {key} = {value!r} must be a number")
        return real_number(f"{self.where}: {key}", value)

    def optional(self, key: str) -> float | None:
        """Return a finite number, or None if the key is absent."""
        self._asked.add(key)
        return self.number(key) if key in self else None

    def whole(self, key: str, default: int | None = None, least: int = 0) -> int:
        """Return a whole number of at least `least`."""
        value = self._take(key, _MISSING if default is None else default)
        if isinstance(value, bool) or not isinstance(value, int) or value < least:
            raise UnusableInput(
                f"{self.where}: {key} = {value!r} must be a whole number of at least {least}"
            )
        return value

    def flag(self, key: str, default: bool) -> bool:
        """Return true or false."""
        value = self._take(key, default)
        if not isinstance(value, bool):
            raise UnusableInput(f"{self.where}: {key} = {value!r} must be true or false")
        return value

    def table(self, key: str) -> Section:
        """Return an inner table; an empty one if it is absent."""
        value = self._take(key, {})
        if not isinstance(value, Mapping):
            raise UnusableInput(f"{self.where}: {key} must be a table, [{key}]")
        return Section(value, f"{self.where}, [{key}]")

    def finished(self) -> None:
        """Refuse keys that nothing asked for.

        Raises
        ------
        UnusableInput
            With the nearest known keys.
        """
        for key in self._values:
            if key not in self._asked:
                raise UnusableInput(str(unknown_name("key", key, self.where, sorted(self._asked))))

    def _take(self, key: str, default: Any) -> Any:
        self._asked.add(key)
        value = self._values.get(key, default)
        if value is _MISSING:
            raise UnusableInput(f"{self.where}: {key} is missing; give it")
        return value
