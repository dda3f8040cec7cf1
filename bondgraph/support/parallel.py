"""Independent work on the joblib backend in force: loky, dask, ray."""

from __future__ import annotations

import signal
import threading
import warnings
from collections.abc import Generator, Iterable, Iterator
from contextlib import contextmanager
from typing import Any


def results(work: Iterable[Any], jobs: int, *, ordered: bool = False) -> Iterator[Any]:
    """Begin delayed calls and return what they give, as it comes.

    Who asks no more (an error, Ctrl-C, a search that has ended) ends what still runs.

    Parameters
    ----------
    work : iterable
        Of `joblib.delayed` calls.
    jobs : int
        Processes; -1 for all cores.
    ordered : bool
        In the order of the calls; else whatever is done first comes first.

    Notes
    -----
    A backend that gives nothing before all is done (ray) gives all at once.
    """
    from joblib.parallel import get_active_backend  # late: most commands start no work

    backend, _ = get_active_backend()
    if not getattr(backend, "supports_return_generator", False):
        return iter(_endable()(n_jobs=jobs, return_as="list")(work))
    coming = "generator" if ordered else "generator_unordered"
    with _deaf_children():
        return _Coming(_Begun(_endable()(n_jobs=jobs, return_as=coming)(work)))


@contextmanager
def ending() -> Iterator[None]:
    """With the block ends the work that this thread began in it, wanted or not.

    An exception keeps the frames it went through, and so the work that nobody will ask for again.
    """
    before = set(_OPEN)
    try:
        yield
    finally:
        for begun in _OPEN - before:
            begun.leave()


class _Begun:
    """Work that runs; its own thread ends it."""

    def __init__(self, stream: Generator[Any, None, None]) -> None:
        self.stream, self._thread = stream, threading.get_ident()
        _OPEN.add(self)

    def leave(self) -> None:
        """End it in its own thread; another one (of a garbage collection) lets it lie."""
        if threading.get_ident() == self._thread:
            self.end()

    def end(self) -> None:
        """End what still runs; that it was not asked for is no news."""
        _OPEN.discard(self)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            self.stream.close()


_OPEN: set[_Begun] = set()
"""Held, so that no other thread collects it."""


class _Coming:
    """What is handed to who asks."""

    def __init__(self, begun: _Begun) -> None:
        self._begun = begun

    def __iter__(self) -> _Coming:
        return self

    def __next__(self) -> Any:
        try:
            return next(self._begun.stream)
        except BaseException:
            self._begun.end()
            raise

    def __del__(self) -> None:
        self._begun.leave()


def _endable() -> Any:
    """Return the class of joblib, less a race of its threads.

    One hands on the next call while another ends the processes: a traceback helps nobody.
    """
    from joblib import Parallel
    from joblib.externals.loky.process_executor import ShutdownExecutorError

    class Endable(Parallel):  # type: ignore[misc]
        def dispatch_next(self) -> None:
            try:
                super().dispatch_next()
            except ShutdownExecutorError:
                return

    return Endable


@contextmanager
def _deaf_children() -> Iterator[None]:
    """Let processes that begin now ignore Ctrl-C: who asked for the work ends it, in one line."""
    if threading.current_thread() is not threading.main_thread():
        yield  # only the main thread has a say
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before or signal.SIG_DFL)
