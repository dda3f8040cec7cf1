"""Work that nobody asks for any more ends, and no library says a word about it."""

from __future__ import annotations

import time
import warnings
from typing import Any

import joblib
import pytest
from joblib import delayed
from joblib.externals.loky.process_executor import ShutdownExecutorError

from bondgraph.support import parallel
from bondgraph.support.parallel import ending, results


def begun(jobs: int = 2) -> Any:
    made = results((delayed(time.sleep)(0.02) for _ in range(50)), jobs)
    next(made)
    return made


@pytest.mark.parametrize("jobs", [1, 2])
def test_what_is_left_ends_without_a_warning(jobs: int) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        made = begun(jobs)
        assert parallel._OPEN
        del made
    assert not parallel._OPEN


def test_what_an_exception_holds_ends_with_the_block() -> None:
    kept = begun(jobs=1)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with ending():
            made = begun()
    assert list(made) == []
    assert next(kept) is None  # what was begun before goes on
    kept._begun.end()


def test_a_thread_that_comes_late_hands_nothing_on(monkeypatch: pytest.MonkeyPatch) -> None:
    def ended(_: Any) -> None:
        raise ShutdownExecutorError("cannot schedule new futures after shutdown")

    monkeypatch.setattr(joblib.Parallel, "dispatch_next", ended)
    assert parallel._endable()(n_jobs=1).dispatch_next() is None
