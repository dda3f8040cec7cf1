"""Relations blind to a port stay at the floor only where the missing physics sits there alone.

The records come from another integrator, with the effect as a force of its own (`three_masses`).
"""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from bondgraph import TF, BondGraph, C, De, Df, Dq, I, One, R, Se, Zero
from bondgraph.laws import Polynomial
from bondgraph.signals.recording import Split
from identification.diagnosis.localisation import blind_relations as blind_relations_module
from identification.diagnosis.localisation.blind_relations import (
    blind_relations,
    more_than_one_site,
    no_relation,
)
from identification.diagnosis.localisation.relations.latent import Sampled
from identification.diagnosis.localisation.relations.refit import (
    BlindProblem,
    Refitted,
    freedom,
    without_starts,
)
from identification.diagnosis.localisation.relations.whitening import blind_filter
from identification.diagnosis.localisation.structural_classes import structure
from identification.diagnosis.search import looks
from identification.diagnosis.search.nominal import nominal_fit
from identification.estimation import brief
from identification.estimation.single_record import fit
from identification.study.data import Data
from identification.study.problem import Problem
from identification.study.residual import offset_scale, slots
from tests.identification.diagnosis.three_masses import (
    DAMPING,
    DT,
    INTERLEAVED,
    LAST_THIRD,
    MASS,
    NOISE,
    STIFFNESS,
    N,
    chain,
    course,
    fitted,
    question,
    relations,
)
from tests.settled import simulate


@pytest.mark.sampled(every=2)
@pytest.mark.parametrize(
    ("effect", "port"),
    [({"cubic_k2": 5e4}, "k2"), ({"friction_b1": 0.5}, "b1"), ({"cubic_x2": 5.0}, "x2")],
    ids=["cubic_spring", "coulomb", "sensor"],
)
@pytest.mark.parametrize("split", [LAST_THIRD, INTERLEAVED], ids=["last_third", "interleaved"])
def test_only_the_relation_blind_to_the_true_port_reaches_the_floor(
    effect: dict[str, float], port: str, split: Split
) -> None:
    f = fitted(**effect, split=split)
    assert f.chi2("train") > 10
    found = relations(f)
    assert port in found[0].ports
    assert found[0].compatible
    assert found[0].train == pytest.approx(1.0, abs=0.1)
    assert found[0].test == pytest.approx(1.0, abs=0.2)
    assert "may sit there alone" in found[0].words
    for other in found[1:]:
        assert not other.compatible, other.words
        assert other.z > 10
        assert "elsewhere" in other.words
    assert not more_than_one_site(found)


@pytest.fixture
def brief_from_400(monkeypatch: pytest.MonkeyPatch) -> None:
    """Records of this page count as long ones."""
    monkeypatch.setattr(brief, "BRIEF", 400)


@pytest.mark.usefixtures("brief_from_400")
def test_what_the_beginning_leaves_in_question_is_held_against_all() -> None:
    f = fitted(friction_b1=0.5, split=INTERLEAVED)
    found = relations(f)
    assert [r.ports for r in found if r.compatible] == [found[0].ports]
    assert "b1" in found[0].ports
    count = float(f.problem.data.mask("train").sum())
    assert found[0].freedom > count  # of all samples
    assert found[-1].freedom < count  # excluded on the first ones, with unknowns of the record
    moved = found[-1].theta[slots(f.problem).offsets] * offset_scale(f.problem)
    assert np.abs(moved).max() < 100 * NOISE


@pytest.mark.usefixtures("brief_from_400")
def test_what_begins_late_is_not_judged_on_the_beginning() -> None:
    plain = question(0.0, 0.0, 0.0, 0.0, INTERLEAVED)
    readings = plain.data.readings.copy()
    readings[600:, 1] += 5.0 * readings[600:, 1] ** 3
    f = fit(replace(plain, data=replace(plain.data, readings=readings)))
    assert f.chi2("train") > 10
    found = relations(f)
    assert found[0].ports == ("x2",)
    assert found[0].train == pytest.approx(1.0, abs=0.1)
    assert not any(r.compatible for r in found[1:])


@pytest.mark.usefixtures("brief_from_400")
def test_what_cannot_be_held_against_all_is_not_decided(monkeypatch: pytest.MonkeyPatch) -> None:
    refit = blind_relations_module._refitted

    def failing(seen: BlindProblem, *rest: Any) -> Refitted | None:
        return None if seen.problem.data.n == N else refit(seen, *rest)

    monkeypatch.setattr(blind_relations_module, "_refitted", failing)
    found = relations(fitted(friction_b1=0.5, split=INTERLEAVED))
    (here,) = [r for r in found if "b1" in r.ports]
    assert not here.decided
    assert here.compatible


