"""``bondsight effects``: the catalogue of the diagnosis, as a table or one effect in full."""

from __future__ import annotations

import argparse
from typing import Any


def add_effects_command(verbs: Any) -> None:
    """Add the command to the sub-parsers of ``bondsight``."""
    p = verbs.add_parser("effects", help="print the catalogue of effects, or one in full")
    p.add_argument(
        "names", nargs="*", metavar="EFFECT",
        help="print all that is known of these effects, or of the effects that have such a law",
    )  # fmt: skip
    p.set_defaults(run=_effects)


def _effects(options: argparse.Namespace) -> int:
    from identification.diagnosis.catalogue.words import catalogue_table, described

    if options.names:
        print("\n\n".join(described(n) for n in options.names))
    else:
        print(catalogue_table())
    return 0
