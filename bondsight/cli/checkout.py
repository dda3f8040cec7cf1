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

VERBS = {
    "blind": (
        "tests.proof.trial.command",
        "add_blind_command",
        "the sealed trial: recordings whose physics is concealed",
    ),
    "conformance": (
        "tests.proof.conformance.command",
        "add_conformance_command",
        "published bond graphs with known results, judged case by case",
    ),
    "coverage": (
        "tests.proof.coverage.command",
        "add_coverage_command",
        "whether 95 %% intervals hold the truth, by simulation",
    ),
    "published": (
        "tests.proof.published.command",
        "add_published_command",
        "fit public benchmarks under their published protocols",
    ),
    "real": (
        "tests.proof.real.command",
        "add_real_command",
        "public recordings whose missing physics is documented, judged one by one",
    ),
}
"""Verb: its module, the function that adds it to a parser, and what it is."""


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
        The tests folder is not there: the tool was installed without it; or another package of
        that name is in use.
    """
    if not has_evidence():
        raise UnusableInput(
            f"bondsight {verb} works in a checkout of the project only: its folder tests is not "
            "installed with the tool; get the sources and run it there"
        )
    # a package tests of the user's own, in the working folder say, would come first
    sys.path.insert(0, str(_root()))
    tests = import_module(module.split(".")[0])
    if Path(str(tests.__file__)).resolve().parent != _root() / "tests":
        raise UnusableInput(
            f"bondsight {verb}: another package called tests is imported, {tests.__file__}; run "
            "it from another program or folder"
        )
    return import_module(module)


def add_developer_commands(verbs: Any, called: str) -> None:
    """Add the verbs of `VERBS`; only the one that is `called` imports what it needs."""
    for verb, (module, add, what) in VERBS.items():
        if verb == called and has_evidence():
            getattr(evidence(module, verb), add)(verbs)
        else:
            p = verbs.add_parser(verb, help=what)
            p.add_argument("rest", nargs=argparse.REMAINDER)
            p.set_defaults(run=_refusal(module, verb))


def _refusal(module: str, verb: str) -> Callable[[argparse.Namespace], int]:
    def run(_: argparse.Namespace) -> int:
        evidence(module, verb)
        return 0

    return run
