"""Fits side by side: the better one is found, equal ones are not told apart, other data refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bondgraph.support.errors import UnusableInput
from identification.validation import Number, ValidationData, compare

from .made import coloured, material, record

N = 2000


def fit(error: np.ndarray, *names: str, seed: int = 0, n_free: int = 3) -> ValidationData:
    """Return a fit to the same measured record that misses the truth by `error`."""
    noise = np.random.default_rng(seed).standard_normal(N)
    truth = 10 * np.sin(0.05 * np.arange(N))
    measured = truth + noise
    r = record(measured - (truth - error), simulated=truth - error)
    numbers = tuple(Number(n, 1.0, "N/m", (0.9, 1.1)) for n in names)
    return material(replace(r, measured=measured[:, None]), numbers=numbers, n_free=n_free)


def test_the_better_fit_is_first_and_the_distance_is_in_standard_errors() -> None:
    wave = np.sin(0.02 * np.arange(N))
    c = compare({"poor": fit(0.6 * wave, "k"), "good": fit(0 * wave, "k", "d", n_free=4)})
    assert c.best.name == "good"
    poor = c.contestants[1]
    assert poor.behind > 3
    assert poor.p < 0.01
    assert "worse than the best" in poor.words
    assert [(n.simpler, n.richer) for n in c.nested] == [("poor", "good")]
    assert c.nested[0].test.p < 1e-6
    assert poor.criteria is not None
    assert c.best.criteria is not None
    assert poor.criteria.bic > c.best.criteria.bic + 10


def test_equal_fits_are_not_told_apart_beyond_chance() -> None:
    told = 0
    for seed in range(60):
        rng = np.random.default_rng(seed)
        a, b = 0.3 * coloured(rng, N, 0.9), 0.3 * coloured(rng, N, 0.9)
        told += compare({"a": fit(a, seed=seed), "b": fit(b, seed=seed)}).contestants[1].p < 0.05
    # nominal 5 %; the better of two is taken as the reference, the test is two-sided
    assert told <= 9


def test_a_fit_that_is_better_nearly_everywhere_is_not_called_worse() -> None:
    rng = np.random.default_rng(0)
    truth, noise = np.sin(0.05 * np.arange(N)), rng.standard_normal(N)
    loud = 0.6 * noise
    loud[-4:] = 60 * noise[-4:]  # one stretch carries the mean square
    fits = {}
    for name, residual in (("even", noise), ("loud", loud)):
        r = record(residual, simulated=truth - residual)
        fits[name] = material(replace(r, measured=truth[:, None]))
    c = compare(fits)
    loser = c.contestants[1]
    assert (loser.name, loser.p < 0.05, loser.behind < 0) == ("loud", True, True)
    assert "worse than the best by" not in loser.words
    assert f"smaller in most stretches, by {-loser.behind:.1f} standard errors" in loser.words


def test_nested_fits_with_noise_models_of_unlike_order_are_tested_on_common_samples() -> None:
    slow = coloured(np.random.default_rng(4), N, 0.6)
    long, short = np.array([1.0, -0.6, 0.0, 0.01]), np.array([1.0, -0.6])
    wave = 0.5 * np.sin(0.3 * np.arange(N))
    truth, fits = 10 * np.sin(0.05 * np.arange(N)), {}
    for name, residual, filter_, numbers in (
        ("poor", slow + wave, long, ("k",)), ("good", slow, short, ("k", "d"))
    ):  # fmt: skip
        r = record(residual, simulated=truth - residual, whitening=(filter_,))
        r = replace(r, measured=truth[:, None])
        parts = tuple(Number(n, 1.0, "N/m", (0.9, 1.1)) for n in numbers)
        fits[name] = material(r, numbers=parts, n_free=2 + len(numbers))
    c = compare(fits)
    assert [(n.simpler, n.richer) for n in c.nested] == [("poor", "good")]
    assert c.nested[0].test.p < 1e-6
    counts = {x.criteria.n for x in c.contestants if x.criteria is not None}
    assert counts == {int(fits["good"].records[0].train.sum()) - 3}


def test_the_memory_of_the_best_counts_for_all() -> None:
    slow = coloured(np.random.default_rng(2), N, 0.95)
    c = compare({"a": fit(0 * slow, "k"), "b": fit(2 * slow, "k")})
    worth = {x.name: x.criteria.effective for x in c.contestants if x.criteria is not None}
    assert worth["a"] == worth["b"]


@pytest.mark.parametrize(
    ("change", "why"),
    [
        ({"sha256": "cd"}, "comes from two different files"),
        ({"measured": np.zeros((N, 1))}, "holds different measured values"),
        ({"test": np.zeros(N, bool)}, "is split differently"),
        ({"floor": np.array([2.0])}, "two different noise floors"),
        ({"name": "other"}, "records run against other"),
        ({"names": ("y",)}, "is read as x and as y"),
    ],
)
def test_other_data_are_refused(change: dict[str, object], why: str) -> None:
    a = fit(np.zeros(N))
    a = replace(a, records=(replace(a.records[0], sha256="ab"),))
    b = replace(a, records=(replace(a.records[0], **change),))  # type: ignore[arg-type]
    with pytest.raises(UnusableInput, match=why):
        compare({"a": a, "b": b})


def test_floors_of_nanometres_differ_too() -> None:
    a = fit(np.zeros(N))
    small = tuple(
        material(replace(a.records[0], floor=np.array([floor]))) for floor in (1e-9, 5e-9)
    )
    with pytest.raises(UnusableInput, match="two different noise floors"):
        compare({"a": small[0], "b": small[1]})


def test_one_fit_is_nothing_to_compare() -> None:
    with pytest.raises(UnusableInput, match="two or more"):
        compare({"a": fit(np.zeros(N))})


def test_text_html_and_frame_say_the_same() -> None:
    pandas = pytest.importorskip("pandas")
    wave = np.sin(0.02 * np.arange(N))
    c = compare({"<b>": fit(0 * wave, "k"), "wave": fit(wave, "k", "d", n_free=4)})
    text, page, frame = str(c), c._repr_html_(), c.to_pandas()
    assert "<b>" in text
    assert "<b>" not in page
    assert "&lt;b&gt;" in page
    assert isinstance(frame, pandas.DataFrame)
    assert list(frame.index) == ["<b>", "wave"]
    assert frame.loc["wave", "chi2"] == pytest.approx(c.contestants[1].held_out)
    assert np.isnan(frame.loc["<b>", "d"])
    assert "fixed or absent" in text