def test_a_model_without_states_has_relations_too() -> None:
    with BondGraph("divider") as g:
        loop, node = One("i"), Zero("u")
        Se("E", unit="V") >> loop >> R("r_1", 2.0, unit="ohm")
        loop >> node >> R("r_2", 3.0, unit="ohm")
        loop >> Df("i_1", unit="A")
        node >> De("u_2", unit="V")
    rng, n = np.random.default_rng(0), 400
    u = rng.uniform(-1, 1, n)
    y = np.stack([u / 5 + 0.02 * u**3, 3 * u / 5], axis=1) + 1e-3 * rng.standard_normal((n, 2))
    data = Data("run", DT * np.arange(n), {"E": u}, y, ("i_1", "u_2"), np.full(2, 1e-3),
                Split(slice(0, 260), slice(260, n), "last third"))  # fmt: skip
    found = blind_relations(fit(Problem(g, data)), structure(g, np.geomspace(1.0, 60.0, 24)))
    assert found[0].ports == ("i_1",)
    assert [r.compatible for r in found] == [True, False, False, False]


def test_without_an_effect_every_relation_is_at_the_floor() -> None:
    found = relations(fitted())
    assert len(found) > 5
    for r in found:
        assert r.train == pytest.approx(1.0, abs=0.1)
        assert r.test == pytest.approx(1.0, abs=0.2)
        assert r.compatible
    assert not more_than_one_site(found)


def test_two_sites_leave_every_relation_above_the_floor() -> None:
    found = relations(fitted(cubic_k2=5e4, friction_b1=2.0))
    assert min(r.z for r in found) > 10
    assert more_than_one_site(found)


def test_one_sensor_makes_no_relation() -> None:
    force, x, _ = course()
    split = Split(slice(0, 800), slice(800, N), "last third")
    data = Data("run", DT * np.arange(N), {"F": force}, x[:, :1], ("x1",), np.array([NOISE]), split)
    f = fit(Problem(chain(MASS, STIFFNESS, DAMPING, sensors=1), data), max_iterations=2)
    assert relations(f) == ()
    assert "second sensor" in no_relation(f)
    assert not more_than_one_site(())


def test_the_filter_is_the_projection_of_the_whole_record() -> None:
    rng = np.random.default_rng(2)
    phi = np.array([[0.9, 0.2], [-0.2, 0.85]])
    model = Sampled(phi, np.array([[0.3], [1.0]]), rng.standard_normal((3, 2)), np.zeros((3, 1)))
    size, n = 50.0, 200
    r = rng.standard_normal((3, 1, n))
    blind = blind_filter(model, np.array([size]))
    seen = blind(r)[:, 0].T.ravel()
    starts = blind.starts(n).transpose(2, 0, 1).reshape(3 * n, 2)
    q = np.linalg.qr(starts)[0]
    filtered = float(np.sum((seen - q @ (q.T @ seen)) ** 2))
    # the same number from the covariance of the whole record, its start unknown
    powers = [np.linalg.matrix_power(phi, i) for i in range(n)]
    g = np.zeros((3 * n, n))
    for lag in range(1, n):
        for t in range(lag, n):
            g[3 * t : 3 * t + 3, t - lag] = (model.c @ powers[lag - 1] @ model.gamma)[:, 0]
    free = np.concatenate([model.c @ p for p in powers])
    inverse = np.linalg.inv(np.eye(3 * n) + size**2 * g @ g.T)
    left = r[:, 0].T.ravel()
    weighted = inverse @ free
    exact = float(
        left @ inverse @ left
        - left @ weighted @ np.linalg.solve(free.T @ weighted, weighted.T @ left)
    )
    assert filtered == pytest.approx(exact, rel=1e-6)
    # and the latent signal itself is not seen
    assert np.sum(blind((g @ rng.standard_normal(n)).reshape(n, 3).T[:, None]) ** 2) < 0.1 * n


def test_a_state_that_moves_a_reading_only_later_has_no_freedom_of_its_own() -> None:
    # the readings hear the last state through the others only, whatever its unit
    rng = np.random.default_rng(3)
    c = np.array([[1.0, 0.0, 0.0], [0.2, 1.0, 0.0]])
    for unit in (1.0, 1e-8, 1e-14):
        phi = np.array([[0.9, 0.1, 0.0], [0.0, 0.8, 0.1 / unit], [0.0, 0.0, 0.95]])
        model = Sampled(phi, np.array([[1.0], [0.0], [0.0]]), c, np.zeros((2, 1)))
        blind = blind_filter(model, np.array([300.0]))
        # of two readings one latent signal takes one
        assert blind.kept == pytest.approx(1.0, abs=0.01)
        noise = rng.standard_normal((2, 1, 4000))
        assert np.mean(blind(noise) ** 2) == pytest.approx(0.5, abs=0.03)


