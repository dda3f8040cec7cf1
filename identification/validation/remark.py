"""One sentence of a judgement: how much it asks, what it says, what to try."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class Weight(Enum):
    """How much a remark asks of the reader."""

    FINE = "fine"
    NOTE = "note"
    FAULT = "fault"


@dataclass(frozen=True)
class Remark:
    """One sentence about the fit.

    Attributes
    ----------
    weight : Weight
    text : str
    advice : str
        What to try; empty where nothing is asked.
    leads : str
        The fit in a few words, where all faults after this one most likely come of it.
    about : tuple of str
        Parameters of which it tells how they go together.
    """

    weight: Weight
    text: str
    advice: str = ""
    leads: str = ""
    about: tuple[str, ...] = ()


def fine(text: str) -> Remark:
    """Return a remark that asks nothing."""
    return Remark(Weight.FINE, text)


def note(text: str, advice: str = "", about: tuple[str, ...] = ()) -> Remark:
    """Return a remark that is to be known."""
    return Remark(Weight.NOTE, text, advice, about=about)


def fault(text: str, advice: str, leads: str = "") -> Remark:
    """Return a remark that asks for something."""
    return Remark(Weight.FAULT, text, advice, leads)
