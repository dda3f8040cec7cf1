"""Many starts: the same result whoever runs them, a worker lost included."""

from __future__ import annotations

import os
import pickle
import signal
import sys
import warnings

import joblib
import numpy as np
import pytest

from bondgraph.support.errors import UnknownName, UnusableInput
from identification.estimation import (
    NO_NUISANCES,
    Estimation,
    FitStatus,
    Study,
    Vary,
    estimate,
    starts,
)
from identification.estimation.starts import Starts, many_starts
from identification.study.joint import JointPoint
from tests.identification.estimation.plants import FREE, TRUTH, misses, record, spring, study

WIDE = (Vary("m", lower=0.05, upper=5.0), Vary("d", start=1.0), Vary("k", lower=20.0, upper=2e4))
COUNT = 8


def asked() -> Study:
    return study(record(300), free=WIDE)


def same(a: Starts, b: Starts) -> None:
    assert [x.index for x in a.arrivals] == [x.index for x in b.arrivals]
    assert np.array_equal(a.costs, b.costs)
    for x, y in zip(a.arrivals, b.arrivals, strict=True):
        assert np.array_equal(x.theta, y.theta)
        assert np.array_equal(x.start, y.start)
        assert x.status is y.status
    assert a.best.values == b.best.values


@pytest.fixture(scope="module")
def alone() -> Starts:
    return many_starts(asked(), COUNT, jobs=1)


def test_waterfall_rises_and_the_best_is_the_truth(alone: Starts) -> None:
    assert sorted(a.index for a in alone.arrivals) == list(range(COUNT))
    assert (np.diff(alone.costs) >= 0).all()
    assert alone.agreeing == np.sum(alone.costs <= alone.costs[0] * 1.001)
    assert alone.agreeing >= 2
    assert max(misses(alone.best, TRUTH).values()) < 3.3
    assert alone.best.status is FitStatus.CONVERGED
    assert alone.names == alone.best.stack.names
    assert f"of {COUNT} starts" in str(alone)
    assert alone.wanted == COUNT


def test_starts_lie_in_the_bounds_and_the_first_is_the_declared(alone: Starts) -> None:
    stack = asked().stack()
    lower, upper = stack.bounds
    every = np.array([a.start for a in alone.arrivals])
    assert (every >= lower - 1e-12).all()
    assert (every <= upper + 1e-12).all()
    first = next(a for a in alone.arrivals if a.index == 0)
    assert np.array_equal(first.start, stack.start().theta)
    k = stack.names.index("k")
    assert np.ptp(every[:, k]) > 0.6 * (upper[k] - lower[k])


