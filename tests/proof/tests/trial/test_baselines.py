"""The baselines that compute: a black box on a residual, a sparse regression on the screening."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from actuators.models.plants import plant_model
from bondgraph.signals.split import interleaved
from identification.diagnosis.catalogue import CATALOGUE, UNNAMED
from identification.diagnosis.diagnose import Diagnosis
from identification.diagnosis.screening.observation import scene
from identification.diagnosis.screening.port_response import probes
from identification.diagnosis.screening.score_test import Screened, projection, screen
from identification.estimation.single_record import Fit, fit
from identification.study.data import Data
from identification.study.problem import Problem
from tests.proof.trial.alongside import alongside
from tests.proof.trial.black_box import black_box
from tests.proof.trial.columns import Columns, columns_of
from tests.proof.trial.sparse import OPTIMISERS, sparse_terms
from tests.settled import simulate


def squares(left: Any, train: Any) -> tuple[float, float]:
    return float(np.mean(left[train] ** 2)), float(np.mean(left[~train] ** 2))


def test_black_box_learns_a_bent_filter_and_nothing_from_noise() -> None:
    rng = np.random.default_rng(2)
    u = rng.standard_normal((3000, 1))
    noise = 0.01 * rng.standard_normal((3000, 2))
    late = np.roll(u[:, 0], 2)
    bent = np.column_stack([0.3 * late + 0.1 * u[:, 0] ** 3, 0.0 * late]) + noise
    train = np.arange(3000) < 2000
    floor = np.array([0.01, 0.01])
    before = float(np.mean((bent[~train] / floor) ** 2))
    learned, held = squares(black_box(u, bent, floor, train), train)
    assert before > 500
    assert held == pytest.approx(1.0, abs=0.15)
    assert learned < held * 1.1
    _, held = squares(black_box(u, noise, floor, train), train)
    assert held == pytest.approx(1.0, abs=0.1)


@pytest.fixture(scope="module")
def screened() -> tuple[Fit, list[Screened]]:
    """The stack, which has a two-port, with a force that its model does not have."""
    graph, n, dt = plant_model("stack", ("i", "x")), 700, 2e-5
    rng = np.random.default_rng(5)
    time = dt * np.arange(n)
    drive = 20.0 * np.convolve(rng.standard_normal(n), np.hanning(25), "same")
    made = simulate(graph, time, {"V": drive})
    clean = np.column_stack([made["i"], made["x"]])
    floor = 0.01 * clean.std(axis=0)
    readings = clean + floor * rng.standard_normal(clean.shape)
    readings[:, 1] += 5.0 * floor[1] * np.tanh(clean[:, 1] / clean[:, 1].std())
    data = Data("stack", time, {"V": drive}, readings, ("i", "x"), floor, interleaved(0, n))
    found = fit(Problem(graph, data), max_iterations=3)
    return found, screen(scene(found), probes(found), (*CATALOGUE, UNNAMED))


def test_every_column_explains_what_the_screening_says(
    screened: tuple[Fit, list[Screened]],
) -> None:
    made, ranked = screened
    columns, total = columns_of(scene(made), ranked), projection(scene(made)).total
    told = {(s.effect.name, s.element.name): s.share for s in ranked}
    share = np.array([told[k] for k in columns.labels])
    weight = np.einsum("ij,i->j", columns.matrix, columns.residual) ** 2
    gain = weight / np.sum(columns.matrix**2, axis=0) / total
    # the screening gives up weak directions of some signatures, a single weight need not
    assert (gain > 0.999 * share - 1e-9).all()
    assert (gain < 1.07 * share + 1e-9).all()
    assert ("sensor_gain", "i") not in columns.labels  # the stack's own values imitate it wholly
    assert np.median(gain / share) == pytest.approx(1.0, rel=1e-6)
    assert ("nonlinear_ratio", "alpha") in columns.labels  # acts on both sides of its two-port
    assert not any(effect == UNNAMED.name for effect, _ in columns.labels)


def test_what_is_kept_beside_an_answer(screened: tuple[Fit, list[Screened]]) -> None:
    made, ranked = screened
    found = SimpleNamespace(scene=scene(made), nominal=made, ranking=ranked, trials=())
    content = alongside(cast(Diagnosis, found))
    assert content is not None
    assert content["plain"]["samples"] == 2 * made.problem.data.mask("train").sum()
    assert content["plain"]["test"] == pytest.approx(made.chi2("test"), rel=1e-4)
    best = max(content["screening"], key=lambda row: row[3])
    assert best[3] == pytest.approx(max(s.share for s in ranked), rel=1e-4)
    assert abs(content["residual"]["reading to the 3"]) > 0.1
    assert content["black_box"]["x"] < made.rmse("test")["x"]
    found.ranking = ()
    assert alongside(cast(Diagnosis, found)) is None


def regression(*weights: float, noise: float = 1.0) -> Columns:
    """Columns of several sizes, and a residual of some of them beside noise."""
    rng = np.random.default_rng(8)
    matrix = rng.standard_normal((2000, 6)) * 10.0 ** np.arange(-3, 3)
    residual = noise * rng.standard_normal(2000)
    for k, w in enumerate(weights):
        residual += w * matrix[:, k] / matrix[:, k].std()
    return Columns(tuple((f"law_{k}", f"b_{k}") for k in range(6)), matrix, residual)


def test_sparse_regressions_keep_what_is_there_and_nothing_of_noise() -> None:
    pytest.importorskip("pysindy")
    found = sparse_terms(regression(0.0, 2.0, 0.0, 0.0, -4.0))
    for terms in found.values():
        assert [t[:2] for t in terms] == [["law_4", "b_4"], ["law_1", "b_1"]]
        # of the residual's variance 1 + 4 + 16 the ridge of 0.05 takes its part
        assert terms[0][2] == pytest.approx(4 / np.sqrt(21) / 1.05, rel=0.05)
    assert sparse_terms(regression()) == {name: [] for name in OPTIMISERS}


def test_sparse_regressions_cannot_tell_equal_columns_apart() -> None:
    pytest.importorskip("pysindy")
    made = regression(3.0)
    twice = Columns(
        (*made.labels, ("twin", "b_0")), np.column_stack([made.matrix, made.matrix[:, 0]]),
        made.residual,
    )  # fmt: skip
    first, second = sparse_terms(twice)["STLSQ"]
    assert {first[0], second[0]} == {"law_0", "twin"}
    assert first[2] == pytest.approx(second[2], rel=1e-3)


def test_no_columns_no_terms() -> None:
    pytest.importorskip("pysindy")
    nothing = Columns((), np.zeros((10, 0)), np.ones(10))
    assert sparse_terms(nothing) == {name: [] for name in OPTIMISERS}
