"""Verbs for developers: they live in the tests of a checkout, which are not installed."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

import bondsight
from bondgraph.support.errors import UnusableInput

__all__ = ["add_developer_commands", "evidence", "has_evidence"]

VERBS = {
    "blind": ("tests.proof.trial.command", "add_blind_command"),
    "conformance": ("tests.proof.conformance.command", "add_conformance_command"),
    "coverage": ("tests.proof.coverage.command", "add_coverage_command"),
    "published": ("tests.proof.published.command", "add_published_command"),
}
"""Verb: module, and the function that adds it to the parser."""


def _root() -> Path:
    return Path(bondsight.__file__).resolve().parents[1]


def has_evidence() -> bool:
    """Whether this is a checkout, with proofs and benchmarks beside the packages."""
    return (_root() / "tests" / "proof" / "__init__.py").is_file()


def evidence(module: str, verb: str) -> ModuleType:
    """Import a module of the tests folder.

    Parameters
    ----------
    module : str
        Dotted name, ``tests.proof...`` or ``tests.benchmarks...``.
    verb : str
        What needs it, for the message.

    Raises
    ------
    UnusableInput
        The tests folder is not there: the tool was installed without it.
    """
    if not has_evidence():
        raise UnusableInput(
            f"bondsight {verb} works in a checkout of the project only: its folder tests is not "
            "installed with the tool; get the sources and run it there"
        )
    root = str(_root())
    if root not in sys.path:
        sys.path.insert(0, root)
    return import_module(module)


def add_developer_commands(verbs: Any) -> None:
    """Add the verbs of `VERBS`; where the tests folder is missing, verbs that say so."""
    for verb, (module, add) in VERBS.items():
        if has_evidence():
            getattr(evidence(module, verb), add)(verbs)
        else:
            p = verbs.add_parser(verb, help="needs a checkout of the project")
            p.add_argument("rest", nargs=argparse.REMAINDER)
            p.set_defaults(run=_refusal(module, verb))


def _refusal(module: str, verb: str) -> Callable[[argparse.Namespace], int]:
    def run(_: argparse.Namespace) -> int:
        evidence(module, verb)
        return 0

    return run
