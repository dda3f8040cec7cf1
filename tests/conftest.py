"""What all tests have in common: whoever runs them, from wherever."""

from __future__ import annotations

import gc
import os
import signal
import threading
from collections import Counter
from collections.abc import Callable, Iterator
from types import FrameType
from typing import Any

import pytest
from hypothesis import settings

# before NumPy is there: tests share the cores already, and threads of BLAS wait by spinning
for _threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_threads, "1")

# with as many workers of pytest as cores, more processes only add their imports
if "PYTEST_XDIST_WORKER" in os.environ:
    os.environ.setdefault("LOKY_MAX_CPU_COUNT", "1")

# an example may take as long as the machine needs
settings.register_profile("any machine", deadline=None)
settings.load_profile("any machine")

# thousands of items are made and none is freed: a fifth of the collection went into looking
gc.disable()

Action = Callable[[int, FrameType | None], Any] | signal.Handlers

USUAL: dict[str, Action] = {
    "SIGINT": signal.default_int_handler,
    "SIGTERM": signal.SIG_DFL,
    "SIGHUP": signal.SIG_DFL,
}


@pytest.fixture(autouse=True, scope="session")
def usual_signals() -> Iterator[None]:
    """Act as in a terminal, also for child processes: nohup and shells ignore some signals."""
    known = {getattr(signal, name): act for name, act in USUAL.items() if hasattr(signal, name)}
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {number: signal.signal(number, act) for number, act in known.items()}
    yield
    for number, act in before.items():
        signal.signal(number, signal.SIG_DFL if act is None else act)


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Sample large families, and begin with the files that hold slow tests.

    A slow test at the end would be left alone there.
    """
    seen: Counter[str] = Counter()
    for item in items:
        family = item.nodeid.partition("[")[0]
        mark = item.get_closest_marker("sampled")
        if mark and seen[family] % mark.kwargs["every"]:
            item.add_marker(pytest.mark.long)
        seen[family] += 1
    slow = {item.path for item in items if item.get_closest_marker("slow")}
    items.sort(key=lambda item: item.path not in slow)


def pytest_collection_finish() -> None:
    """Look for what can be freed again, but not among what stays."""
    gc.freeze()
    gc.enable()
