"""IPOPT ends where Gauss-Newton does, with both linear solvers, within bounds."""

from __future__ import annotations

import pytest

from bondgraph.support.errors import UnknownName, UnusableInput
from identification.estimation import (
    NO_NUISANCES,
    Estimation,
    FitStatus,
    Normal,
    Nuisances,
    Study,
    Vary,
    estimate,
)
from tests.identification.estimation.plants import record, spring, study


@pytest.fixture(scope="module")
def newton() -> Estimation:
    return estimate(study(record(700)))


@pytest.mark.parametrize("solver", ["mumps", "spral"])
def test_same_answer_as_gauss_newton(newton: Estimation, solver: str) -> None:
    found = estimate(study(record(700)), optimiser="ipopt", linear_solver=solver)
    assert found.status is FitStatus.CONVERGED
    assert found.optimiser == "ipopt"
    assert found.cost == pytest.approx(newton.cost, rel=1e-5)
    for a, b in zip(found.estimates, newton.estimates, strict=True):
        width = b.ci95[1] - b.ci95[0]
        assert abs(a.value - b.value) < 0.01 * width
        assert a.ci95[1] - a.ci95[0] == pytest.approx(width, rel=0.02)


@pytest.mark.parametrize("solver", ["ma97", "ma27", "pardiso", ""])
def test_other_linear_solvers_are_refused(solver: str) -> None:
    with pytest.raises(UnusableInput, match="'mumps' or 'spral' only"):
        estimate(study(record(100)), optimiser="ipopt", linear_solver=solver)
    with pytest.raises(UnknownName, match="Did you mean 'ipopt'"):
        estimate(study(record(100)), optimiser="ippt")


def test_bounds_priors_and_nuisances_hold() -> None:
    free = ("m", Vary("d", prior=Normal(2.5, 1e-4)), Vary("k", start=240.0, lower=230.0, upper=400))
    made = study(record(500), free=free, nuisances=Nuisances(commands=True, offsets=False))
    found, other = estimate(made, optimiser="ipopt"), estimate(made)
    assert found.estimate_of("k").at_bound
    assert found.values["k"] == pytest.approx(230.0, rel=1e-6)
    assert found.values["d"] == pytest.approx(2.5, abs=1e-3)
    assert found.values["m"] == pytest.approx(other.values["m"], rel=1e-3)


def test_nothing_free_is_no_failure() -> None:
    bare = Study(spring(), record(300), free=(), nuisances=NO_NUISANCES, initial="rest")
    for optimiser in ("gauss_newton", "ipopt"):
        found = estimate(bare, optimiser=optimiser)
        assert found.estimates == ()
        assert found.rmse()["x"] == pytest.approx(2e-4, rel=0.1)


@pytest.mark.parametrize("at", [1, 3])
def test_interrupt_keeps_the_best_so_far(at: int) -> None:
    count = 0

    def stop(text: str, fraction: float) -> None:
        nonlocal count
        count += 1
        if count == at:
            raise KeyboardInterrupt

    found = estimate(study(record(400)), optimiser="ipopt", progress=stop)
    assert found.status is FitStatus.CANCELLED
    assert abs(found.values["k"] - 200.0) < 100.0
    assert count == at + 1  # one more call says that it is done
