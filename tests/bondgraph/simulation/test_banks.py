"""Plays in a native loop inside the step: the same numbers as closed code and as the operator."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bondgraph.equations.codegen import program_of
from bondgraph.equations.derivation import equations
from bondgraph.hysteresis import (
    Ang,
    Cascade,
    DeadZones,
    MaxwellResistiveCapacitor,
    Parallel,
    PrandtlIshlinskii,
)
from bondgraph.hysteresis.plays.play import play
from bondgraph.laws import Hysteretic, Law, LawSum, Polynomial, StopSum, Stribeck
from bondgraph.simulation import banks, lure_march
from bondgraph.simulation import lure_kernel as kernel
from bondgraph.simulation.exact_run import KernelRun, run_record
from bondgraph.simulation.lure import Compiled
from bondgraph.simulation.lure_layout import layout
from bondgraph.simulation.radau import recorder
from bondgraph.simulation.radau.native import prepare_general, run_general
from bondgraph.support import native
from bondgraph.support.ops import NUMPY
from tests.bondgraph.hysteresis.examples import UNTIMED
from tests.bondgraph.simulation.test_kernel import oscillator, oscillator_graph

N, STEP = 120, 0.05
PLAYS = PrandtlIshlinskii((0.0, 0.05, 0.1, 0.3, 0.5, 0.9), (1.5, 0.6, -0.4, 0.9, 0.2, 0.3))
ZONES = DeadZones((-0.6, -0.2, 0.0, 0.3, 0.9), (0.3, -0.2, 1.0, 0.5, -0.4))
SPRINGS = MaxwellResistiveCapacitor((2.0, 1.0, 0.5, 0.3), (0.1, 0.2, 0.3, 0.4))
ANG = Ang(PLAYS, ZONES)
FREE = Hysteretic(PLAYS, ("weights", "thresholds[2]", "thresholds[4]"))

pytestmark = pytest.mark.skipif(native.compiler() is None, reason="needs gcc")


@pytest.fixture
def path(monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[[bool], None]]:
    """Choose whether laws of any size run in a loop, or all in closed code; both compiled."""

    def built(*arguments: Any) -> Path:
        library = native.build(*arguments)
        assert library is not None, "gcc refused the source"
        return library

    for module in (lure_march, recorder):
        monkeypatch.setattr(module, "build", built)

    def choose(banked: bool) -> None:
        monkeypatch.setattr(banks, "BANKED_FROM", 1 if banked else 10**9)
        kernel._runner.cache_clear()

    yield choose
    kernel._runner.cache_clear()


def inputs(model: Compiled) -> Any:
    u = np.zeros((N, model.n_u))
    t = STEP * (np.arange(N) + 3)
    u[:, 0] = 3.0 * np.sin(2.1 * t) + 2.1 * np.sin(5.3 * t)
    return u


def run_of(model: Compiled, p: Any = None, u: Any = None, **options: Any) -> KernelRun:
    p = model.nominal() if p is None else p
    x0 = np.array([0.11, -0.23])
    return run_record(model, p, inputs(model) if u is None else u, STEP, x0, n_sub=2, **options)


def everything(model: Compiled) -> KernelRun:
    return run_of(model, directions=range(len(model.nominal())), state_directions=True)


LAWS: dict[str, tuple[Law | None, ...]] = {  # of spring, friction, drive, reading
    "plays": (Hysteretic(PLAYS),),
    "free weights and widths": (FREE,),
    "springs that slip": (None, Hysteretic(SPRINGS)),
    "free springs": (Hysteretic(SPRINGS, ("stiffnesses", "breakaways[1]")),),
    "ang": (Hysteretic(ANG),),
    "free zones before plays": (
        Hysteretic(ANG.inverse(), ("dead_zone.weights", "play.weights[1]")),
    ),
    "two banks, side by side": (Hysteretic(Parallel(PLAYS, SPRINGS)),),
    "two banks, one behind the other": (Hysteretic(Cascade(ANG, PLAYS)),),
    "a sum of laws": (LawSum((StopSum((0.1, 0.3), height=0.7), Polynomial(size=1.0))),),
    "in every place": (StopSum((0.1, 0.3), 0.7), Hysteretic(SPRINGS), Hysteretic(PLAYS), FREE),
    "beside dry friction": (StopSum((0.1, 0.3), 0.7), Stribeck(0.3, 0.2, 0.1)),
}
WITH_PARAMETERS = ("free weights and widths", "free springs", "free zones before plays")


@pytest.mark.sampled(every=3)
@pytest.mark.parametrize("name", LAWS)
def test_the_loop_gives_what_closed_code_gives(name: str, path: Callable[[bool], None]) -> None:
    model = oscillator(*LAWS[name])
    path(True)
    taken = kernel.without_banks(model)[1]
    assert sum(b.bank.count for b in taken.banks) + len(taken.kept) == layout(model, 0).n_m
    assert taken.banks
    got = everything(model)
    path(False)
    assert not kernel.without_banks(model)[1].banks
    wanted = everything(model)
    for part in ("y", "s", "w", "x"):
        np.testing.assert_allclose(getattr(got, part), getattr(wanted, part), rtol=0, atol=1e-11)
    for part in ("dy", "dx"):
        size = np.abs(getattr(wanted, part)).max()
        np.testing.assert_allclose(
            getattr(got, part), getattr(wanted, part), rtol=0, atol=1e-10 * size
        )
    for element, states in wanted.memory.items():
        np.testing.assert_allclose(got.memory[element], states, rtol=0, atol=1e-11)


@pytest.mark.parametrize("name", WITH_PARAMETERS)
def test_tangents_against_central_differences(name: str, path: Callable[[bool], None]) -> None:
    path(True)
    model = oscillator(*LAWS[name])
    p, h = model.nominal(), 1e-6
    run = everything(model)
    for d in range(p.size):
        ahead, back = (run_of(model, p + sign * h * np.eye(p.size)[d]).y for sign in (1, -1))
        central = (ahead - back) / (2 * h)
        size = max(np.abs(central).max(), 1e-3)
        assert np.abs(run.dy[:, :, d] - central).max() < 2e-6 * size, model.parameter_names[d]


@pytest.mark.parametrize(
    "name", ["free springs", "two banks, one behind the other", "in every place"]
)
def test_the_general_step_gives_what_its_closed_code_gives(
    name: str, path: Callable[[bool], None]
) -> None:
    """Every derivative too, by parameters, states and memories."""
    graph = oscillator_graph(*LAWS[name])
    found = []
    for banked in (True, False):
        path(banked)
        model = program_of(equations(graph))
        assert bool(recorder.without_banks(model)[1].banks) == banked
        ready = prepare_general(
            model, np.array(model.nominal), STEP, 2, range(len(model.nominal)), True, True
        )
        u = np.zeros((N, len(model.inputs)))
        t = STEP * (np.arange(N) + 3)
        u[:, model.inputs.index("F")] = 3.0 * np.sin(2.1 * t) + 2.1 * np.sin(5.3 * t)
        found.append(run_general(ready, u, np.array([0.11, -0.23]), relaxed=True))
    got, wanted = found
    assert got.reached == wanted.reached == N
    for part in ("y", "x", "dy", "dx", "dmemory"):
        size = np.abs(getattr(wanted, part)).max()
        np.testing.assert_allclose(
            getattr(got, part), getattr(wanted, part), rtol=0, atol=1e-10 * size
        )
    for element, states in wanted.memory.items():
        np.testing.assert_allclose(got.memory[element], states, rtol=0, atol=1e-11)


def test_memory_is_carried_from_one_run_to_the_next(path: Callable[[bool], None]) -> None:
    path(True)
    model = oscillator(Hysteretic(Parallel(PLAYS, SPRINGS)), None, StopSum((0.2, 0.4), 0.3))
    u = inputs(model)
    whole, first = run_of(model, u=u), run_of(model, u=u[: N // 2])
    second = run_record(
        model, model.nominal(), u[N // 2 - 1 :], STEP, first.x, n_sub=2, memory=first.memory
    )
    np.testing.assert_allclose(second.y[1:], whole.y[N // 2 :], rtol=0, atol=1e-11)


@pytest.mark.parametrize("name", sorted(UNTIMED))
def test_a_law_on_its_lines_is_the_law(name: str, path: Callable[[bool], None]) -> None:
    """What is left of a law has its value, and its banks move as its memory does."""
    path(True)
    law = Hysteretic(UNTIMED[name])
    found = banks.banks_of(law, 0)
    assert sum(bank.count for bank in found) in (0, law.n_memory)
    memory = law.advance(NUMPY, -0.2, law.initial_memory(0.4), ())
    left, lines = banks.BankedLaw(law, len(found)), [0.0] * banks.LINE * len(found)
    moved: list[float] = []
    for k, bank in enumerate(found):  # a bank behind another is read where that one is by now
        at = banks.LINE * k
        place = left.advance(NUMPY, 0.7, lines, ())[at + 2]
        widths, weights = (v.full().ravel() for v in bank.numbers([]))
        own = zip(widths, memory[bank.plays], strict=True)
        states = [float(play(NUMPY, place, r, y)) for r, y in own]
        moved += states
        lines[at : at + 3] = weights @ (np.array(states) - bank.stops * place), 0.0, place
    if found:
        np.testing.assert_allclose(moved, law.advance(NUMPY, 0.7, memory, ()), rtol=0, atol=1e-14)
        wanted = law.deviation(NUMPY, 0.7, memory, ())
        assert left.deviation(NUMPY, 0.7, lines, ()) == pytest.approx(wanted, abs=1e-12)


@st.composite
def plays(draw: st.DrawFn) -> Hysteretic:
    count = draw(st.integers(1, 20))
    gaps = draw(st.lists(st.floats(1e-3, 0.5), min_size=count, max_size=count))
    weights = draw(st.lists(st.floats(-0.3, 0.6), min_size=count, max_size=count))
    slopes = np.cumsum([1.0, *weights])
    first = 1.0 + max(0.0, 0.2 - float(slopes.min()))
    return Hysteretic(PrandtlIshlinskii((0.0, *np.cumsum(gaps).tolist()), (first, *weights)))


@settings(max_examples=15, deadline=None)
@given(law=plays(), seed=st.integers(0, 10**6))
def test_any_bank_in_a_graph_is_the_operator_alone(law: Law, seed: int) -> None:
    assert isinstance(law, Hysteretic)
    model = oscillator(law)
    u = np.zeros((N, model.n_u))
    u[:, 0] = np.cumsum(np.random.default_rng(seed).normal(0.0, 1.0, N))
    run = run_record(model, model.nominal(), u, STEP, np.zeros(model.n_x))
    s = run.s[:, 0]
    start = law.operator.initial_memory(float(s[0]))
    expected, last = law.operator.run(s, start)
    value = run.w[:, 0] + law.slope * s
    size = np.abs(expected).max() + 1e-9
    np.testing.assert_allclose(value, expected, rtol=0, atol=1e-11 * size)
    np.testing.assert_allclose(run.memory["k"], last, rtol=0, atol=1e-11 * (np.abs(s).max() + 1.0))
