"""Command-line arguments that several verbs share: options, types with one-line refusals."""

from __future__ import annotations

import argparse
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from bondgraph.support.errors import UnusableInput
from bondsight.cli.spoken import as_options

OUT = Path("bondsight-out")
"""Where results go by default."""
EVEN = "write a file with even time stamps and one column of each quantity"
"""What helps where every remedy of a reader is an option that a verb does not have."""
Options = argparse.ArgumentParser | argparse._ArgumentGroup
"""What options are added to: a verb, or one of the groups of its help."""
READ = "what is read"
ALLOWED = "what the model is allowed"
EFFORT = "how long and how much"
SHOWN = "what is written and shown"
"""Groups of options in the help of the long verbs."""
MODEL = "catalogue name, .json or .py file (its model(), or FILE.py:NAME), package.module:NAME"


def add_map(p: Options) -> None:
    """Add ``--map``, names for the columns of a recording."""
    p.add_argument(
        "--map", action="append", default=[], metavar="NAME=COLUMN", dest="maps",
        help="the column of a channel of the model, and its unit if the header has none: "
        "x=displacement[um]; may be repeated",
    )  # fmt: skip


def add_reading(p: Options) -> None:
    """Add ``--map``, ``--fs``, ``--rows``, ``--resample`` and ``--fill``: how files are read."""
    add_map(p)
    p.add_argument("--fs", type=positive_number, default=None, metavar="HZ",
                   help="sampling rate of files; a time column is ignored then")  # fmt: skip
    p.add_argument("--rows", type=span, default=(None, None), metavar="FIRST:LAST",
                   help="rows of files that are kept, as errors number them")  # fmt: skip
    p.add_argument("--resample", type=positive_number, default=None, metavar="HZ",
                   help="put files with uneven stamps on an even grid")  # fmt: skip
    p.add_argument("--fill", type=positive, default=None, metavar="N",
                   help="draw straight lines across up to N missing samples in a row")  # fmt: skip


def reading_of(options: argparse.Namespace) -> dict[str, Any]:
    """Return what the options of `add_reading` say beside the map, where they were asked."""
    given = {n: getattr(options, n, None) for n in ("fs", "rows", "resample", "fill")}
    return {n: v for n, v in given.items() if v not in (None, (None, None))}


def fitting(error: UnusableInput, *options: str, unit: str = "m") -> UnusableInput:
    """Return what the reader of a file says, less remedies by options that a verb does not have.

    Parameters
    ----------
    error : UnusableInput
    *options : str
        Of reading, such as ``--map``, that the verb has.
    unit : str
        For a column without one.
    """
    from bondgraph.signals.files.columns import NoUnit

    if isinstance(error, NoUnit) and "--map" not in options:
        return UnusableInput(error.lack(unit))
    kept = tuple(
        r for r in error.remedies if set(re.findall(r"--[a-z]+", as_options(r))) <= set(options)
    )
    if kept == error.remedies:
        return error
    return UnusableInput(*error.args, remedies=kept or (EVEN,))


def positive_number(text: str) -> float:
    """Return a positive number, such as samples a second."""
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0.0 < value < float("inf"):
        raise argparse.ArgumentTypeError(f"{text!r} is no positive number, such as 1000")
    return value


def span(text: str) -> tuple[int | None, int | None]:
    """Return the first and the last row of ``FIRST:LAST``; one may be left out."""
    first, sign, last = text.partition(":")
    ends = first.strip(), last.strip()
    if not sign or not any(ends) or not all(e.isdigit() for e in ends if e):
        raise argparse.ArgumentTypeError(f"{text!r} is not FIRST:LAST, such as 707:1501 or 20:")
    return int(ends[0]) if ends[0] else None, int(ends[1]) if ends[1] else None


def add_several(
    p: Options, option: str, metavar: str, default: list[str] | None, says: str
) -> None:
    """Add an option that takes several words, and more where it is given again."""
    p.add_argument(option, nargs="+", action="extend", default=default, metavar=metavar, help=says)


def mapping_of(maps: Sequence[str]) -> dict[str, str]:
    """Return name -> column from ``--map`` entries."""
    found = {}
    for m in maps:
        name, _, column = (part.strip() for part in m.partition("="))
        if not name or not column:
            raise UnusableInput(f"--map {m} is not NAME=COLUMN; write --map x=displacement_um")
        found[name] = column
    return found


def add_seed(p: Options, default: int | None = 0, otherwise: str = "0") -> None:
    """Add ``--seed``; `otherwise` tells what it is where it is not given."""
    about = f"of what is drawn (default: {otherwise})"
    p.add_argument("--seed", type=nonnegative, default=default, help=about)


def add_jobs(p: Options) -> None:
    """Add ``--jobs``."""
    p.add_argument("--jobs", type=jobs, default=-1, help="processes (default: all cores)")


def jobs(text: str) -> int:
    """Return a number of processes: 1 or more, or -1 for all cores."""
    try:
        value = int(text)
    except ValueError:
        value = 0
    if value < 1 and value != -1:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number of processes; -1 is all cores")
    return value


def nonnegative(text: str) -> int:
    """Return a whole number of at least 0, such as a seed."""
    return _whole(text, 0)


def positive(text: str) -> int:
    """Return a whole number of at least 1, such as a count."""
    return _whole(text, 1)


def _whole(text: str, least: int) -> int:
    try:
        value = int(text)
    except ValueError:
        value = least - 1
    if value < least:
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number of at least {least}")
    return value
