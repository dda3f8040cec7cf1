"""Arrays and a JSON document in one open file: written whole, checked and reopened bit by bit.

The file is an uncompressed ZIP of `.npy` arrays, which `numpy.load` opens, and of one
``document.json``, which any text reader shows. There is no pickle in it. Equal content gives equal
bytes: the entries carry no time of day.

``document.json`` holds ``format``, ``schema`` (what the document means), ``software`` (who wrote
it), ``document``, ``arrays`` (name -> entry, dtype, shape, SHA-256 of the values) and ``sha256`` of
schema, document and arrays together.
"""

from __future__ import annotations

import hashlib
import json
import math
import re
import zipfile
from collections.abc import Mapping
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bondgraph.signals.files.checks import check_file, check_total
from bondgraph.support.errors import BondsightError, UnusableInput
from bondgraph.support.json_codec import from_plain, to_plain
from bondgraph.support.whole_file import replacing

FORMAT = "bondsight-archive/1"
"""Name and version of the container."""
DOCUMENT = "document.json"
MAX_DOCUMENT = 256 * 2**20
MAX_ARRAYS = 100_000
_KINDS = "biufcUS"
_SCHEMA = re.compile(r"[a-z0-9][a-z0-9-]*/[1-9][0-9]*")


@cache
def software() -> str:
    """Name and version of this software, as written into files."""
    try:
        return f"bondsight {version('bondsight')}"
    except PackageNotFoundError:
        return "bondsight (not installed)"


def write_archive(
    path: str | Path,
    schema: str,
    document: Mapping[str, Any],
    arrays: Mapping[str, NDArray[Any]],
) -> str:
    """Write arrays and a document; all or nothing.

    Parameters
    ----------
    path : path
        File to write, customarily `.npz`; an existing one is replaced at once at the end.
    schema : str
        What the document means, as `name/version`: ``"bondsight-fit/1"``.
    document : mapping
        Plain values: mappings with text keys, lists, tuples, texts, numbers (infinity and NaN
        too), flags, None. Order is kept.
    arrays : mapping of str to ndarray
        Numbers, flags or texts of any shape; type and byte order are kept.

    Returns
    -------
    str
        SHA-256 of the content, equal for equal schema, document and arrays.

    Raises
    ------
    UnusableInput
        A value cannot be stored, or the file cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder) / "fit.npz"
    ...     _ = write_archive(file, "fit/1", {"cost": 1.5}, {"theta": np.array([1.0, 2.0])})
    ...     read_archive(file, "fit/1")
    ({'cost': 1.5}, {'theta': array([1., 2.])})
    """
    path = Path(path)
    if not _SCHEMA.fullmatch(schema):
        raise UnusableInput(f"{path.name}: {schema!r} is no schema; write it as name/1")
    stored = {name: _storable(name, a, path.name) for name, a in arrays.items()}
    members = _members(stored)
    entries = {
        name: {
            "file": members[name],
            "dtype": a.dtype.str,
            "shape": list(a.shape),
            "sha256": _digest(a),
        }
        for name, a in stored.items()
    }
    content = {
        "schema": schema,
        "document": to_plain(document, path.name),
        "arrays": entries,
    }
    digest = _content_digest(content)
    head = {"format": FORMAT, "software": software(), **content, "sha256": digest}
    text = json.dumps(head, indent=1, allow_nan=False).encode("ascii")
    if len(text) > MAX_DOCUMENT or len(stored) > MAX_ARRAYS:
        raise UnusableInput(
            f"{path.name}: a document of {len(text)} bytes or {len(stored)} arrays is too much; "
            "put numbers into few arrays"
        )
    with replacing(path) as stream, zipfile.ZipFile(stream, "w") as archive:
        archive.writestr(_entry(DOCUMENT, len(text)), text)
        for name, a in stored.items():
            with archive.open(_entry(members[name], a.nbytes + 4096), "w") as member:
                np.lib.format.write_array(member, a, allow_pickle=False)
    return digest


def read_archive(path: str | Path, schema: str) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
    """Read what `write_archive` wrote, every byte checked.

    Parameters
    ----------
    path : path
        The file.
    schema : str
        The schema expected.

    Returns
    -------
    dict, dict of str to ndarray
        Document and arrays (writable), equal to what was written.

    Raises
    ------
    UnusableInput
        One line: no such file, no archive, damaged, another schema, or a newer one.
    """
    path = Path(path)
    check_file(path)
    try:
        with zipfile.ZipFile(path) as archive:
            head = _head(archive, path.name)
            _check_schema(head, schema, path.name)
            content = {k: head[k] for k in ("schema", "document", "arrays")}
            if _content_digest(content) != head["sha256"]:
                raise _damaged(path.name, "the document does not match its checksum")
            arrays = {n: _array(archive, n, e, path.name) for n, e in head["arrays"].items()}
        document = from_plain(head["document"], path.name)
    except BondsightError:
        raise
    except RecursionError:
        raise _damaged(path.name, "it is nested too deep") from None
    except Exception as error:  # a damaged ZIP raises almost anything
        raise _damaged(path.name, str(error) or type(error).__name__) from error
    if not isinstance(document, dict):
        raise _damaged(path.name, "the document is no object")
    return document, arrays


