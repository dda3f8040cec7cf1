"""What a diagnosis is given and should not be, and nominal models that are no easy ones."""

from __future__ import annotations

import numpy as np
import pytest

from bondgraph import BondGraph
from bondgraph.graph.parameter import Parameter
from bondgraph.laws import Coulomb, EndStop, Law, Polynomial
from bondgraph.signals.recording import Recording
from bondgraph.support.errors import BondsightError
from identification.diagnosis.diagnose import Diagnosis, diagnose
from identification.diagnosis.search.candidates import DiagnosisOptions
from tests.settled import simulate
from tests.spring import spring

N, DT, NOISE = 1200, 0.01, 2e-5


def channels(truth: BondGraph, seed: int = 1, n: int = N) -> dict[str, np.ndarray]:
    t = DT * np.arange(n)
    force = 4 * np.sin(2 * np.pi * 0.7 * t) + 2 * np.sin(2 * np.pi * 2.3 * t)
    x = simulate(truth, t, {"F": force})["x"]
    return {"time": t, "F": force, "x": x + NOISE * np.random.default_rng(seed).standard_normal(n)}


def diagnosed(model: BondGraph, c: dict[str, np.ndarray]) -> Diagnosis:
    recording = Recording("run", c["time"], {"F": c["F"], "x": c["x"]}, {"F": "N", "x": "m"})
    return diagnose(model, recording, options=DiagnosisOptions(jobs=1, keep=3, more=1, effects=1))


def twice(c: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    time = c["time"].copy()
    time[500] = time[499]
    return {**c, "time": time}


def backwards(c: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    time = c["time"].copy()
    time[500] -= 3 * DT
    return {**c, "time": time}


def shorter(c: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    return {**c, "x": c["x"][:-7]}


@pytest.mark.parametrize("harm", [twice, backwards, shorter])
def test_stamps_and_lengths_that_cannot_be_are_refused_in_one_line(harm: object) -> None:
    with pytest.raises(BondsightError) as refused:
        diagnosed(spring(), harm(channels(spring())))  # type: ignore[operator]
    said = str(refused.value)
    assert "\n" not in said
    assert "run" in said
    assert "500" in said or "499" in said or "1193" in said or "time" in said


def test_a_coefficient_that_creates_energy_is_refused_in_one_line() -> None:
    with pytest.raises(BondsightError, match=r"k .*negative") as refused:
        diagnosed(spring(k=-20.0), channels(spring()))
    assert "\n" not in str(refused.value)


def bent(graph: BondGraph, cubic: float, linear: float = 0.0) -> BondGraph:
    """Give the spring a law with slope `linear` (N/m) beside its stiffness, `cubic` in N/m^3."""
    law = Polynomial(orders=(1, 3) if linear else (3,), size=1.0)
    values = {"a_1_k": (linear, "N/m"), "a_3_k": (cubic, "N/m^3")}
    given = graph.with_element("k", law=law)
    return given.with_parameters(
        Parameter(n, v, unit, positive=False)
        for n, (v, unit) in values.items()
        if n in given.parameters
    )


@pytest.mark.parametrize(
    ("cubic", "n", "seed"),
    [
        (1e3, 900, 1),
        pytest.param(1e3, 600, 2, marks=pytest.mark.long),
        pytest.param(-1e3, 600, 1, marks=pytest.mark.long),
    ],
)
def test_a_model_that_runs_away_gets_an_answer(cubic: float, n: int, seed: int) -> None:
    """A spring that pushes near its middle, or everywhere: the plant does not."""
    d = diagnosed(bent(spring(), cubic, linear=-220.0), channels(spring(), seed, n))
    assert d.kind in ("explained", "parameters_only")
    assert d.nominal is not None
    found = d.nominal.values
    assert found["k"] + found["a_1_k"] == pytest.approx(200.0, rel=0.05)


DRY, STOP = Coulomb(0.4), EndStop(2000.0, -0.02, 0.02)
FURTHER = EndStop(2000.0, -0.03, 0.03)
"""Reached less deeply: a short record tells it, and the model is bent less."""


@pytest.mark.parametrize(
    ("model", "truth", "place", "effect", "n"),
    [
        (spring().with_element("d", law=DRY), FURTHER, "k", "end_stop", 500),
        pytest.param(
            *(spring().with_element("d", law=DRY), STOP, "k", "end_stop", N),
            marks=pytest.mark.long,
        ),
        pytest.param(
            *(spring().with_element("k", law=STOP), DRY, "d", "coulomb_friction", N),
            marks=pytest.mark.long,
        ),
        pytest.param(
            *(bent(spring(), 2e5), DRY, "d", "coulomb_friction", N),
            marks=pytest.mark.long,
        ),
    ],
)
def test_what_is_missing_beside_a_law_that_is_known(
    model: BondGraph, truth: Law, place: str, effect: str, n: int
) -> None:
    d = diagnosed(model, channels(model.with_element(place, law=truth), n=n))
    assert d.kind == "missing_physics"
    assert [(s.chosen.effect, s.chosen.element) for s in d.findings if s.chosen] == [
        (effect, place)
    ]


@pytest.mark.parametrize("known", [pytest.param(DRY, marks=pytest.mark.long), STOP])
def test_nothing_is_missing_beside_a_law_that_is_known(known: Law) -> None:
    model = spring().with_element("d" if known is DRY else "k", law=known)
    assert diagnosed(model, channels(model)).kind in ("explained", "parameters_only")
