"""Independent work on the joblib backend in force: loky, dask, ray."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, nullcontext
from typing import Any


def results(work: Iterable[Any], jobs: int, *, ordered: bool = False) -> Iterator[Any]:
    """Begin delayed calls and return what they give, as it comes.

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
    from joblib import Parallel  # late: most commands start no work
    from joblib.parallel import get_active_backend

    backend, _ = get_active_backend()
    streams = bool(getattr(backend, "supports_return_generator", False))
    coming = "generator" if ordered else "generator_unordered"
    with _deaf_children() if streams else nullcontext():
        return iter(Parallel(n_jobs=jobs, return_as=coming if streams else "list")(work))


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
