"""Independent work on the joblib backend in force: loky, dask, ray."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
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
    return iter(Parallel(n_jobs=jobs, return_as=coming if streams else "list")(work))
