"""Kinds of physics on a recording: the flexible form at the true place does best."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import NamedTuple

import numpy as np
import pytest

from bondgraph import GY, MGY, BondGraph, C, Df, Dq, I, One, R, Se
from bondgraph.graph.modulation import displacement, flow
from bondgraph.laws import Coulomb, Polynomial
from bondgraph.signals.split import interleaved
from bondgraph.support.arrays import Array
from identification.diagnosis.catalogue import CATALOGUE, UNNAMED, by_name
from identification.diagnosis.catalogue.effect import Signature
from identification.diagnosis.catalogue.memory.creep import lagged
from identification.diagnosis.evidence.block_score import BlockScore, score
from identification.diagnosis.evidence.decision import decide
from identification.diagnosis.evidence.hypotheses import Evidence, Thresholds
from identification.diagnosis.evidence.kind_pairs import in_every_pair, pair_scores
from identification.diagnosis.evidence.kind_score import (
    KindScore,
    bench_of,
    kind_scores,
    scores_at,
)
from identification.diagnosis.evidence.kinds_told import alike_kinds
from identification.diagnosis.evidence.remaining import remaining
from identification.diagnosis.screening.flexible_forms import KINDS, sort_anywhere
from identification.diagnosis.screening.observation import scene
from identification.diagnosis.screening.port_history import FittedModel
from identification.diagnosis.screening.port_response import probes
from identification.diagnosis.screening.score_test import Screened, screen, training_rows
from identification.diagnosis.search.nominal import nominal_fit
from identification.estimation.single_record import Fit, fit
from identification.study.data import Data
from identification.study.problem import Problem
from tests.settled import simulate
from tests.spring import spring

N, DT, NOISE = 900, 0.01, 1e-5


def hardening(part: float) -> BondGraph:
    law = Polynomial(0.0, 0.05, 2.0, (3,))
    graph = spring().with_element("k", law=law)
    return graph.with_values({p.name: part for p in law.parameters("k")})


TRUTHS: dict[str, Callable[[], BondGraph]] = {
    "nothing": spring,
    "cubic": lambda: hardening(0.3),
    "strongly cubic": lambda: hardening(4.0),
    "dry": lambda: spring().with_element("d", law=Coulomb(0.1)),
    "both": lambda: hardening(0.3).with_element("d", law=Coulomb(0.1)),
}
ANYTHING = ("sensing", "time", "exogenous")
"""Kinds that depend on the reading itself, or on time alone: along a good trajectory they follow
whatever there is."""


class Seen(NamedTuple):
    made: Fit
    plain: BlockScore
    kinds: list[KindScore]
    looked: FittedModel
    ranked: list[Screened]


T = np.asarray(DT * np.arange(N), np.float64)


@cache
def seen(
    truth: str,
    along_truth: bool = False,
    command: Callable[[Array], Array] = np.asarray,
    reading: Callable[[Array], Array] = np.asarray,
) -> Seen:
    t, u = T, 4 * np.sin(2 * np.pi * 0.7 * T) + 3 * np.sin(2 * np.pi * 2.3 * T + 1)
    x = reading(simulate(TRUTHS[truth](), t, {"F": command(u)})["x"])
    y = (x + NOISE * np.random.default_rng(1).standard_normal(N))[:, None]
    floor = np.array([NOISE])
    split = interleaved(0, N)
    data = Data("run", t, {"F": u}, y, ("x",), floor, split, floor_measured=True)
    made = nominal_fit(spring(), data, "linear")[1]
    better = nominal_fit(TRUTHS[truth](), data, "linear")[1] if along_truth else made
    looked = scene(better)
    ranked = screen(looked, probes(better, spring()), (*CATALOGUE, UNNAMED))
    found = kind_scores(bench_of(made, better), looked, ranked)
    return Seen(made, score(made), found, looked, ranked)


def at(truth: str, element: str, *kinds: str) -> KindScore:
    return next(k for k in seen(truth).kinds if k.element == element and k.kind in kinds)


SPRING, DAMPER = ("restoring", "surface"), ("dissipative", "memory", "surface")


@pytest.mark.sampled(every=2)
@pytest.mark.parametrize(
    ("truth", "along_truth", "place", "kinds"),
    [
        ("cubic", False, "k", SPRING), ("cubic", True, "k", SPRING),
        ("strongly cubic", True, "k", SPRING), ("dry", False, "d", DAMPER),
        ("dry", True, "d", DAMPER),
    ],
)  # fmt: skip
def test_the_kind_of_the_truth_is_best(
    truth: str, along_truth: bool, place: str, kinds: tuple[str, ...]
) -> None:
    made, plain, found, *_ = seen(truth, along_truth)
    assert made.chi2("train") > 4.0  # else there is nothing to find
    best = next(k for k in found if k.kind not in ANYTHING)
    assert (best.element, best.kind in kinds) == (place, True)
    assert plain.behind(best.score) > 5.0
    near = 2.0 if truth == "strongly cubic" else 1.35
    assert 0.8 < best.score.noise[0] < near
    assert best.score.noise[0] < 0.5 * plain.noise[0]


def test_a_kind_that_has_nothing_to_do_with_it_explains_less() -> None:
    assert at("cubic", "d", "dissipative").score.behind(at("cubic", "k", "restoring").score) > 3.0
    assert at("dry", "k", "restoring").score.behind(at("dry", "d", "dissipative").score) > 3.0


def test_no_kind_beats_a_model_that_is_right() -> None:
    _, plain, found, *_ = seen("nothing")
    assert plain.noise[0] == pytest.approx(1.0, abs=0.1)
    assert max(plain.behind(k.score) for k in found) < 3.0


def test_two_effects_show_in_the_pairs_that_hold_them() -> None:
    made, _, found, looked, _ = seen("both")
    asked = [k for k in found if k.kind in ("restoring", "dissipative", "slow")]
    pairs = pair_scores(bench_of(made, made), looked, (), asked)
    alone = min((k.score for k in found), key=lambda s: s.loss)
    assert alone.noise[0] > 8.0  # each effect lies in the way of the other
    best = min(pairs, key=lambda p: p.score.loss)
    assert {place for place, _ in best.members} == {"k", "d"}
    assert best.score.noise[0] < 1.5
    held = in_every_pair(pairs, asked, alone, Thresholds())
    assert set(held) == {("k", "restoring"), ("d", "dissipative")}
    # a pair that hardly does better than one effect says nothing
    assert in_every_pair(pairs, asked, best.score, Thresholds()) == ()


def saturated(u: Array) -> Array:
    return np.asarray(np.clip(u, -5.0, 5.0))


def lagging(x: Array) -> Array:
    return lagged(x, 0.03, DT)


def creeping(x: Array) -> Array:
    return np.asarray(x + 0.1 * lagged(x, 1.0, DT))


@pytest.mark.parametrize(
    ("truth", "command", "reading", "place", "kind"),
    [
        ("nothing", saturated, lagging, "F", "command"),
        ("cubic", np.asarray, creeping, "k", "restoring"),
    ],
)
def test_of_many_kinds_in_question_every_good_pair_holds_a_true_one(
    truth: str,
    command: Callable[[Array], Array],
    reading: Callable[[Array], Array],
    place: str,
    kind: str,
) -> None:
    made, plain, found, looked, ranked = seen(truth, command=command, reading=reading)
    e = Evidence(
        plain, (), tuple(found), remaining(made), made.chi2("test"), made.chi2("train")
    )  # fmt: skip
    asked = alike_kinds(e, Thresholds())
    assert len({k.element for k in asked}) > 2
    assert decide(e).answer == "unknown"
    pairs = pair_scores(bench_of(made, made), looked, ranked, asked)
    alone = min((k.score for k in found), key=lambda s: s.loss)
    held = in_every_pair(pairs, asked, alone, Thresholds())
    assert held == ((place, kind),)
    told = decide(replace(e, paired=held))
    assert (told.answer, told.physics, told.places) == ("kind", kind, (place,))


@pytest.mark.parametrize("truth", list(TRUTHS))
def test_scores_are_sorted_finite_and_of_one_kind_and_place_each(truth: str) -> None:
    found = seen(truth).kinds
    losses = [k.score.loss for k in found]
    assert losses == sorted(losses)
    assert np.isfinite(losses).all()
    assert len({(k.element, k.kind) for k in found}) == len(found)
    assert {k.kind for k in found} <= set(KINDS)
    assert {"k", "d", "x", "F"} <= {k.element for k in found}
    for k in found:
        assert k.addition.shape == (N,)
        assert np.isfinite(k.addition).all()
        assert k.label == f"{sort_anywhere(k.kind)} at {k.element}"


def test_the_fitted_form_is_the_force_that_was_left_out() -> None:
    """Up to what mass, damping and stiffness can imitate."""
    past = seen("dry").looked.past["d"]
    assert past.moved is not None
    addition = at("dry", "d", "dissipative").addition
    known = np.stack([past.argument, past.moved, np.gradient(past.argument), np.ones(N)], axis=1)
    wanted = np.tanh(past.argument / 0.01)
    parts = [f - known @ np.linalg.lstsq(known, f, rcond=None)[0] for f in (addition, wanted)]
    assert abs(np.corrcoef(*parts)[0, 1]) > 0.8


def test_places_can_be_chosen() -> None:
    made, _, found, looked, _ = seen("cubic")
    only = kind_scores(bench_of(made, made), looked, [], places=["k"])
    assert {k.element for k in only} == {"k"}
    assert only[0].score.noise[0] < 2 * found[0].score.noise[0]


def test_responses_stand_in_the_order_of_the_residual() -> None:
    made = seen("cubic").made
    problem = made.problem
    bench = bench_of(made, made)
    clock = np.arange(float(N))[:, None, None]
    rows = training_rows(problem, clock)[:, 0] * NOISE
    assert rows == pytest.approx(bench.rows.sample)


def test_columns_that_differ_only_now_and_then_are_not_taken_for_one() -> None:
    """A part that acts in a few samples is all a rare effect shows."""
    made = seen("cubic").made
    often = np.sin(0.1 * np.arange(N))[:, None]
    rare = often + 0.5 * (np.abs(np.arange(N) - 102) < 2)[:, None]
    forms = {"restoring": Signature(often), "surface": Signature(np.hstack([often, rare]))}
    found = scores_at(bench_of(made, made), "k", forms)
    assert found[0].score.loss != found[1].score.loss


def motor(falls: float) -> BondGraph:
    """A motor whose constant falls with the square of the current."""
    with BondGraph("motor") as g:
        e, w = One("e"), One("w")
        Se("u", unit="V") >> e >> I("L", 0.05, unit="H")
        e >> R("r", 1.0, unit="Ohm")
        ratio = 0.5 * (1 - falls * flow("e") ** 2)
        two_port = MGY("K", ratio=ratio, unit="N*m/A") if falls else GY("K", 0.5, unit="N*m/A")
        e >> two_port >> w >> I("J", 0.02, unit="kg*m^2")
        w >> R("b", 0.1, unit="N*m*s/rad")
        w >> C("k", stiffness=1.0, unit="N*m/rad")
        e >> Df("i", unit="A")
        w >> Dq("angle", unit="rad")
    return g


def test_a_ratio_that_falls_is_found_on_both_sides() -> None:
    t = np.asarray(DT * np.arange(N), np.float64)
    u = 1.5 * np.sin(2 * np.pi * 0.7 * t) + np.sin(2 * np.pi * 2.3 * t)
    seen = simulate(motor(0.05), t, {"u": u})
    noise = 1e-5 * np.random.default_rng(1).standard_normal((N, 2))
    y = np.stack([seen["i"], seen["angle"]], axis=1) + noise
    split, floor = interleaved(0, N), np.array([1e-5, 1e-5])
    data = Data("run", t, {"u": u}, y, ("i", "angle"), floor, split, floor_measured=True)
    made = nominal_fit(motor(0.0), data, "linear")[1]
    found = kind_scores(bench_of(made, made), scene(made), [], places=["K", "k", "b", "r"])
    assert (found[0].element, found[0].kind) == ("K", "ratio")
    assert found[0].score.noise.max() < 0.1 * score(made).noise.max()


def pick_up(falls: float, units: bool = True) -> BondGraph:
    """A mass with a coil: its constant falls away from the middle; the mass is the primary side."""
    with BondGraph("pick_up") as g:
        body, coil = One("body"), One("coil")
        Se("F", unit="N" if units else "") >> body
        body >> I("m", 0.5, unit="kg" if units else "")
        body >> R("b", 2.0, unit="N*s/m" if units else "")
        body >> C("k", stiffness=30.0, unit="N/m" if units else "")
        ratio = 4.0 * (1 - falls * displacement("k") ** 2)
        unit = "V*s/m" if units else ""
        body >> (MGY("K", ratio=ratio, unit=unit) if falls else GY("K", 4.0, unit=unit)) >> coil
        coil >> R("R_g", 20.0, unit="ohm" if units else "")
        coil >> C("C_f", 5e-3, unit="F" if units else "")
        body >> Dq("x", unit="m" if units else "")
        coil >> Df("i", unit="A" if units else "")
    return g


def test_the_side_that_moves_is_the_one_without_a_current() -> None:
    t = np.asarray(DT * np.arange(N), np.float64)
    u = 6 * np.sin(2 * np.pi * 0.7 * t) + 5 * np.sin(2 * np.pi * 2.3 * t)
    run = simulate(pick_up(3.0), t, {"F": u})
    noise = 1e-5 * np.random.default_rng(1).standard_normal((N, 2))
    y = np.stack([run["x"], run["i"]], axis=1) + noise
    split, floor = interleaved(0, N), np.array([1e-5, 1e-5])
    data = Data("run", t, {"F": u}, y, ("x", "i"), floor, split, floor_measured=True)

    effect = by_name("nonlinear_ratio")

    def shares(units: bool) -> tuple[FittedModel, Screened]:
        made = nominal_fit(pick_up(0.0, units), data, "linear")[1]
        looked = scene(made)
        return looked, screen(looked, probes(made), (effect,))[0]

    looked, found = shares(units=True)
    assert (looked.past["K"].primary_moves, found.share > 0.9) == (True, True)
    inserted = effect.insert(looked, looked.graph["K"], found.hint)
    values = {n: v for n, v in looked.nominal.values.items() if n in inserted.graph.parameters}
    result = fit(Problem(inserted.graph, data, starts={**values, **inserted.starts[0]}))
    assert looked.nominal.chi2("train") > 100.0
    assert result.chi2("train") < 1.3
    # nothing says which one it is: a motor, as most are
    looked, found = shares(units=False)
    assert (looked.past["K"].primary_moves, found.share < 0.5) == (False, True)
    made = nominal_fit(motor(0.0), _of_a_motor(), "linear")[1]
    assert not scene(made).past["K"].primary_moves


def _of_a_motor() -> Data:
    t = np.asarray(DT * np.arange(200), np.float64)
    u = np.sin(2 * np.pi * 0.7 * t)
    run = simulate(motor(0.0), t, {"u": u})
    y = np.stack([run["i"], run["angle"]], axis=1)
    floor = np.array([1e-5, 1e-5])
    return Data("run", t, {"u": u}, y, ("i", "angle"), floor, interleaved(0, 200))
