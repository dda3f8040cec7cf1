"""``bondsight recordings``: the public recordings, where they are, how they are parted."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from typing import Any

from bondgraph.support.errors import UnusableInput


def add_recordings_command(verbs: Any) -> None:
    """Add ``recordings [NAME] [--fetch] [--sha256 FILE=HEX]`` to the sub-commands."""
    p = verbs.add_parser("recordings", help="list the known public recordings, or fetch one")
    p.add_argument("name", nargs="?", default=None, help="a data set: its parts and its origin")
    p.add_argument("--fetch", action="store_true", help="download it; needs --sha256")
    p.add_argument(
        "--sha256", action="append", default=[], metavar="FILE=HEX",
        help="checksum that a published file must have; none is known here, so give that of whom "
        "you trust. Nothing is downloaded without",
    )  # fmt: skip
    p.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> int:
    from identification.datasets.listing import details, listing

    if options.name is None:
        if options.fetch:
            raise UnusableInput("--fetch needs the name of a data set; see bondsight recordings")
        print(listing())
        return 0
    found = None
    if options.fetch:
        from identification.datasets.download import fetch

        found = fetch(options.name, sha256=_digests(options.sha256), progress=sys.stderr.isatty())
    print(details(options.name, found))
    return 0


def _digests(entries: Sequence[str]) -> dict[str, str]:
    pairs = [e.partition("=") for e in entries]
    for file, sign, digest in pairs:
        if not (file and sign and digest):
            raise UnusableInput(f"--sha256 {file} is not FILE=HEX; write --sha256 data.mat=0123...")
    return {file: digest for file, _, digest in pairs}
