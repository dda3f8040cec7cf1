"""Downloads of public data sets: only with a known checksum, whole or not at all.

Nothing is downloaded unless `fetch` is called, and then the folder of the user goes first. The
checksums of most published files are not known to this project: `fetch` then says so, and takes
the SHA-256 the user gives.
"""

from __future__ import annotations

import logging
import os
import re
from collections.abc import Mapping
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

from tqdm import tqdm

from bondgraph.signals.files import checks
from bondgraph.support.errors import BondsightError, UnusableInput, require_known
from identification.datasets.catalogue import protocol_here, public_set
from identification.datasets.places import FOLDER_VARIABLE, originals_folder
from identification.datasets.public_set import RAW_FILES, Original, Protocol, PublicSet

_TIMEOUT = 30.0


def fetch(
    name: str,
    folder: str | os.PathLike[str] | None = None,
    *,
    cache: str | os.PathLike[str] | None = None,
    sha256: Mapping[str, str] | None = None,
    server: str = RAW_FILES,
    retries: int = 2,
    progress: bool = False,
) -> Protocol:
    """Return a public data set: from the folder, from the cache, or downloaded.

    Parameters
    ----------
    name : str
        Name or alias.
    folder : path, optional
        Folder of the recordings; `BONDSIGHT_RECORDINGS` if not given. If the set is in it, nothing
        is downloaded.
    cache : path, optional
        Folder of downloads; `BONDSIGHT_CACHE` or the user's cache if not given.
    sha256 : mapping of str to str, optional
        File name -> SHA-256 in hexadecimal, for files whose checksum is not in the entry.
    server : str
        Where public repositories are served.
    retries : int
        Attempts after the first one.
    progress : bool
        Show a bar.

    Returns
    -------
    Protocol
        As `identification.datasets.protocol`.

    Raises
    ------
    UnknownName
        No set has this name, or a checksum is for a file the set does not have.
    UnusableInput
        One line: no checksum is known, the download failed, the file is not the one expected, the
        package `pooch` is absent, or the published files are of a form that is not read.
    """
    entry = public_set(name)
    found = protocol_here(entry, folder, cache)
    if found is not None:
        return found
    wanted = _wanted(entry)
    digests = _digests(entry, wanted, dict(sha256 or {}))
    where = originals_folder(cache) / entry.folder
    pooch = checks.optional("pooch", "a download", "data")
    paths = tuple(
        _download(pooch, o, digests[o.file], where, server, retries, progress) for o in wanted
    )
    try:
        return entry.read(paths)
    except BondsightError:
        for path in paths:
            path.unlink()
        raise


def _wanted(entry: PublicSet) -> tuple[Original, ...]:
    """Return the published files that make up one of the groups that are read."""
    if entry.published:
        return entry.published
    raise UnusableInput(
        f"data set {entry.name!r}: its published files ({entry.source}) are of a form that is not "
        f"read; convert them to {' + '.join(entry.files[0][:3])} in {entry.folder} of the folder "
        f"that {FOLDER_VARIABLE} names"
    )


def _digests(
    entry: PublicSet, wanted: tuple[Original, ...], given: dict[str, str]
) -> dict[str, str]:
    """Checksum of every file; refuse before anything is downloaded if one is missing."""
    files = [o.file for o in wanted]
    found = {o.file: o.sha256 for o in wanted}
    for file, digest in given.items():
        require_known("file", f"data set {entry.name}", files, file)
        text = digest.strip().lower()
        if not re.fullmatch("[0-9a-f]{64}", text):
            raise UnusableInput(
                f"{file}: {digest[:80]!r} is no SHA-256; it has 64 hexadecimal digits"
            )
        if found[file] not in (None, text):
            raise UnusableInput(f"{file}: its SHA-256 is {found[file]}, not {text}; leave it out")
        found[file] = text
    missing = [o for o in wanted if found[o.file] is None]
    if missing:
        names = ", ".join(o.file for o in missing[:3]) + (", ..." if len(missing) > 3 else "")
        raise UnusableInput(
            f"data set {entry.name!r}: no checksum of {names} is known, so nothing is downloaded; "
            f"get {missing[0].url()} by hand, put it at {entry.folder}/{missing[0].file} in the "
            f"folder that {FOLDER_VARIABLE} names, or give its SHA-256 from whom you trust "
            f"(--sha256 {missing[0].file}=HEX)"
        )
    return {file: digest for file, digest in found.items() if digest is not None}


def _download(
    pooch: Any, original: Original, digest: str, where: Path, server: str, retries: int, bar: bool
) -> Path:
    """Download one file, or find it with the right checksum."""
    keeper = pooch.create(
        path=where,
        base_url="",
        registry={original.file: f"sha256:{digest}"},
        urls={original.file: original.url(server)},
        retry_if_failed=retries,
    )
    log = pooch.get_logger()
    level = log.level
    # what goes wrong is told in one line below
    log.setLevel(logging.WARNING)
    try:
        return Path(keeper.fetch(original.file, downloader=partial(_get, bar)))
    except ValueError as error:
        if "hash" not in str(error).lower():
            raise _failed(original, server, error) from error
        raise UnusableInput(
            f"{original.file}: what {original.url(server)} sends has another SHA-256 than "
            f"{digest}; "
            "nothing was kept; it has changed or is served by reference, get it by hand"
        ) from error
    except OSError as error:  # of requests as well
        raise _failed(original, server, error) from error
    finally:
        log.setLevel(level)


def _get(bar: bool, url: str, target: str | os.PathLike[str], keeper: Any) -> None:
    """Write what an address sends; the connection is closed whatever happens."""
    requests = import_module("requests")
    with requests.get(url, timeout=_TIMEOUT, stream=True) as response:
        response.raise_for_status()
        length = int(response.headers.get("Content-Length", 0))
        size = 0
        with (
            open(target, "wb") as stream,
            tqdm(total=length or None, unit="B", unit_scale=True, disable=not bar) as shown,
        ):
            for block in response.iter_content(1 << 16):
                size += len(block)
                checks.check_total(size, url)
                stream.write(block)
                shown.update(len(block))


def _failed(original: Original, server: str, error: Exception) -> UnusableInput:
    text = " ".join(str(error).split())[:200]
    return UnusableInput(
        f"{original.file}: {original.url(server)} cannot be downloaded ({text}); check the network "
        f"or put the file in the folder that {FOLDER_VARIABLE} names"
    )
