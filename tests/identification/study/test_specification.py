"""What is said of parameters: priors weigh as measurements do, and nonsense is refused."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from bondgraph.graph.bond_graph import BondGraph
from bondgraph.graph.parameter import Parameter
from bondgraph.signals.recording import Recording, Split
from bondgraph.support.errors import UnusableInput
from identification.estimation import (
    NO_NUISANCES,
    LogNormal,
    Normal,
    Nuisances,
    Prior,
    Study,
    Vary,
    estimate,
)
from identification.study.scaled import free_parameter
from tests.identification.estimation.plants import ohm

SIGMA, N = 0.5, 60


def measured() -> tuple[Recording, NDArray[np.float64], NDArray[np.float64]]:
    rng = np.random.default_rng(0)
    i = rng.standard_normal(N)
    u = 3.4 * i + SIGMA * rng.standard_normal(N)
    return Recording.from_arrays("ohm", {"i[A]": i, "u[V]": u}, fs=10.0), i, u


def fitted(prior: Prior | None, lower: float | None) -> tuple[float, tuple[float, float]]:
    made, _, _ = measured()
    every = Split(slice(0, N), slice(N, N), "all")
    vary = Vary("r", lower=lower, prior=prior)
    found = estimate(
        Study(
            ohm(), made, free=(vary,), noise={"u": SIGMA}, nuisances=NO_NUISANCES, splits=every
        )
    )  # fmt: skip
    e = found.estimate_of("r")
    return e.value, e.ci95


@pytest.mark.parametrize(("mean", "sd"), [(3.0, 0.05), (3.0, 0.02), (2.0, 10.0)])
def test_normal_prior_is_one_more_measurement(mean: float, sd: float) -> None:
    """Posterior of a linear Gaussian problem in closed form."""
    _, i, u = measured()
    weight = i @ i / SIGMA**2 + 1 / sd**2
    expected = (i @ u / SIGMA**2 + mean / sd**2) / weight
    value, (low, high) = fitted(Normal(mean, sd), 0.0)
    assert value == pytest.approx(expected, rel=1e-7)
    assert (high - low) / 2 == pytest.approx(1.96 / math.sqrt(weight), rel=1e-6)
    assert (high + low) / 2 == pytest.approx(value)


def test_log_normal_prior_is_the_mode_of_its_posterior() -> None:
    _, i, u = measured()
    prior = LogNormal(2.0, 1.1)

    def misfit(log_r: float) -> float:
        r = math.exp(log_r)
        away = (log_r - math.log(2.0)) / math.log(1.1)
        return float(np.sum((u - r * i) ** 2) / SIGMA**2 + away**2)

    best = minimize_scalar(misfit, bounds=(0.0, 2.0), method="bounded", options={"xatol": 1e-10})
    value, _ = fitted(prior, None)
    assert value == pytest.approx(math.exp(best.x), rel=1e-5)
    assert value < fitted(None, None)[0]


def test_prior_of_the_other_kind_by_the_delta_method() -> None:
    p = Parameter("r", 4.0, "ohm")
    log, linear = free_parameter(p, 4.0), free_parameter(Parameter("r", 4.0, lower=0.0), 4.0)
    assert log.log
    assert not linear.log
    assert Normal(3.0, 0.3).on_theta(log) == pytest.approx((math.log(0.75), 10.0))
    assert Normal(3.0, 0.3).on_theta(linear) == pytest.approx((-0.25, 4.0 / 0.3))
    assert LogNormal(2.0, math.e).on_theta(log) == pytest.approx((math.log(0.5), 1.0))
    assert LogNormal(2.0, math.e).on_theta(linear) == pytest.approx((-0.5, 2.0))
    with pytest.raises(UnusableInput, match="positive"):
        Normal(-3.0, 0.3).on_theta(log)


@pytest.mark.parametrize(
    "make",
    [
        lambda: Normal(1.0, 0.0),
        lambda: Normal(math.nan, 1.0),
        lambda: LogNormal(0.0, 2.0),
        lambda: LogNormal(1.0, 1.0),
    ],
)
def test_priors_without_width_are_refused(make: object) -> None:
    with pytest.raises(UnusableInput, match="positive width"):
        make()  # type: ignore[operator]


def test_vary_refuses_bounds_and_starts_that_contradict() -> None:
    with pytest.raises(UnusableInput, match="k: lower bound 5 is not below the upper bound 5"):
        Vary("k", lower=5.0, upper=5.0)
    with pytest.raises(UnusableInput, match="lower bound nan"):
        Vary("k", lower=math.nan)
    with pytest.raises(UnusableInput, match="start 9 lies outside of its bounds 1 to 5"):
        Vary("k", start=9.0, lower=1.0, upper=5.0)
    for start in (math.nan, math.inf, "a"):
        with pytest.raises(UnusableInput, match="start of k"):
            Vary("k", start=start)  # type: ignore[arg-type]
    for scale in (0.0, -1.0):
        with pytest.raises(UnusableInput, match="typical size"):
            Vary("k", scale=scale)


def test_nuisances_refuse_a_clock_that_is_none() -> None:
    for clock in (-1e-6, 0.1, math.nan):
        with pytest.raises(UnusableInput, match="2e-4"):
            Nuisances(clock=clock)
    assert not NO_NUISANCES.offsets
    assert not NO_NUISANCES.lags


@pytest.mark.parametrize("what", ["offsets", "lags", "commands"])
def test_nuisances_are_said_by_yes_and_no(what: str) -> None:
    with pytest.raises(UnusableInput, match=rf"{what} = .*True or False"):
        Nuisances(**{what: {"u": 1e9}})  # type: ignore[arg-type]


def offset_ohm(offset: float, **bounds: float) -> BondGraph:
    known = Parameter("u_0", offset, "V", positive=False, **bounds)  # type: ignore[arg-type]
    return ohm().with_parameters([known]).with_element("u", offset="u_0")


@pytest.mark.parametrize(
    ("offset", "bounds", "said"),
    [
        (1e9, {}, "u_0 = 1e.09 V, of the offset of sensor u, is .* times its largest reading"),
        (0.0, {"lower": -1.0, "upper": 1e12}, "u_0 = 1e.12 V"),
        (0.0, {"lower": 1.0, "upper": -1.0}, "lower bound 1 is not below the upper bound -1"),
        (0.0, {"lower": math.nan}, "lower bound nan"),
    ],
)
def test_an_offset_far_beyond_its_readings_is_refused(
    offset: float, bounds: dict[str, float], said: str
) -> None:
    with pytest.raises(UnusableInput, match=said) as refused:
        Study(offset_ohm(offset, **bounds), measured()[0])
    assert len(str(refused.value).splitlines()) == 1
    # a level that a unit or an absolute scale makes is none of it
    assert Study(offset_ohm(300.0, lower=-1e3, upper=1e3), measured()[0]).starts["u_0"] == 300.0
