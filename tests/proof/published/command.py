"""``bondsight published``: public recordings under their published protocols, beside targets."""

from __future__ import annotations

import argparse
import json
import sys
from typing import Any


def add_published_command(verbs: Any) -> None:
    """Add the command to the sub-parsers of ``bondsight``."""
    p = verbs.add_parser(
        "published", help="public recordings under their published protocols, beside targets"
    )
    p.add_argument("names", nargs="*", metavar="NAME", help="recordings; all if none is given")
    p.add_argument("--folder", metavar="FOLDER", help="folder of the recordings")
    p.add_argument(
        "--share", type=float, default=1.0, metavar="PART",
        help="part of the training samples that is used, for a quick trial",
    )  # fmt: skip
    p.add_argument("--json", action="store_true", help="print everything as JSON")
    p.add_argument("--list", action="store_true", help="print the names")
    p.set_defaults(run=_published)


def _published(options: argparse.Namespace) -> int:
    """Exit code 0 if every target is reached, 1 if not."""
    from bondgraph.support.errors import UnusableInput, unknown_name
    from tests.proof.published.catalogue import PROTOCOLS, run_protocol
    from tests.proof.published.outcome import Outcome
    from tests.proof.published.table import table

    if options.list:
        print("\n".join(PROTOCOLS))
        return 0
    if not 0.0 < options.share <= 1.0:
        raise UnusableInput(f"--share {options.share}: give a part above 0 and up to 1")
    names = tuple(options.names) or tuple(PROTOCOLS)
    for n in names:
        if n not in PROTOCOLS:
            raise unknown_name("published protocol", n, "bondsight published", PROTOCOLS)
    made: list[Outcome] = []
    absent = 0
    for n in names:
        try:
            with _bar(n) as bar:
                made.append(run_protocol(n, options.folder, share=options.share, progress=bar))
        except UnusableInput as error:
            if options.names:
                raise
            absent += 1
            print(f"{n}: skipped: {error}", file=sys.stderr)
            continue
        if not options.json:
            print(table(made[-1:]), end="\n\n", flush=True)
    if options.json:
        print(json.dumps([o.to_dict() for o in made], indent=2, allow_nan=False))
    elif made:
        missed = [o.name for o in made if not o.reached]
        words = "every target is reached" if not missed else f"not reached: {', '.join(missed)}"
        print(f"{len(made)} recordings, {absent} absent; {words}")
    return 0 if made and all(o.reached for o in made) else 1


def _bar(name: str) -> Any:
    from bondsight.cli.progress import Bar

    class Named(Bar):
        def __call__(self, text: str, fraction: float) -> None:
            super().__call__(f"{name}: {text}", fraction)

    return Named(quiet=not sys.stderr.isatty())
