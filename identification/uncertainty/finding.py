"""One thing a user should know about data, start or result: what, where, why, what to do."""

from __future__ import annotations

from dataclasses import dataclass

PLAIN = {
    "dead": "without effect",
    "flat direction": "not told apart",
    "trade-off pair": "hardly told apart",
}
"""Kinds whose names are words of the house."""


@dataclass(frozen=True, slots=True)
class Finding:
    """A finding before or after a fit.

    Attributes
    ----------
    kind : str
        Short name, such as ``constant reading``.
    what : str
        The observation with its number.
    where : str
        Recording, channel or parameter.
    why : str
        Why it matters.
    do : str
        What to do.
    """

    kind: str
    what: str
    where: str
    why: str
    do: str

    @property
    def said(self) -> str:
        """The kind in plain words."""
        return PLAIN.get(self.kind, self.kind)

    def __str__(self) -> str:
        """One line."""
        return f"{self.said}: {self.where}: {self.what}; {self.why}; {self.do}"
