"""Downloaded sets in our own format: every part a saved recording, the folder whole or absent."""

from __future__ import annotations

import json
import os
import shutil
import tempfile
from pathlib import Path
from typing import Any

from bondgraph.signals.recording import Recording
from bondgraph.support.errors import BondsightError, UnusableInput
from identification.datasets.public_set import Protocol, PublicSet

_VERSION = 1
_LIST = "parts.json"


def _folder(entry: PublicSet, cache: Path) -> Path:
    return cache / f"{entry.name}-{_VERSION}"


def store_converted(entry: PublicSet, paths: tuple[Path, ...], cache: Path) -> Protocol:
    """Read original files and keep their parts; a second call replaces them.

    Raises
    ------
    UnusableInput
        The files cannot be read as this set, or the cache cannot be written.
    """
    made = entry.read(paths)
    target = _folder(entry, cache)
    named: dict[str, Any] = {"own": not made.official}
    try:
        cache.mkdir(parents=True, exist_ok=True)
        fresh = Path(tempfile.mkdtemp(dir=cache, prefix=f".{entry.name}.", suffix=".part"))
    except OSError as error:
        raise UnusableInput(f"{cache}: cannot be written ({error.strerror or error})") from error
    try:
        for kind, records in (("train", made.train), ("tests", tuple(made.tests.values()))):
            named[kind] = {
                r.name.split("/", 2)[2]: f"{kind}-{i}.npz" for i, r in enumerate(records)
            }
            for record, file in zip(records, named[kind].values(), strict=True):
                record.save(fresh / file)
        (fresh / _LIST).write_text(json.dumps(named, indent=1) + "\n", encoding="utf-8")
        os.chmod(fresh, 0o755)
        if target.exists():
            shutil.rmtree(target)
        os.replace(fresh, target)
    except OSError as error:
        raise UnusableInput(f"{target}: cannot be written ({error.strerror or error})") from error
    finally:
        shutil.rmtree(fresh, ignore_errors=True)
    return made


def is_converted(entry: PublicSet, cache: Path) -> bool:
    """Whether the parts of a set are in the cache."""
    return (_folder(entry, cache) / _LIST).is_file()


def open_converted(entry: PublicSet, cache: Path) -> Protocol | None:
    """Return what was downloaded and converted before; None if there is nothing.

    Raises
    ------
    UnusableInput
        A file of it is damaged: the line says which folder to delete.
    """
    folder = _folder(entry, cache)
    if not is_converted(entry, cache):
        return None
    try:
        named = json.loads((folder / _LIST).read_text(encoding="utf-8"))
        found = {
            kind: {
                name: Recording.open(folder / Path(file).name) for name, file in named[kind].items()
            }
            for kind in ("train", "tests")
        }
        return entry.protocol(found["train"], found["tests"], own=bool(named["own"]))
    except (BondsightError, ValueError, KeyError, AttributeError, OSError) as error:
        raise UnusableInput(
            f"{folder}: the downloaded set cannot be opened ({error}); delete the folder and fetch "
            "again"
        ) from error
