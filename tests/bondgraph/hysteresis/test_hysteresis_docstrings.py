"""Every example in the package runs."""

from __future__ import annotations

import doctest
from importlib import import_module
from pkgutil import iter_modules
from typing import Any

import pytest

import bondgraph.hysteresis

MODULES = ["bondgraph.support.ops", "bondgraph.hysteresis"] + [
    f"bondgraph.hysteresis.{module.name}" for module in iter_modules(bondgraph.hysteresis.__path__)
]


@pytest.mark.parametrize("name", MODULES)
def test_examples_run(name: Any) -> None:
    assert doctest.testmod(import_module(name)).failed == 0
