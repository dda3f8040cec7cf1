"""From fits to classes, profiles and words: a spring with known values."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bondgraph.support.errors import UnknownName, UnusableInput
from identification.estimation import Estimation, LogNormal, Study, Vary, estimate
from identification.uncertainty.fitted import FitView, from_estimation
from identification.uncertainty.information import Sensitivities
from identification.uncertainty.postflight import postflight, practical_of
from identification.uncertainty.practical import practical
from identification.uncertainty.profiles import profile_one, profiles, rise_at
from identification.uncertainty.statements import Statement
from identification.uncertainty.words import report
from tests.identification.uncertainty.plants import TRUTH, found, recorded, signals, spring, study


@pytest.fixture(scope="module")
def plain() -> Estimation:
    return found()


@pytest.fixture(scope="module")
def fit(plain: Estimation) -> FitView:
    return from_estimation(plain)


@pytest.fixture(scope="module")
def gauged() -> FitView:
    return from_estimation(found(spring(1.001)))


def test_sensitivities_are_those_of_the_readings(fit: FitView) -> None:
    # columns less nuisances and initial state: never longer than what the fit saw
    assert fit.sensitivities.names == ("m", "d", "k")
    assert fit.sensitivities.values == pytest.approx(list(TRUTH.values()), rel=0.02)
    assert fit.variance == pytest.approx(1.0, abs=0.1)
    assert fit.freedom == 600 - fit.stack.n
    for n, v in TRUTH.items():
        low, high = fit.plain.interval(n)
        assert low - (high - low) < v < high + (high - low)


def test_profile_of_a_nearly_linear_parameter_is_its_interval(fit: FitView) -> None:
    p = profile_one(fit, "k")
    assert p.shape == "two-sided"
    scale = np.sqrt(fit.inflation("k"))
    low, high = fit.plain.interval("k")
    assert p.interval[1] - p.interval[0] == pytest.approx(scale * (high - low), rel=0.05)
    rise, limit = rise_at(fit, "k", p.interval[1])
    assert rise == pytest.approx(limit, rel=0.02)
    assert rise_at(fit, "k", -1.0)[0] == np.inf


def test_profile_of_a_product(fit: FitView, gauged: FitView) -> None:
    one, other = (profile_one(f, "k/m") for f in (fit, gauged))
    assert one.value == pytest.approx(400.0, rel=0.01)
    # the ratio is determined even where neither part is
    assert other.interval == pytest.approx(one.interval, rel=1e-3)
    with pytest.raises(UnknownName):
        profile_one(fit, "k/mm")
    with pytest.raises(UnusableInput, match="whole power"):
        profile_one(fit, "k^0.5")


def test_gauge_is_flat_in_every_word(gauged: FitView) -> None:
    p = practical_of(gauged)
    (flat,) = p.of("flat direction")
    assert set(flat.names) == {"b", "m", "d", "k"}
    assert {str(c) for c in p.flat[0].determined} == {"b*m", "b*d", "b*k"}
    assert p.pinned == ()
    assert profile_one(gauged, "m").shape == "flat"
    assert "none of 4 parameters" in report(practical=p)


def test_a_prior_makes_a_gauge_known() -> None:
    free = ("m", "d", "k", Vary("b", prior=LogNormal(1.0, 1.02)))
    f = from_estimation(found(spring(1.001), free))
    p = practical_of(f)
    assert p.of("flat direction") == ()
    assert set(p.pinned) == {"m", "d", "k", "b"}
    assert f.plain.standard_errors[0] == pytest.approx(np.log(1.02), rel=0.2)
    # and what it leaves open is a trade-off, with the product known much better
    pairs = p.of("trade-off pair")
    assert any("b*k" in s.text or "k*b" in s.text for s in pairs)


def test_parameters_in_parallel_and_bounds() -> None:
    e = found(free=("m", "d", Vary("k", start=140.0, upper=150.0)))
    p = practical_of(from_estimation(e))
    (bound,) = p.of("at bound")
    assert bound.names == ("k",)
    assert bound.number > 50
    assert "would fall by" in bound.text
    assert {f.kind for f in postflight(e)} >= {"at bound", "misfit"}
    low, high = profile_one(from_estimation(e), "k").interval
    assert high == pytest.approx(150.0)
    assert low < 150.0


def test_a_good_fit_has_no_findings(plain: Estimation) -> None:
    assert postflight(plain) == ()
    text = report(
        practical=practical_of(from_estimation(plain)), plain=from_estimation(plain).plain
    )
    assert text.startswith("the data determine every parameter: m, d, k")


@pytest.mark.long
def test_profiles_in_parallel_are_the_same(fit: FitView) -> None:
    seen: list[str] = []
    one = profiles(fit, ("m", "k"), progress=lambda k, n, name: seen.append(f"{k}/{n} {name}"))
    two = profiles(fit, ("m", "k"), jobs=2)
    assert seen == ["1/2 m", "2/2 k"]
    for a, b in zip(one, two, strict=True):
        assert a.grid == pytest.approx(b.grid, rel=1e-12)
        assert a.cost == pytest.approx(b.cost, rel=1e-9, abs=1e-9)


def test_dead_and_loose_classes_on_arrays() -> None:
    rng = np.random.default_rng(0)
    j = rng.standard_normal((200, 4)) * [10.0, 1e-3, 0.2, 0.0]
    s = Sensitivities(("good", "weak", "loose", "gone"), np.ones(4), j)
    p = practical(s)
    assert p.pinned == ("good",)
    assert {x.names[0] for x in p.of("dead")} == {"weak", "gone"}
    assert [x.names for x in p.of("not pinned")] == [("loose",)]
    assert "no reading depends on gone" in str(p)


def test_trade_off_names_the_better_product() -> None:
    rng = np.random.default_rng(0)
    a, e = rng.standard_normal((2, 300))
    j = np.column_stack([2 * a, -a + 0.02 * e]) * 20
    p = practical(Sensitivities(("T", "k"), np.array([3.0, 5.0]), j))
    (pair,) = p.of("trade-off pair")
    assert pair.number > 0.99
    assert "T^2/k is known" in pair.text


@pytest.mark.parametrize(("width", "kinds"), [(1e-3, []), (0.2, ["trade-off pair"])])
def test_a_pair_of_which_each_is_known_well_is_no_finding(
    plain: Estimation, monkeypatch: pytest.MonkeyPatch, width: float, kinds: list[str]
) -> None:
    pair = Statement("trade-off pair", ("m", "k"), 0.998, "m and k go together")
    known = replace(practical_of(from_estimation(plain)), statements=(pair,))
    monkeypatch.setattr("identification.uncertainty.postflight.practical_of", lambda _: known)
    ends = tuple(
        replace(e, ci95=((1 - width) * e.value, (1 + width) * e.value)) for e in plain.estimates
    )
    assert [f.kind for f in postflight(replace(plain, estimates=ends))] == kinds


def test_other_methods_are_refused_in_one_line(plain: Estimation) -> None:
    with pytest.raises(UnusableInput, match="fit by single_shooting"):
        from_estimation(replace(plain, method="prediction_error"))


def test_known_noise_fixes_the_variance() -> None:
    e = estimate(study().changed(noise={"x": 4e-4}))
    f = from_estimation(e)
    assert f.known_noise
    assert f.variance == 1.0
    twice = from_estimation(found())
    assert f.plain.standard_errors == pytest.approx(2 * twice.plain.standard_errors, rel=0.1)
    assert signals()[2].size == f.residual.size


def test_recordings_with_values_of_their_own_and_windows() -> None:
    one = recorded(*signals(1))
    two = replace(recorded(*signals(2)), name="second")
    both = Study(spring(), (one, two), ("m", "k", Vary("d", own=True)))
    f = from_estimation(estimate(both))
    assert set(f.sensitivities.names) == {"m", "k", "d @run", "d @second"}
    assert f.channels == (400, 400)
    assert practical_of(f).statements == ()
    assert profile_one(f, "d @second").shape == "two-sided"
    w = from_estimation(estimate(Study(spring(), one, window=100)))
    assert w.channels == (100, 100, 100, 100)
    low, high = profile_one(w, "k").interval
    assert low < 200.0 < high


def test_broken_fits_are_not_judged() -> None:
    e = replace(found(), cost=float("inf"))
    assert [f.kind for f in postflight(e)][-1] == "not judged"


def test_beside_a_fit_that_overflows_there_sensitivities_are_those_nearer_by(
    fit: FitView, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A tank whose rim was moved by a tenth ran away, and with it the whole answer."""
    stack, usual = type(fit.stack), type(fit.stack).evaluate
    far = 0.02

    def evaluate(self: object, point: object, **more: object) -> object:
        made = usual(self, point, **more)  # type: ignore[arg-type]
        if np.abs(point.theta - fit.point.theta).max() <= far:  # type: ignore[attr-defined]
            return made
        return tuple(
            replace(e, residual=np.full_like(e.residual, np.nan), jacobian=e.jacobian * np.nan)
            for e in made
        )

    monkeypatch.setattr(stack, "evaluate", evaluate)
    near = fit.elsewhere()
    moved = np.abs(np.log(np.array(near.values) / np.array(fit.sensitivities.values)))
    assert 0.0 < moved.max() <= far
    far = -1.0
    assert fit.elsewhere() is fit.sensitivities