def test_the_sides_of_a_two_port_together_are_not_excluded() -> None:
    force, x, _ = course()
    with BondGraph("lever") as g:
        body, far = One("v1"), One("v2")
        Se("F", unit="N") >> body
        body >> I("m1", MASS, unit="kg")
        body >> C("k1", stiffness=STIFFNESS, unit="N/m")
        body >> R("b1", DAMPING, unit="N*s/m")
        body >> Dq("x1", unit="m")
        body >> TF("lever", 2.0) >> far
        far >> C("k2", stiffness=STIFFNESS, unit="N/m")
        far >> R("b2", DAMPING, unit="N*s/m")
        far >> I("m2", MASS, unit="kg")
        joint = Zero("joint")
        far >> joint >> C("k3", stiffness=STIFFNESS, unit="N/m")
        joint >> (third := One("v3")) >> I("m3", MASS, unit="kg")
        third >> R("b3", DAMPING, unit="N*s/m")
        third >> Dq("x2", unit="m")
    data = Data("run", DT * np.arange(N), {"F": force}, x[:, :2], ("x1", "x2"),
                np.full(2, NOISE), LAST_THIRD)  # fmt: skip
    f = fit(Problem(g, data), max_iterations=2)
    found = blind_relations(f, structure(g, np.geomspace(1.0, 60.0, 24)))
    (both,) = [r for r in found if r.ports == ("lever",)]
    assert both.sides == 2
    assert not both.decided
    assert both.compatible
    assert "not excluded" in both.words


def test_plants_that_integrate_have_relations_too() -> None:
    """Two free masses: the mode at rest must not make every filter unstable."""
    with BondGraph("free") as g:
        near, far, joint, between = One("v1"), One("v2"), Zero("z"), One("r")
        near >> I("m1", MASS, unit="kg")
        far >> I("m2", MASS, unit="kg")
        near >> Dq("x1", unit="m")
        far >> Dq("x2", unit="m")
        Se("F", unit="N") >> far
        far >> joint >> near
        joint >> between
        between >> C("k", stiffness=STIFFNESS, unit="N/m")
        between >> R("b", DAMPING, unit="N*s/m")
    hard = Polynomial(0.0, 0.1, 80.0, orders=(3,), unit="N")
    true = g.with_element("k", law=hard).with_values({"a_3_k": 80.0})
    rng = np.random.default_rng(4)
    t = np.asarray(DT * np.arange(N), np.float64)
    waves = np.outer(t, rng.uniform(0.2, 8.0, 12))
    force = 6 * np.sin(2 * np.pi * waves + rng.uniform(0, 2 * np.pi, 12)).sum(axis=1)
    made = simulate(true, t, {"F": force})
    seen = np.stack([np.asarray(made[n]) for n in ("x1", "x2")], axis=1)
    seen = seen + NOISE * rng.standard_normal(seen.shape)
    data = Data("run", t, {"F": force}, seen, ("x1", "x2"), np.full(2, NOISE), INTERLEAVED)
    found = relations(nominal_fit(g, data, "linear")[1])
    assert set(found[0].ports) == {"k", "b"}
    assert found[0].compatible
    assert all(r.train > 10 for r in found[1:] if r.decided)


def test_the_port_that_has_to_move_least_stands_for_its_class() -> None:
    """Behind the only sensors a far port needs a signal too large for the arithmetic."""
    force, x, _ = course(cubic_k2=5e4)
    seen = (x + NOISE * np.random.default_rng(1).standard_normal(x.shape))[:, 1:]
    g = chain(1.1, 380.0, 1.4, first=2)
    data = Data("run", DT * np.arange(N), {"F": force}, seen, ("x2", "x3"), np.full(2, NOISE),
                INTERLEAVED)  # fmt: skip
    found = relations(fit(Problem(g, data)))
    assert "k2" in found[0].ports
    assert found[0].compatible
    assert all(r.train > 10 for r in found[1:] if r.decided)


@pytest.mark.parametrize("n", [9, 20, 80])
def test_the_start_of_a_short_run_costs_what_it_takes_out(n: int) -> None:
    rng = np.random.default_rng(0)
    phi = 0.95 * np.linalg.qr(rng.standard_normal((5, 5)))[0]
    c = rng.standard_normal((2, 5))
    model = Sampled(phi, rng.standard_normal((5, 1)), c, np.zeros((2, 1)))
    blind = blind_filter(model, np.array([50.0]))
    left = without_starts(blind(rng.standard_normal((2, 4000, n))), blind)
    assert freedom(blind, n) == pytest.approx(np.sum(left**2) / 4000, rel=0.02)


def test_relations_are_made_here_where_their_process_was_ended(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Work that is ended early takes along the processes of all that runs beside it."""

    class Ended:
        def __iter__(self) -> Ended:
            return self

        def __next__(self) -> Any:
            raise RuntimeError("The executor underlying Parallel has been shutdown")

    made = looks.Looks((), BondGraph("plain"), 2)
    made.coming = Ended()
    monkeypatch.setattr(looks, "_relations", lambda base, classes: ())
    base: Any = SimpleNamespace(problem=SimpleNamespace(data=SimpleNamespace(names=("x",))))
    assert made.where(base, cast("Any", None)) == ()
