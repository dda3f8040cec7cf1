"""Fixtures of the interferometer."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.hardware.devices.interferometer.bench import Bench, has_gcc, make_bench


@pytest.fixture(scope="session", autouse=True)
def compiler() -> None:
    """Skip where the stub cannot be built."""
    if not has_gcc():
        pytest.skip("the stub of siosifm is C code and there is no gcc")


@pytest.fixture
def bench() -> Iterator[Bench]:
    """Open a bench without faults."""
    with make_bench() as made:
        yield made
