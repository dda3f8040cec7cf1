"""Readings taken after the step of a held command: the kernels, the fits and the diagnosis."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.signal import cont2discrete, dlsim

from bondgraph import BondGraph, C, Da, De, Df, Dq, I, One, R, Se, Sf, Zero
from bondgraph.hysteresis import PrandtlIshlinskii
from bondgraph.laws import Coulomb, Hysteretic, Law, QuadraticDrag
from bondgraph.signals.recording import Recording
from bondgraph.simulation import lure_kernel
from bondgraph.simulation.dynamics import Dynamics, ExactDynamics, GeneralDynamics, dynamics_of
from bondgraph.simulation.located import followed
from bondgraph.support.errors import UnusableInput
from identification import DiagnosisOptions, diagnose
from identification.estimation.estimate import estimate
from identification.study.study import Study

STEP, N, SUB = 1e-3, 80, 3


def slide(law: Law | None = None) -> BondGraph:
    """A mass on a spring with an accelerometer, whose reading may be bent."""
    with BondGraph("slide") as g:
        body = One("body")
        Se("F", unit="N") >> body >> I("m", 0.8, unit="kg")
        body >> R("d", 4.0, unit="N*s/m")
        body >> C("k", stiffness=2000.0, unit="N/m")
        body >> Dq("x", unit="m")
        body >> Da("a", unit="m/s^2", law=law)
    return g


def node(law: Law) -> BondGraph:
    """A flow into a node without a store: its effort jumps through a law."""
    with BondGraph("node") as g:
        inlet, body = Zero("inlet"), One("body")
        Sf("F") >> inlet >> R("r", 1.0, law=law)
        inlet >> body >> I("m", 1.0)
        body >> R("d", 4.0)
        inlet >> De("p")
        body >> Df("v")
    return g


PLAYS = PrandtlIshlinskii((0.0, 0.5, 1.0, 2.0), (0.1, 0.3, 0.2, 0.1))
MODELS: dict[str, Callable[[], BondGraph]] = {
    "linear": slide,
    "reading": lambda: slide(QuadraticDrag(0.02)),
    "plays": lambda: slide(Hysteretic(PLAYS)),
    "node": lambda: node(QuadraticDrag(0.5)),
    "dry": lambda: node(Coulomb(0.3)),
}


def force(n: int = N) -> Any:
    return np.repeat(np.random.default_rng(3).normal(size=-(-n // 4)), 4)[:n] * 3.0


def posed(graph: BondGraph) -> tuple[Dynamics, Any, Any, Any]:
    made = dynamics_of(graph)
    u = made.inputs({"F": force()}, np.arange(N) * STEP)
    return made, made.vector({}), u, made.fine_inputs(u, SUB, "hold")


@pytest.mark.parametrize("name", MODELS)
def test_a_reading_after_a_step_is_that_of_a_moment_later(name: str) -> None:
    made, p, u, fine = posed(MODELS[name]())
    x0 = np.zeros(made.n_x)
    whole = made.run(made.prepare(p, STEP, SUB, (), False), u, x0, fine, after=True)
    before = made.run(made.prepare(p, STEP, SUB, (), False), u, x0, fine)
    brief = made.prepare(p, 1e-10, 1, (), False)
    assert np.array_equal(whole.x, before.x)  # the motion is the same
    assert np.abs(whole.y - before.y).max() > 1.0
    for k in range(1, N, 9):
        begun = made.run(
            made.prepare(p, STEP, SUB, (), False), u[: k + 1], x0, fine[: k * SUB]
        )  # fmt: skip
        held = np.repeat(u[k : k + 1], 2, axis=0)
        later = made.run(
            brief, held, begun.x, made.fine_inputs(held, 1, "hold"), memory=begun.memory or None
        )
        assert whole.y[k] == pytest.approx(later.y[-1], rel=1e-6, abs=1e-6)


@pytest.mark.parametrize("name", MODELS)
def test_its_derivatives_are_those_of_differences(name: str) -> None:
    made, p, u, fine = posed(MODELS[name]())
    x0, wanted = np.zeros(made.n_x), range(p.size)
    found = made.run(made.prepare(p, STEP, SUB, list(wanted), True), u, x0, fine, after=True)
    for k in wanted:
        ends, h = [], 1e-6 * max(abs(p[k]), 1e-3)
        for way in (h, -h):
            moved = p.copy()
            moved[k] += way
            ready = made.prepare(moved, STEP, SUB, (), False)
            ends.append(made.run(ready, u, x0, fine, after=True).y)
        slope = (ends[0] - ends[1]) / (2.0 * h)
        assert found.dy[:, :, k] == pytest.approx(slope, abs=1e-5 * np.abs(slope).max() + 1e-9)


@pytest.mark.parametrize("name", MODELS)
def test_sub_steps_and_casadi_s_machine_agree(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    made, p, u, fine = posed(MODELS[name]())
    x0 = np.zeros(made.n_x)
    own = made.run(made.prepare(p, STEP, SUB, [0], True), u, x0, fine, after=True)
    finely = made.run(
        made.prepare(p, STEP, SUB, [0], True), u, x0, fine, after=True, every_substep=True
    )
    assert finely.y[::SUB] == pytest.approx(own.y, rel=1e-12)
    monkeypatch.setattr(lure_kernel, "compiler", lambda: None)
    lure_kernel._runner.cache_clear()
    try:
        other = made.run(made.prepare(p, STEP, SUB, [0], True), u, x0, fine, after=True)
    finally:
        lure_kernel._runner.cache_clear()
    assert other.y == pytest.approx(own.y, rel=1e-9, abs=1e-9)
    assert other.dy == pytest.approx(own.dy, rel=1e-7, abs=1e-9)


def test_a_run_that_follows_jumps_reads_after_too() -> None:
    made, p, u, fine = posed(node(Coulomb(0.3)))
    assert isinstance(made, ExactDynamics)
    x0 = np.zeros(made.n_x)
    ready = made.prepare(p, STEP, SUB, (), False)
    for after in (False, True):
        seen = made.run(ready, u, x0, fine, after=after)
        found = followed(made.compiled, p, u, STEP, x0, "hold", None, seen, after=after)
        if found is None:
            pytest.skip("nothing is compiled here")
        # this friction slides all the time but for moments
        assert np.median(np.abs(found[0] - seen.y)) < 1e-3 * np.abs(seen.y).max()


def test_a_general_model_has_the_jump_of_small_motions() -> None:
    from bondgraph.equations.codegen import program_of
    from bondgraph.equations.derivation import equations

    exact, p, u, fine = posed(slide())
    graph = slide()
    general = GeneralDynamics(program_of(equations(graph)), graph.parameters)
    q = general.vector({})
    one = exact.run(exact.prepare(p, STEP, SUB, [0], True), u, np.zeros(2), fine, after=True)
    other = general.run(general.prepare(q, STEP, SUB, [0], True), u, np.zeros(2), fine, after=True)
    size = np.abs(one.y).max(axis=0)
    assert other.y / size == pytest.approx(one.y / size, abs=1e-4)
    width = np.abs(one.dy[:, :, 0]).max(axis=0)
    assert other.dy[:, :, 0] / width == pytest.approx(one.dy[:, :, 0] / width, abs=1e-3)


def recorded(*, after: bool, gain: float = 1.0) -> Recording:
    """A record of SciPy's discrete system, which reads after the step; before it, by hand."""
    m, d, k, n = 0.7, 5.0, 1800.0, 1500
    rng = np.random.default_rng(1)
    time, u = STEP * np.arange(n, dtype=float), np.repeat(rng.normal(size=n // 3), 3) * 8.0
    a, b = np.array([[0.0, 1.0], [-k / m, -d / m]]), np.array([[0.0], [1 / m]])
    c, through = np.array([[1.0, 0.0], [-k / m, -d / m]]), np.array([[0.0], [1 / m]])
    system = cont2discrete((a, b, c, through), STEP)
    y = dlsim(system, u)[1]
    if not after:
        y = y - np.vstack([u, np.r_[u[0], u[:-1]]]).T @ np.array([[0.0, 1 / m], [0.0, -1 / m]])
    y = y + rng.normal(size=y.shape) * 0.004 * y.std(axis=0)
    return Recording(
        "slide", time, {"F": u, "x": gain * y[:, 0], "a": y[:, 1]},
        {"F": "N", "x": "m", "a": "m/s^2"},
    )  # fmt: skip


@pytest.mark.parametrize("after", [False, True])
def test_a_fit_finds_the_side_of_the_step(after: bool) -> None:
    found = estimate(Study(slide(), recorded(after=after)))
    assert found.setting.hold == ("hold-after" if after else "hold")
    assert found.values["m"] == pytest.approx(0.7, rel=2e-3)
    assert found.values["k"] == pytest.approx(1800.0, rel=2e-3)
    assert any("after their steps" in note for note in found.notes) is after


def test_a_method_that_reads_before_says_so() -> None:
    study = Study(slide(), recorded(after=True), hold="hold-after")
    with pytest.raises(UnusableInput, match=r"use method='single_shooting' or 'frequency_domain'"):
        estimate(study, method="multiple_shooting")


def test_a_diagnosis_takes_no_side_of_a_step_for_missing_physics() -> None:
    found = diagnose(slide(), recorded(after=True))
    assert found.kind == "parameters_only"
    assert any("commands between samples: hold-after" in note for note in found.notes)


def test_a_wrong_gain_beside_it_is_found_where_it_may_sit() -> None:
    """The model as it is cannot tell the side of the step; the right law can, and looks again."""
    found = diagnose(slide(), recorded(after=True, gain=1.12), options=DiagnosisOptions(effects=1))
    assert found.findings[0].chosen is not None
    assert found.findings[0].chosen.effect == "sensor_gain"
    labels = {t.label for t in found.trials if t.test < 1.5}
    assert {"sensor_gain at x", "sensor_gain at a"} <= labels
