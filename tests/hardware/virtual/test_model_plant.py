"""Models of the language on the bench: exact steps, memory, the general integrator, refusals."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from bondgraph import BondGraph, C, Dq, I, One, R, Se
from bondgraph.graph.sensors import Sensor
from bondgraph.hysteresis import PrandtlIshlinskii
from bondgraph.laws import Hysteretic, Polynomial
from bondgraph.support.errors import UnknownName, UnusableInput
from hardware.simulators.plant_contract import Plant, Rewindable
from hardware.simulators.rig import Rig
from hardware.virtual import ModelPlant
from tests.bondgraph.readings_bench import bench, shaken
from tests.settled import simulate
from tests.spring import spring

STEP = 1e-4


def oscillator(law: Any = None, second: bool = False) -> BondGraph:
    return spring(0.5, 4.0, 2e3, law, name="positioner", speed="v" if second else "")


def hysteretic() -> BondGraph:
    """With play operators in the spring."""
    operator = PrandtlIshlinskii((0.0, 1e-3, 3e-3), (2e3, -400.0, -300.0))
    return oscillator(Hysteretic(operator))


def swing(n: int, seed: int = 0) -> Any:
    """Forces of a converter."""
    return np.repeat(np.random.default_rng(seed).uniform(-10.0, 10.0, n // 50), 50)


def test_a_linear_model_is_the_held_simulation() -> None:
    """Sample by sample what `simulate` gives for a held command."""
    force = swing(2000)
    plant: Plant = ModelPlant(oscillator(second=True), "F", "x", "v", step=STEP)
    motion = plant.advance(force)
    made = simulate(
        oscillator(second=True),
        np.arange(2001) * STEP,
        {"F": np.append(force, 0.0)},
        hold="hold",
        x0=np.zeros(2),
    )
    assert np.abs(motion.x - made["x"][1:]).max() < 1e-12 * np.ptp(made["x"])
    assert np.abs(motion.i - made["v"][1:]).max() < 1e-12 * np.ptp(made["v"])
    assert np.isnan(ModelPlant(oscillator(), "F", "x").advance(force[:3]).i).all()


@pytest.mark.parametrize(
    ("graph", "parameters"),
    [
        (oscillator(), {}),
        (hysteretic(), {}),
        (oscillator(Polynomial(half=5e-3, size=1.0, orders=(3,), unit="N")), {"a_3_k": 4.0}),
    ],
)
def test_cut_anywhere_and_looked_at_it_is_the_same(graph: Any, parameters: Any) -> None:
    """State and memory of operators go on; a look leaves no trace."""
    force = swing(3000, 1)
    whole, cut = (ModelPlant(graph, "F", "x", step=STEP, parameters=parameters) for _ in range(2))
    assert isinstance(cut, Rewindable)
    a = whole.advance(force).x
    parts, at = [], 0
    for n in (1, 7, 400, 33, 1500):
        state = cut.snapshot()
        cut.advance(np.array([30.0, -20.0]))
        cut.restore(state)
        parts.append(cut.advance(force[at : at + n]).x)
        at += n
    assert np.array_equal(np.concatenate(parts), a[:at])
    assert cut.advance(np.zeros(0)).x.size == 0


def test_memory_stays() -> None:
    """Pushed and released slowly, a spring with plays keeps a part of the way."""
    plant = ModelPlant(hysteretic(), "F", "x", step=STEP)
    up, down = np.linspace(0.0, 8.0, 10_000), np.linspace(8.0, 0.0, 10_000)
    pushed = plant.advance(up).x[-1]
    left = plant.advance(down).x[-1]
    assert 0.05 * pushed < left < 0.9 * pushed
    assert plant.advance(up).x[-1] == pytest.approx(pushed, rel=0.02)
    virgin = ModelPlant(hysteretic(), "F", "x", step=STEP)
    assert np.abs(virgin.advance(np.zeros(100)).x).max() == 0.0


def test_it_stands_on_a_rig() -> None:
    """A step of the force through the rig is the known answer of an oscillator."""
    rig = Rig(ModelPlant(oscillator(), "F", "x", step=STEP))
    rig.wait(10 * STEP)
    rig.drive(4.0)
    begin = rig.now
    rig.wait(0.5)
    t = np.linspace(begin, rig.now, 700)
    w0, damping = np.sqrt(2e3 / 0.5), 4.0 / (2.0 * np.sqrt(2e3 * 0.5))
    w, s = w0 * np.sqrt(1.0 - damping**2), t - begin
    turn = np.cos(w * s) + damping / np.sqrt(1.0 - damping**2) * np.sin(w * s)
    exact = 4.0 / 2e3 * (1.0 - np.exp(-damping * w0 * s) * turn)
    assert np.abs(rig.seen(t).x - exact).max() < 1e-6 * np.ptp(exact)


def looped() -> BondGraph:
    """Two springs on one mass with a resistor loop between: no exact steps."""
    with BondGraph("loop") as g:
        body = One("body")
        Se("F", unit="N") >> body >> I("m", 0.5, unit="kg")
        body >> C("k", stiffness=2e3, unit="N/m")
        body >> I("n", 0.25, unit="kg", law=Polynomial(half=1.0, size=0.1, orders=(3,), unit="m/s"))
        body >> R("d", 4.0, unit="N*s/m")
        body >> Dq("x", unit="m")
    return g


def test_any_other_model_goes_through_the_general_integrator() -> None:
    """Cut or whole it is the same, and it agrees with `simulate` for a smooth command."""
    graph, values = looped(), {"a_3_n": 0.3}
    n = 2000
    force = 6.0 * np.sin(np.arange(n + 1) * STEP * 40.0)
    plant, cut = (ModelPlant(graph, "F", "x", step=STEP, parameters=values) for _ in range(2))
    a = plant.advance(0.5 * (force[1:] + force[:-1])).x
    made = simulate(graph, np.arange(n + 1) * STEP, {"F": force}, values)["x"]
    assert np.abs(a - (made[1:] - made[0])).max() < 1e-4 * np.ptp(made)
    mean = 0.5 * (force[1:] + force[:-1])
    b = np.concatenate([cut.advance(part).x for part in np.split(mean, [1, 100, 777])])
    assert np.abs(b - a).max() < 1e-9 * np.ptp(a)


def test_a_source_may_be_called_like_a_ramp() -> None:
    with BondGraph("rc") as g:
        loop = One("loop")
        Se("ramp_up") >> loop >> R("R_1", 1.0)
        loop >> C("C_1", 1.0)
        loop >> Dq("x")
    assert ModelPlant(g, "ramp_up", "x", step=STEP).advance(np.ones(3)).x[-1] > 0.0


def test_what_cannot_stand_on_a_bench_is_refused() -> None:
    """One line each."""
    for arguments, error in (
        (("V", "x"), UnknownName),
        (("F", "y"), UnknownName),
        (("F", "x", "i"), UnknownName),
    ):
        with pytest.raises(error):
            ModelPlant(oscillator(), *arguments)
    with pytest.raises(UnknownName):
        ModelPlant(oscillator(), "F", "x", parameters={"mass": 3.0})
    with pytest.raises(UnusableInput, match="step"):
        ModelPlant(oscillator(), "F", "x", step=0.0)
    with BondGraph("late") as g:
        body = One("body")
        g.parameter("d", 1e-3, "s")
        Se("F", unit="N") >> body >> I("m", 0.5, unit="kg")
        body >> Dq("x", unit="m", delay="d")
    with pytest.raises(UnusableInput, match="dead time"):
        ModelPlant(g, "F", "x")


@pytest.mark.parametrize(("graph", "source"), [(bench(), "F"), (shaken("rate"), "b")])
def test_every_reading_stands_on_the_bench(graph: BondGraph, source: str) -> None:
    """Encoders, accelerometers, force cells and monitors; bases that move by their acceleration."""
    command, time = 20.0 * swing(600), np.arange(601) * STEP
    rest = simulate(graph, time[:2], {source: np.zeros(2)})
    x0 = np.asarray(rest.state)
    made = simulate(graph, time, {source: np.append(command, 0.0)}, hold="hold", x0=x0)
    held = np.diff(command, append=0.0) == 0  # some readings jump with the command
    for e in graph.of_type(Sensor):
        found = ModelPlant(graph, source, e.name, step=STEP).advance(command).x
        wanted = (np.asarray(made[e.name])[1:] - np.asarray(rest[e.name])[0])[held]
        assert np.ptp(wanted) > 0, e.name
        assert found[held] == pytest.approx(wanted, abs=1e-9 * np.ptp(wanted)), e.name


def test_a_recorded_displacement_whose_rate_is_needed_is_refused() -> None:
    with pytest.raises(UnusableInput, match=r"rate d_b.* give a base by its velocity"):
        ModelPlant(shaken("integral"), "b", "w", step=STEP)
