"""What was concealed in a recording, and what the tool may know of it, as plain values."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

from bondgraph.support.errors import UnusableInput
from tests.proof.trial.vocabulary import FAMILY_OF

CELL_OF: Mapping[str, str] = MappingProxyType(
    {
        "control": "control",
        "single": "single",
        "outside": "outside",
        "form": "form",
        "lookalike": "look_alike",
        "pair": "double",
    }
)
"""Kinds of recordings, see `Truth.cell`, by the generator's word for them."""
CELLS = tuple(CELL_OF.values())


@dataclass(frozen=True, slots=True)
class TrueEffect:
    """One concealed effect.

    Attributes
    ----------
    effect, family : str
        In the words of the vocabulary; physics outside it has a name of its own.
    element : str
        Where it sits.
    law : str
        Law in the generator.
    """

    effect: str
    family: str
    element: str
    law: str = ""


@dataclass(frozen=True, slots=True)
class Truth:
    """What was concealed in one recording.

    Attributes
    ----------
    cell : str
        ``control`` (nothing is missing), ``single`` (one effect of the catalogue), ``outside``
        (physics the catalogue does not have), ``form`` (an effect of the catalogue in another
        form), ``look_alike`` (one of a pair that is easily mixed up), ``double`` (two effects).
    pair : str
        The look-alike pair.
    decisive : bool
        The excitation tells the pair apart.
    strength : float
        Excess over the noise of the strongest effect, dB; nan for controls.
    control : str
        What disturbs a control instead of missing physics.
    """

    id: str
    cell: str
    plant: str
    effects: tuple[TrueEffect, ...] = ()
    pair: str = ""
    decisive: bool = True
    strength: float = float("nan")
    control: str = ""

    @property
    def empty(self) -> bool:
        """Nothing is missing from the model."""
        return not self.effects


@dataclass(frozen=True, slots=True)
class Public:
    """What the tool is told of one recording, beside the recording itself.

    Attributes
    ----------
    hold : str
        What the command does between samples, ``hold`` or ``linear``: a laboratory knows its
        converter.
    delay : float
        Dead time of the command that the laboratory declares, s; 0 for none.
    resolution : tuple of float
        Unit of each sensor's converter where it is coarse and declared, SI; 0 for fine ones.
    """

    id: str
    plant: str
    sensors: tuple[str, ...]
    hold: str = "hold"
    delay: float = 0.0
    resolution: tuple[float, ...] = ()


def canonical(data: Any) -> str:
    """Return the one text of plain data that is hashed: sorted keys, no spaces."""
    return json.dumps(data, sort_keys=True, separators=(",", ":"), ensure_ascii=True)


def truth_from(row: Mapping[str, Any]) -> Truth:
    """Read one truth as the generator wrote it.

    Raises
    ------
    UnusableInput
        An unknown cell, or a number of effects that does not fit it.
    """
    effects = tuple(
        TrueEffect(
            str(e["effect"]),
            FAMILY_OF.get(str(e["effect"]), "outside"),
            str(e["place"]),
            str(e.get("law", "")),
        )
        for e in row["effects"]
    )
    strengths = [
        float(e["strength_db"]) for e in row["effects"] if e.get("strength_db") is not None
    ]
    cell = CELL_OF.get(str(row["cell"]), "")
    if not cell:
        raise UnusableInput(f"{row['id']}: cell {row['cell']!r} is none of {', '.join(CELL_OF)}")
    expected = {"control": 0, "double": 2}.get(cell, 1)
    # one member of a look-alike pair is a wrong parameter and nothing else
    if len(effects) != expected and not (cell == "look_alike" and not effects):
        raise UnusableInput(
            f"{row['id']}: a {cell} has {expected} effects, the truth lists {len(effects)}"
        )
    return Truth(
        str(row["id"]),
        cell,
        str(row["plant"]),
        effects,
        str(row.get("pair_id", "")),
        bool(row.get("decisive", True)),
        max(strengths, default=float("nan")),
        str(row.get("control_kind", "")),
    )


def read_truths(rows: Sequence[Mapping[str, Any]]) -> dict[str, Truth]:
    """Return truths by the id of their recording."""
    found = {t.id: t for t in map(truth_from, rows)}
    if len(found) != len(rows):
        raise UnusableInput("truths: an id is listed twice")
    return found


def read_public(path: Path) -> tuple[Public, ...]:
    """Read the public list of a trial.

    Raises
    ------
    UnusableInput
        The file is missing or no list of recordings.
    """
    if not path.is_file():
        raise UnusableInput(f"{path}: there is no trial here; run bondsight blind generate first")
    try:
        rows = json.loads(path.read_text(encoding="utf-8"))["recordings"]
        return tuple(
            Public(
                str(r["id"]),
                str(r["plant"]),
                tuple(map(str, r["sensors"])),
                str(r["hold"]),
                float(r["delay"]),
                tuple(map(float, r.get("resolution", ()))),
            )
            for r in rows
        )
    except (KeyError, TypeError, ValueError) as error:
        raise UnusableInput(f"{path}: no list of recordings ({error!r})") from None
