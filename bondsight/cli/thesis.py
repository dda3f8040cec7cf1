"""``bondsight thesis``: the printed values of the stack models against what they give."""

from __future__ import annotations

import argparse
from typing import Any


def add_thesis_command(verbs: Any) -> None:
    """Add ``thesis`` to the sub-parsers of ``bondsight``."""
    p = verbs.add_parser("thesis", help="printed values of the stack models against what they give")
    p.add_argument(
        "--inconsistencies", action="store_true", help="list what is misprinted, and the right form"
    )
    p.add_argument("--pairings", action="store_true", help="every structure with every operator")
    p.set_defaults(run=_thesis)


def _thesis(options: argparse.Namespace) -> int:
    from actuators.thesis.report import comparison_report, findings_report, pairing_report

    if options.inconsistencies:
        print("\n".join(findings_report()))
    if options.pairings:
        print("\n".join(pairing_report()))
    if not (options.inconsistencies or options.pairings):
        print("\n".join(comparison_report()))
    return 0
