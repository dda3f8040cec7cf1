"""One thread for the linear algebra: with matrices this small, threads only wait for each other."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import wraps
from typing import ParamSpec, TypeVar

from threadpoolctl import threadpool_limits

P = ParamSpec("P")
T = TypeVar("T")


@contextmanager
def calm() -> Iterator[None]:
    """One thread, and no overflow warnings from absurd trial steps."""
    with warnings.catch_warnings(), threadpool_limits(1):
        warnings.simplefilter("ignore", RuntimeWarning)
        yield


def single_threaded(function: Callable[P, T]) -> Callable[P, T]:
    """Return `function` with its linear algebra held to one thread while it runs."""

    @wraps(function)
    def held(*args: P.args, **kwargs: P.kwargs) -> T:
        with threadpool_limits(1):
            return function(*args, **kwargs)

    return held
