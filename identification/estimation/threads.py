"""One thread for the linear algebra: with matrices this small, threads only wait for each other."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from functools import lru_cache, wraps
from typing import Any, ParamSpec, TypeVar

from threadpoolctl import ThreadpoolController

P = ParamSpec("P")
T = TypeVar("T")


def one_thread() -> AbstractContextManager[Any]:
    """Hold the libraries that are loaded to one thread."""
    held: AbstractContextManager[Any] = _libraries(len(sys.modules)).limit(limits=1)
    return held


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


def single_threaded(function: Callable[P, T]) -> Callable[P, T]:
    """Return `function` with its linear algebra held to one thread while it runs."""

    @wraps(function)
    def held(*args: P.args, **kwargs: P.kwargs) -> T:
        with one_thread():
            return function(*args, **kwargs)

    return held