def test_the_best_is_fitted_on_from_where_it_arrived(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its initial states and offsets too: from its values alone another valley may be nearer."""
    begun: list[JointPoint] = []

    def kept(study: Study, method: str, *, start: JointPoint, progress: object) -> Estimation:
        begun.append(start)
        return estimate(study, method, start=start)

    monkeypatch.setattr(starts, "estimate", kept)
    found = many_starts(asked(), 2, jobs=1)
    (point,), best = begun, found.arrivals[0]
    assert np.array_equal(point.theta, best.theta)
    assert all(map(np.array_equal, point.states, best.states))
    assert found.best.cost <= best.cost * 1.5


@pytest.mark.parametrize("backend", ["threading", "loky"])
@pytest.mark.sampled(every=2)
def test_result_does_not_depend_on_the_workers(alone: Starts, backend: str) -> None:
    with joblib.parallel_config(backend=backend):
        same(many_starts(asked(), COUNT, jobs=2), alone)


def test_seed_decides(alone: Starts) -> None:
    same(many_starts(asked(), COUNT, jobs=1, seed=0), alone)
    other = many_starts(asked(), COUNT, jobs=1, seed=1)
    starts = {a.index: a.start for a in alone.arrivals}
    differ = [not np.allclose(a.start, starts[a.index]) for a in other.arrivals if a.index]
    assert all(differ)
    assert other.best.values["k"] == pytest.approx(alone.best.values["k"], rel=1e-5)


def test_best_is_as_good_as_one_fit_from_a_good_start(alone: Starts) -> None:
    good = estimate(study(record(300), free=FREE))
    assert alone.best.values["k"] == pytest.approx(good.values["k"], rel=1e-4)
    assert alone.best.cost == pytest.approx(good.cost, rel=1e-3)


@pytest.mark.parametrize("jobs", [1, 2])
def test_interrupt_keeps_what_has_arrived(jobs: int) -> None:
    heard: list[str] = []

    def stop(text: str, fraction: float) -> None:
        heard.append(text)
        if len(heard) == 3:
            raise KeyboardInterrupt

    found = many_starts(asked(), COUNT, jobs=jobs, progress=stop)
    assert len(found.arrivals) == 3
    assert found.wanted == COUNT
    assert "cancelled after 3 of 8" in str(found)
    assert np.isfinite(found.best.cost)


def test_progress_counts_the_starts() -> None:
    heard: list[tuple[str, float]] = []
    many_starts(asked(), 4, jobs=1, progress=lambda text, share: heard.append((text, share)))
    shares = [s for text, s in heard if text.startswith("start ")]
    assert shares == pytest.approx([0.225, 0.45, 0.675, 0.9])
    assert heard[-1] == ("done", 1.0)


def test_starts_travel(alone: Starts) -> None:
    same(pickle.loads(pickle.dumps(alone)), alone)


def test_multiple_shooting_from_many_starts() -> None:
    found = many_starts(asked(), 3, jobs=1, method="multiple_shooting", max_iterations=15)
    assert len(found.arrivals) == 3
    assert found.best.method == "multiple_shooting"
    assert found.best.values["k"] == pytest.approx(200.0, rel=0.02)


def test_nothing_free_gives_the_same_cost_each_time() -> None:
    bare = Study(spring(), record(200), free=(), nuisances=NO_NUISANCES, initial="rest")
    found = many_starts(bare, 3, jobs=1)
    assert np.ptp(found.costs) == 0
    assert found.agreeing == 3


def test_bad_counts_are_refused() -> None:
    with pytest.raises(UnusableInput, match="0 starts"):
        many_starts(asked(), 0)
    with pytest.raises(UnusableInput, match="jobs = 0"):
        many_starts(asked(), 2, jobs=0)
    with pytest.raises(UnusableInput, match="seed = -1"):
        many_starts(asked(), 2, seed=-1)
    with pytest.raises(UnknownName, match="Did you mean 'single_shooting'"):
        many_starts(asked(), 2, method="single_shoting")


@pytest.mark.long
@pytest.mark.skipif(sys.platform == "win32", reason="kills a process by a signal of its own")
@pytest.mark.filterwarnings("ignore")
def test_dask_cluster_that_loses_a_worker_loses_no_start(alone: Starts) -> None:
    """One of two worker processes is killed while its tasks run."""
    distributed = pytest.importorskip("distributed")
    dask = pytest.importorskip("dask")
    killed: list[int] = []
    settings = {
        "distributed.scheduler.allowed-failures": 20,
        "distributed.worker.daemon": True,
        "logging.distributed": "critical",
    }
    count = COUNT + 4
    with (
        warnings.catch_warnings(),
        dask.config.set(settings),
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None,
            host="127.0.0.1", silence_logs=50,
        ) as cluster,
        distributed.Client(cluster),
    ):  # fmt: skip
        warnings.simplefilter("ignore")

        def lose(text: str, fraction: float) -> None:
            if text.startswith("start 3 ") and not killed:
                killed.append(next(iter(cluster.workers.values())).pid)
                os.kill(killed[0], signal.SIGKILL)

        with joblib.parallel_config(backend="dask"):
            found = many_starts(asked(), count, jobs=2, progress=lose)
    assert len(killed) == 1
    assert sorted(a.index for a in found.arrivals) == list(range(count))
    same(found, many_starts(asked(), count, jobs=1))
    first = {a.index: a.cost for a in found.arrivals}
    assert all(first[a.index] == a.cost for a in alone.arrivals)
