"""The examples in the docstrings of the filter and what it stands on."""

from __future__ import annotations

import doctest
from importlib import import_module

import pytest


@pytest.mark.parametrize(
    "module",
    [
        "estimation.prediction.diffusion",
        "statistics.whiteness",
        "study.process_noise",
    ],
)
def test_examples_in_the_docstrings(module: str) -> None:
    result = doctest.testmod(import_module(f"identification.{module}"))
    assert result.attempted > 0
    assert result.failed == 0
