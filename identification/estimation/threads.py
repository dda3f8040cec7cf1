"""One thread for the linear algebra: with matrices this small, threads only wait for each other."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache

from threadpoolctl import ThreadpoolController


@contextmanager
def one_thread() -> Iterator[None]:
    """Hold the libraries that are loaded to one thread."""
    with _libraries(len(sys.modules)).limit(limits=1):
        yield


single_threaded = one_thread()
"""The same for a whole function, as its decorator."""


@lru_cache(maxsize=1)
def _libraries(modules: int) -> ThreadpoolController:
    """Look for libraries, again only after an import: the look takes as long as a small fit."""
    return ThreadpoolController()


@contextmanager
def calm() -> Iterator[None]:
    """One thread, and no overflow warnings from absurd trial steps."""
    with warnings.catch_warnings(), one_thread():
        warnings.simplefilter("ignore", RuntimeWarning)
        yield
