"""Design of the sealed trial: how many recordings of each cell, drawn from what (DESIGN.md).

A sealed trial draws from everything. Its development has neither the two plants nor the seven laws
that are kept for sealed trials, and the quick proof is a small sealed trial.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

from hardware.simulators.generator.case import DrawnCase
from hardware.simulators.generator.drawing import stream
from hardware.simulators.generator.exam_places import (
    EXAM_FORMS,
    EXAM_OUTSIDE,
    Table,
    widened,
)
from hardware.simulators.generator.later_places import (
    LATER,
    LATER_REWRITTEN,
    LATER_SINGLES,
    MIXED_UP,
    WITHHELD_FORMS,
    WITHHELD_OUTSIDE,
)
from hardware.simulators.generator.parameters import ALL_PLANTS, WITHHELD_PLANTS
from hardware.simulators.generator.vocabulary import Places
from tests.proof.exam.cells import draw_cells, shares
from tests.proof.exam.world import World, world

CELLS: Mapping[str, int] = MappingProxyType(
    {
        "control": 320,
        "single": 150,
        "form": 76,
        "rewritten": 56,
        "withheld_form": 72,
        "outside": 104,
        "withheld_outside": 26,
        "two": 60,
        "three": 26,
        "weak_further": 52,
        "rare": 48,
        "slow": 40,
        "broadband": 36,
        "disturbed": 36,
        "mixed_up": 18,
    }
)
"""Recordings of each cell in a sealed trial."""

COUNTS: Mapping[str, int] = MappingProxyType(
    {"trial": sum(CELLS.values()), "quick": 60, "development": 200}
)
"""Recordings of each kind of trial; development may have any number."""

BITS = (12, 14, 16)
"""Widths of the converters that read the sensors."""

SEALED = world(
    tuple(ALL_PLANTS),
    single=LATER_SINGLES,
    form=widened(EXAM_FORMS, LATER),
    rewritten=LATER_REWRITTEN,
    outside=widened(EXAM_OUTSIDE, LATER),
    withheld_form=WITHHELD_FORMS,
    withheld_outside=WITHHELD_OUTSIDE,
    mixed_up=MIXED_UP,
)
"""What a sealed trial draws from."""


def _known(places: Places) -> Places:
    return {plant: at for plant, at in places.items() if plant not in WITHHELD_PLANTS}


def _of_known_plants(sealed: World) -> World:
    """Return the world without the plants and the cells that are kept for sealed trials."""

    def table(rows: Table) -> Table:
        return tuple((effect, law, _known(places)) for effect, law, places in rows)

    return World(
        tuple(p for p in sealed.plants if p not in WITHHELD_PLANTS),
        table(sealed.inside),
        {c: table(rows) for c, rows in sealed.tables.items() if not c.startswith("withheld")},
    )


DEVELOPMENT = _of_known_plants(SEALED)
"""What development draws from."""


def draw_trial(kind: str, entropy: str | int, count: int | None = None) -> list[DrawnCase]:
    """Return the cases of a trial in a drawn order.

    Parameters
    ----------
    kind : {"trial", "quick", "development"}
        Each has random numbers of its own.
    entropy : str or int
        Salt from the operating system in hexadecimal digits; for development a seed.
    count : int, optional
        Recordings, of development only.

    Raises
    ------
    ValueError
        The kind is unknown, a sealed trial is asked for with a seed, or its number is not its own.
    """
    if kind not in COUNTS:
        raise ValueError(f"draw: unknown kind {kind!r}; use {', '.join(COUNTS)}")
    sealed = kind != "development"
    if sealed and (not isinstance(entropy, str) or len(entropy) < 32):
        raise ValueError(f"draw: a {kind} needs a salt; use secrets.token_hex(32)")
    if sealed and count is not None:
        raise ValueError(f"draw: the number of recordings of a {kind} is fixed")
    place = SEALED if sealed else DEVELOPMENT
    cells = {c: n for c, n in CELLS.items() if sealed or not c.startswith("withheld")}
    number = COUNTS[kind] if count is None else count
    cases = draw_cells(f"2 {kind}", entropy, shares(number, cells), place)
    return [
        replace(case, id=f"r{i:04d}", extra={**case.extra, **_converter(case, kind, entropy, i)})
        for i, case in enumerate(cases)
    ]


def _converter(case: DrawnCase, kind: str, entropy: str | int, i: int) -> dict[str, float]:
    """Return width, headroom and bow of the converter; coarse noise is one already."""
    if case.noise["kind"] == "quantised":
        return {}
    rng = stream(f"2 {kind}", entropy, f"converter{i}")
    return {
        "bits": float(rng.choice(BITS)),
        "headroom": float(rng.uniform(1.2, 4.0)),
        "bow": float(rng.uniform(-1.0, 1.0)),
    }