def archive_schema(path: str | Path) -> str | None:
    """Return the schema of a file made by `write_archive`; None for any other file.

    Only the document is read; nothing is checked.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            head = _head(archive, Path(path).name)
    except Exception:  # whatever it is, it is none of ours
        return None
    schema = head["schema"]
    return schema if isinstance(schema, str) else None


def _storable(name: str, array: NDArray[Any], where: str) -> NDArray[Any]:
    values = np.asarray(array, order="C")
    if values.dtype.kind not in _KINDS or not isinstance(name, str):
        raise UnusableInput(
            f"{where}: array {name!r} holds {values.dtype}; store numbers, flags or texts"
        )
    return values


def _members(arrays: Mapping[str, NDArray[Any]]) -> dict[str, str]:
    """Entry of each array: its name where that is a safe file name, made unique."""
    found: dict[str, str] = {}
    taken: set[str] = set()
    for i, name in enumerate(arrays):
        base = re.sub(r"[^A-Za-z0-9_.-]", "_", name)[:100].strip(".") or "array"
        member = f"{base}.npy"
        if member.lower() in taken:
            member = f"{base}-{i}-.npy"
        while member.lower() in taken:
            member = f"_{member}"
        taken.add(member.lower())
        found[name] = member
    return found


def _entry(name: str, size: int) -> zipfile.ZipInfo:
    """One entry of the ZIP, the same on every system and day."""
    entry = zipfile.ZipInfo(name, date_time=(1980, 1, 1, 0, 0, 0))
    entry.compress_type = zipfile.ZIP_STORED
    entry.create_system = 3
    entry.external_attr = 0o644 << 16
    entry.file_size = size
    return entry


def _digest(array: NDArray[Any]) -> str:
    return hashlib.sha256(np.ascontiguousarray(array).tobytes()).hexdigest()


def _content_digest(content: Mapping[str, Any]) -> str:
    text = json.dumps(content, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(text.encode("ascii")).hexdigest()


def _damaged(where: str, why: str) -> UnusableInput:
    return UnusableInput(f"{where}: cannot be reopened, {why}; the file is damaged or was changed")


def _head(archive: zipfile.ZipFile, where: str) -> dict[str, Any]:
    names = archive.namelist()
    if DOCUMENT not in names:
        raise UnusableInput(
            f"{where}: holds no {DOCUMENT}, so Bondsight did not save it; read arrays of others "
            "with Recording.read"
        )
    if len(set(names)) < len(names):
        raise _damaged(where, "an entry is there twice")
    check_total(sum(i.file_size for i in archive.infolist()), where)
    if archive.getinfo(DOCUMENT).file_size > MAX_DOCUMENT:
        raise UnusableInput(f"{where}: its document unpacks to more than is read; save it again")
    head = json.loads(archive.read(DOCUMENT))
    kind = head.get("format") if isinstance(head, dict) else None
    if kind != FORMAT:
        raise UnusableInput(
            f"{where}: format {kind!r} is not read, {FORMAT!r} is; update Bondsight or save again"
        )
    keys = {"schema": str, "document": dict, "arrays": dict, "sha256": str, "software": str}
    for key, kinds in keys.items():
        if not isinstance(head.get(key), kinds):
            raise _damaged(where, f"its {key!r} is missing")
    return dict(head)


def _check_schema(head: Mapping[str, Any], wanted: str, where: str) -> None:
    found = head["schema"]
    if found == wanted:
        return
    if not _SCHEMA.fullmatch(found):
        raise _damaged(where, "its schema is no name/version")
    (name, number), (expected, least) = found.split("/"), wanted.split("/")
    if name != expected:
        raise UnusableInput(f"{where}: holds {name!r}, not {expected!r}; give another file")
    action = (
        "update Bondsight" if int(number) > int(least) else "open it with the version that wrote it"
    )
    raise UnusableInput(
        f"{where}: saved as {found} by {head['software']}, this version reads {wanted}; {action}"
    )


def _array(archive: zipfile.ZipFile, name: str, entry: Any, where: str) -> NDArray[Any]:
    shape = tuple(int(n) for n in entry["shape"])
    dtype = np.dtype(entry["dtype"])
    if dtype.kind not in _KINDS or dtype.hasobject:
        raise _damaged(where, f"array {name!r} holds {dtype}")
    check_total(math.prod(shape) * dtype.itemsize, where)
    with archive.open(entry["file"]) as member:
        values = np.lib.format.read_array(member, allow_pickle=False)
    if values.shape != shape or values.dtype != dtype or _digest(values) != entry["sha256"]:
        raise _damaged(where, f"array {name!r} does not match its checksum")
    return np.asarray(values)
