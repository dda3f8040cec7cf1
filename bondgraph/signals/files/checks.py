"""What every source must satisfy: usable names, finite values, an existing file."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from bondgraph.support.arrays import FloatArray
from bondgraph.support.errors import BondsightError, UnusableInput

MAX_BYTES = 2**31
SHORT = 10
"""Missing samples in a row up to which it is proposed to draw lines across."""


def frozen(values: ArrayLike) -> FloatArray:
    """Return values as a float64 array nobody can write to."""
    out = np.asarray(values, dtype=np.float64)
    if out.flags.writeable:
        out = out.copy()
        out.flags.writeable = False
    return out


def map_argument(name: str, column: str = "") -> str:
    """Return the argument that names a column; the command line makes its option of it.

    Examples
    --------
    >>> print(map_argument("V", "Source voltage"))
    map={'V': 'Source voltage'}
    """
    return f"map={{{name!r}: {repr(column) if column else 'COLUMN'}}}"


def require_map(map: object) -> None:
    """Refuse what is no mapping of names to columns."""
    words = (*map, *map.values()) if isinstance(map, Mapping) else (None,)
    if map is not None and not all(isinstance(w, str) for w in words):
        raise UnusableInput(
            f"map = {map!r}: give names with their columns, such as "
            f"{map_argument('x', 'displacement[um]')}"
        )


def means_time(name: str) -> bool:
    """Whether a name is the time; `T` is not, it is a temperature or a period."""
    return name == "t" or name.lower() == "time"


def check_name(name: str, where: str) -> None:
    """Refuse names that a header or a map could not carry."""
    if not name or name != name.strip() or any(c in ',;"[]#' or not c.isprintable() for c in name):
        raise UnusableInput(
            f"{where}: {name!r} cannot name a channel; use letters, digits and underscores"
        )
    if means_time(name) or name.lower().endswith("fs_hz"):
        raise UnusableInput(f"{where}: channel name {name!r} means the time base; choose another")


def check_finite(
    values: FloatArray,
    what: str,
    place: Callable[[int], str],
    *,
    fills: bool = False,
    texts: Mapping[str, str] | None = None,
) -> None:
    """Refuse NaN and infinity; `place` says where sample i stands, `fills` if filling applies.

    `texts` are words in place of numbers, by place.
    """
    good = np.isfinite(values)
    bad = np.flatnonzero(~good)
    if not bad.size:
        return
    first = place(int(bad[0]))
    edges = np.flatnonzero(np.diff(np.concatenate(([True], good, [True])).astype(np.int8)))
    # pairs of first bad and first good sample after it
    starts, stops = edges[::2], edges[1::2]
    bursts = ""
    if bad.size > starts.size:
        longest = int(np.argmax(stops - starts))
        bursts = (
            f" ({starts.size} bursts, the longest from {place(int(starts[longest]))} to "
            f"{place(int(stops[longest]) - 1)})"
            if starts.size > 1
            else f" up to {place(int(bad[-1]))} without a gap"
        )
    remedies = ["remove or fill them"]
    if bad.size < values.size:
        heads = np.concatenate(([0], stops))
        tails = np.concatenate((starts, [values.size]))
        best = int(np.argmax(tails - heads))
        first_kept, last_kept = place(int(heads[best])), place(int(tails[best]) - 1)
        rows = ", ".join(p.rpartition(" ")[2] for p in (first_kept, last_kept))
        remedies.append(
            f"keep (rows=({rows})) the longest part without any, {first_kept} to {last_kept}"
        )
    most = int((stops - starts).max())
    if fills and most <= SHORT and good[0] and good[-1] and np.isnan(values[bad]).all():
        remedies.append(f"draw straight lines across (fill={most})")
    text = (texts or {}).get(first)
    sort, quoted = (" or text", f" ({text!r})") if text else ("", "")
    raise UnusableInput(
        f"{what}: {bad.size} of {values.size} values are NaN, infinite or empty{sort}, the first "
        f"in {first}{quoted}{bursts}",
        remedies=remedies,
    )


def check_file(file: Path) -> None:
    """Refuse what is not there, no file, empty or too large."""
    if not file.exists():
        raise UnusableInput(f"{file}: there is no such file; check the path")
    if not file.is_file():
        raise UnusableInput(f"{file}: this is not a file; give the path of a file of measurements")
    try:
        size = file.stat().st_size
        with open(file, "rb"):
            pass
    except OSError as error:
        raise UnusableInput(f"{file.name}: cannot be opened ({error.strerror})") from error
    if size == 0:
        raise UnusableInput(f"{file.name}: the file is empty; export the recording again")
    if size > MAX_BYTES:
        raise UnusableInput(
            f"{file.name}: {size / 2**30:.1f} GiB is more than the {MAX_BYTES / 2**30:.0f} GiB "
            f"read at once; cut or decimate the recording"
        )


def check_total(size: int, where: str) -> None:
    """Refuse what unpacks to more than is read at once."""
    if size > MAX_BYTES:
        raise UnusableInput(
            f"{where}: unpacks to {size / 2**30:.1f} GiB, more than the {MAX_BYTES / 2**30:.0f} "
            f"GiB read at once; cut or decimate the recording"
        )


@contextmanager
def readable(where: str, kind: str, advice: str = "export it again") -> Iterator[None]:
    """Say in one line what a library says of a damaged file, whatever it raises."""
    try:
        yield
    except BondsightError:
        raise
    except Exception as error:
        said = " ".join(str(error).split())[:200] or type(error).__name__
        raise UnusableInput(f"{where}: not readable as {kind} ({said}); {advice}") from error


def optional(module: str, method: str, extra: str = "") -> Any:
    """Import a package that only some users have; an extra of this project may bring it."""
    try:
        return importlib.import_module(module)
    except ImportError:
        package = f"'bondsight[{extra}]'" if extra else module.split(".")[0]
        raise UnusableInput(
            f"{method} needs {module}, which is not installed; pip install {package}"
        ) from None  # the trace of the import says no more
