"""What an exam draws from: its plants, and which laws may hide in each of its cells."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from hardware.simulators.generator.exam_places import (
    DISTURBED_LAWS,
    EXAM_FORMS,
    EXAM_OUTSIDE,
    EXAM_SINGLES,
    RARE_LAWS,
    REWRITTEN,
    SLOW_LAWS,
    Table,
    of_laws,
)
from hardware.simulators.generator.parameters import EXAM_PLANTS, PLANTS


@dataclass(frozen=True, slots=True)
class World:
    """Plants and tables of laws.

    Attributes
    ----------
    plants : tuple of str
        Each as likely as the others where a cell draws one.
    inside : tuple
        All laws with a name.
    tables : mapping
        By cell.
    """

    plants: tuple[str, ...]
    inside: Table
    tables: Mapping[str, Table]


def world(
    plants: tuple[str, ...],
    *,
    single: Table,
    form: Table,
    rewritten: Table,
    outside: Table,
    rare: str = RARE_LAWS,
    **others: Table,
) -> World:
    """Return a world; what is rare, slow or disturbed follows from the laws with a name."""
    inside = (*single, *form, *rewritten)
    return World(
        plants,
        inside,
        {
            "single": single,
            "form": form,
            "rewritten": rewritten,
            "outside": outside,
            "rare": of_laws(inside, rare),
            "slow": of_laws(inside, SLOW_LAWS),
            "disturbed": of_laws(inside, DISTURBED_LAWS),
            **others,
        },
    )


EXAM = world(
    (*PLANTS, *EXAM_PLANTS),
    single=EXAM_SINGLES,
    form=EXAM_FORMS,
    rewritten=REWRITTEN,
    outside=EXAM_OUTSIDE,
)
"""World of the development exam."""
