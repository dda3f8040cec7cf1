"""Numbers of an operator as parameters: names, values, exact derivatives, and a fit."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import pytest

from actuators.stack.scaling import scaled
from bondgraph import TF, BondGraph, C, De, Dq, I, One, R, Se, Zero
from bondgraph.graph.drives import Drive
from bondgraph.hysteresis import AlJanaideh, Ang, BoucWen, DeadZones, Operator, PrandtlIshlinskii
from bondgraph.hysteresis.errors import BadParameter
from bondgraph.laws import Hysteretic
from bondgraph.signals.recording import Recording
from bondgraph.simulation.exact_run import run_record
from bondgraph.simulation.lure import compile_model
from bondgraph.support.errors import UnknownName, UnusableInput
from bondgraph.support.ops import NUMPY
from identification.estimation import NO_NUISANCES, Study, Vary, estimate
from tests.bondgraph.hysteresis.examples import EXAMPLES, MODEL, PI
from tests.settled import simulate

STEP, N = 0.02, 300
ANG_BEND = ("dead_zone.thresholds[1]", "dead_zone.weights[1]")


def positioner(operator: Operator, free: tuple[str, ...]) -> BondGraph:
    with BondGraph("positioner") as g:
        body = One("body")
        Se("F", unit="N") >> body >> I("m", 1.0, unit="kg")
        body >> R("d", 1.5, unit="N*s/m")
        body >> C("k", law=Hysteretic(operator, free=free))
        body >> C("guide", stiffness=3.0, unit="N/m")
        body >> Dq("x", unit="m")
    return g


def command(n: int = N) -> np.ndarray:
    t = STEP * np.arange(n)
    return np.asarray(3.0 * np.sin(1.9 * t) + 1.5 * np.sin(4.7 * t))


def test_names_and_values() -> None:
    law = Hysteretic(PI, free=("weights",))
    found = {p.name: p.value for p in law.parameters("k")}
    assert found == {f"weights_{i}_k": w for i, w in enumerate(PI.weights)}
    (one,) = Hysteretic(PI, free=("weights[2]",)).parameters("k")
    assert (one.name, one.value) == ("weights_2_k", PI.weights[2])
    assert not one.positive
    assert one.scale == max(abs(w) for w in PI.weights)
    twice = Hysteretic(PI, free=("weights[2]", "weights"))
    names = [p.name for p in twice.parameters("k")]
    assert len(names) == len(set(names)) == len(PI.weights)
    assert Hysteretic(PI).parameters("k") == ()


def test_unknown_numbers_are_errors_with_the_nearest() -> None:
    with pytest.raises(UnknownName, match=r"Did you mean 'weights'"):
        Hysteretic(PI, free=("weight",))
    with pytest.raises(UnknownName, match=r"no number 'weights\[9\]'"):
        Hysteretic(PI, free=("weights[9]",))


def test_one_name_is_a_name_and_what_is_none_is_said() -> None:
    assert Hysteretic(PI, free="weights[2]") == Hysteretic(PI, free=("weights[2]",))  # type: ignore[arg-type]
    for wrong in (True, ("weights", 3)):
        with pytest.raises(UnusableInput, match="names no number; give names, such as"):
            Hysteretic(PI, free=wrong)  # type: ignore[arg-type]


def test_law_with_other_numbers_is_the_other_operator() -> None:
    law = Hysteretic(PI, free=("weights",))
    other = (0.9, 0.1, 0.7, -0.3)
    moved = PrandtlIshlinskii(PI.thresholds, other)
    memory, expected = law.initial_memory(0.0), moved.initial_memory(0.0)
    for s in (0.2, 1.7, -0.4, 3.0, 2.9):
        memory = law.advance(NUMPY, s, memory, other)
        expected = moved.advance(NUMPY, s, expected)
        value = law.deviation(NUMPY, s, memory, other) + law.slope * s
        assert value == pytest.approx(moved.value(NUMPY, s, expected))


def numbers_of(operator: Operator) -> tuple[str, ...]:
    """Every number that the operator has."""
    values = {f.name: getattr(operator, f.name) for f in fields(operator)}  # type: ignore[arg-type]
    return tuple(n for n, v in values.items() if isinstance(v, float))


FREE = {
    "prandtl_ishlinskii": ("weights",),
    "dead_zone": ("weights",),
    "bouc_wen": numbers_of(EXAMPLES["bouc_wen"]),
    "al_janaideh": ("q", "sigma", "alpha", "beta"),
    "ang": ("play.weights", "play.thresholds[1]", "dead_zone.weights", "dead_zone.thresholds[1]"),
    "preisach": ("densities[1]", "slope"),
    "hysteresis_with_creep": (
        "hysteresis.weights",
        "hysteresis.thresholds[1]",
        "creep.weights",
        "creep.eigenvalues[1]",
    ),
    "cascade of all": ("first.hysteresis.weights[1]", "first.creep.weights", "second.weights"),
}


@pytest.mark.sampled(every=3)
@pytest.mark.parametrize("name", FREE)
def test_free_numbers_at_their_values_change_nothing(name: str) -> None:
    operator = EXAMPLES[name]
    assert FREE[name]
    models = [compile_model(positioner(operator, free)) for free in ((), FREE[name])]
    u = command()[:, None]
    expected, found = (run_record(m, m.nominal(), u, STEP, np.zeros(m.n_x)) for m in models)
    assert np.allclose(found.y, expected.y, rtol=1e-9, atol=1e-12)
    assert np.ptp(found.y) > 0


def test_numbers_that_may_not_move_are_refused() -> None:
    with pytest.raises(BadParameter, match="must be 0"):
        Hysteretic(PI, free=("thresholds",))
    with pytest.raises(BadParameter, match="0 once"):
        Hysteretic(Ang.stack_2hz(), free=("dead_zone.thresholds",))
    with pytest.raises(UnknownName, match=r"'play\.weights'"):
        Hysteretic(Ang.stack_2hz(), free=("weights",))
    with pytest.raises(UnknownName, match=r"no number 'weights'.*hysteresis\.weights"):
        Hysteretic(MODEL, free=("weights",))


BOUC = next(o for o in EXAMPLES.values() if isinstance(o, BoucWen))


@pytest.mark.parametrize(
    ("operator", "free"),
    [
        (PI, ("weights",)),
        (BOUC, numbers_of(BOUC)),
        (PI, ("thresholds[2]", "weights[1]")),
        (MODEL, FREE["hysteresis_with_creep"]),
    ],
    ids=["weights", "bouc_wen", "threshold", "beside creep"],
)
def test_derivatives_by_the_numbers_match_differences(
    operator: Operator, free: tuple[str, ...]
) -> None:
    model = compile_model(positioner(operator, free))
    names = [n for n in model.parameter_names if n.endswith("_k")]
    assert names
    p, u, start = model.nominal(), command()[:, None], np.zeros(model.n_x)
    at = [model.parameter_names.index(n) for n in names]
    run = run_record(model, p, u, STEP, start, directions=at)
    for j, i in enumerate(at):
        h = 1e-6 * max(abs(p[i]), 1.0)
        ends = []
        for sign in (1, -1):
            moved = p.copy()
            moved[i] += sign * h
            ends.append(run_record(model, moved, u, STEP, start).y)
        numeric = (ends[0] - ends[1]) / (2 * h)
        size = np.abs(numeric).max()
        # corners of the plays fall between the samples of one run and the other
        assert np.median(np.abs(run.dy[:, :, j] - numeric)) < 1e-4 * size + 1e-9, names[j]
        assert np.abs(run.dy[:, :, j] - numeric).max() < 2e-2 * size + 1e-9, names[j]


def test_weights_are_found_in_their_intervals() -> None:
    true = positioner(PI, ("weights",))
    u = command(1500) * np.linspace(0.3, 9.0, 1500)
    t = STEP * np.arange(1500)
    x = np.asarray(simulate(true, t, {"F": u}, accuracy=1e-7)["x"])
    x = x + 1e-4 * np.random.default_rng(2).standard_normal(x.size)
    made = Recording.from_arrays("loops", {"F[N]": u, "x[m]": x}, fs=1 / STEP)
    free = tuple(Vary(f"weights_{i}_k", start=0.5) for i in range(len(PI.weights)))
    found = estimate(Study(true, made, free=("m", *free), nuisances=NO_NUISANCES, initial="rest"))
    for i, w in enumerate(PI.weights):
        e = found.estimate_of(f"weights_{i}_k")
        error = (e.ci95[1] - e.ci95[0]) / (2 * 1.96)
        assert abs(e.value - w) < 3.5 * error, e
        assert e.value == pytest.approx(w, abs=0.02)


def test_numbers_beside_creep_are_found_in_their_intervals() -> None:
    """A weight and a threshold of the hysteresis, and a weight of the creep, in one study."""
    numbers = ("hysteresis.weights[1]", "hysteresis.thresholds[1]", "creep.weights[1]")
    true = positioner(MODEL, numbers)
    u = command(1500) * np.linspace(0.3, 3.0, 1500)
    t = STEP * np.arange(1500)
    x = np.asarray(simulate(true, t, {"F": u}, accuracy=1e-6)["x"])
    x = x + 1e-3 * np.random.default_rng(4).standard_normal(x.size)
    made = Recording.from_arrays("loops", {"F[N]": u, "x[m]": x}, fs=1 / STEP)
    values = {p.name: p.value for p in Hysteretic(MODEL, free=numbers).parameters("k")}
    free = tuple(Vary(n, start=1.15 * v) for n, v in values.items())
    found = estimate(Study(true, made, free=("m", *free), nuisances=NO_NUISANCES, initial="rest"))
    for n, v in values.items():
        low, high = found.estimate_of(n).ci95
        assert abs(found.values[n] - v) < 3.5 * (high - low) / (2 * 1.96), n
        assert found.values[n] == pytest.approx(v, rel=0.03), n


@pytest.mark.parametrize(
    ("operator", "free"),
    [
        (
            Ang.stack_2hz(),
            (*(f"play.weights[{i}]" for i in range(5)), *ANG_BEND),
        ),
        (AlJanaideh.stack_2hz(), ("q", "sigma", "alpha", "beta")),
    ],
    ids=["ang", "al_janaideh"],
)
def test_operators_of_the_stack_are_found_in_a_study(
    operator: Ang | AlJanaideh, free: tuple[str, ...]
) -> None:
    relative = scaled(operator, 1.0, 1.0 / float(operator.linear_slope))
    law = Hysteretic(relative, free=free)
    true = {p.name: p.value for p in law.parameters("V_in")}
    with BondGraph("pure") as g:
        rate = g.parameter("g", float(operator.linear_slope), "m/V", fixed=True)
        tip = Zero("tip")
        Se("V_in", unit="V", drive=Drive(law=law)) >> TF("G", ratio=1 / rate) >> tip
        tip >> De("x", unit="m")
    t = np.arange(1500) / 1e3
    v = 50.0 * (1.0 - np.cos(4.0 * np.pi * t)) * np.interp(t, [0.0, 0.5, 1.5], [1.0, 1.0, 0.4])
    x = simulate(g, t, {"V_in": v})["x"] + 2e-9 * np.random.default_rng(0).standard_normal(t.size)
    made = Recording("loops", t, {"V_in": v, "x": x}, {"V_in": "V", "x": "m"})
    start = tuple(
        Vary(n, start=value * (0.9, 1.15)[i % 2]) for i, (n, value) in enumerate(true.items())
    )
    found = estimate(Study(g, made, free=start, nuisances=NO_NUISANCES, initial="rest"))
    assert found.rmse("test")["x"] < 2.2e-9
    for name, value in true.items():
        low, high = found.estimate_of(name).ci95
        assert abs(found.values[name] - value) < 3.5 * (high - low) / (2 * 1.96), name
        assert found.values[name] == pytest.approx(value, rel=0.04), name


def test_dead_zone_values_outside_of_memory() -> None:
    """An operator without memory may have free numbers too."""
    zones = DeadZones((-0.5, 0.0, 0.7), (0.3, 1.0, 0.5))
    law = Hysteretic(zones, free=("weights",))
    assert law.n_memory == 0
    other = (0.1, 2.0, 0.2)
    moved = DeadZones(zones.thresholds, other)
    for s in (-2.0, -0.1, 0.4, 3.0):
        value = law.deviation(NUMPY, s, (), other) + law.slope * s
        assert value == pytest.approx(moved.value(NUMPY, s, ()))
