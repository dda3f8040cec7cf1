"""A take described in a file, or in the journal of one that was made: what can be repeated."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any

from bondgraph.support.bounds import Count, NonNegative, Positive, one_of
from bondgraph.support.errors import UnusableInput


@dataclass(frozen=True, slots=True)
class TakeDescription:
    """What decides a take on a given bench; the fields are options of ``bondsight acquire``."""

    signal: str = "session"
    rate: Positive | None = None
    samples: Count = 8192
    seed: Count | None = None
    erase: float | None = None
    rest: NonNegative = 0.0
    synchronise: Annotated[str, one_of("clock", "start", "none")] = "clock"
    patience: Positive = 2.0


def read_take(path: Path) -> TakeDescription:
    """Read a take from TOML, or from the journal of an earlier one.

    Raises
    ------
    UnusableInput
        One line: no such file, no TOML, a key unknown or of another type.
    """
    from bondgraph.support.typed_reader import make, record
    from hardware.station.settings import toml_of
    from hardware.storage import open_journal

    content: Any
    if path.suffix == ".journal":
        command = open_journal(path).header.get("command")
        content = command.get("asked") if isinstance(command, Mapping) else None
        if not content:
            raise UnusableInput(f"{path.name}: does not say how its take was asked for")
    else:
        content = toml_of(path, "a file that describes a take")
    return make(lambda: record(TakeDescription, content, "", what="a take"), path.name)


def described(options: argparse.Namespace) -> dict[str, Any]:
    """Return what was asked for, as plain values that `read_take` takes."""
    asked = {k: getattr(options, k) for k in TakeDescription.__dataclass_fields__}
    file = Path(options.signal)
    if file.suffix and file.is_file():
        asked["signal"] = str(file.resolve())
    return {k: v for k, v in asked.items() if v is not None}


class TakeAction(argparse.Action):
    """Take options from a file; what stands behind it on the command line counts instead."""

    def __call__(self, parser: Any, namespace: Any, values: Any, option_string: Any = None) -> None:
        """Set the options; one that stands before the file would be lost without a word."""
        before = [
            f"--{k}"
            for k in TakeDescription.__dataclass_fields__
            if getattr(namespace, k, None) != parser.get_default(k)
        ]
        if before:
            raise argparse.ArgumentError(self, f"write {', '.join(before)} behind --take FILE")
        for k, value in asdict(read_take(values)).items():
            setattr(namespace, k, value)
