"""A capacity that the model lacks, and a source with a resistance inside."""

from __future__ import annotations

import numpy as np
import pytest

from bondgraph import BondGraph, C, De, Df, I, One, R, Recording, Se, Sf, Zero
from bondgraph.graph.elements import Element
from bondgraph.graph.sensors import Sensor
from bondgraph.signals.recording import Split
from bondgraph.support.arrays import Array
from identification import DiagnosisOptions, diagnose
from identification.diagnosis.catalogue import CATALOGUE, by_name
from identification.diagnosis.catalogue.effect import Effect, Signature
from identification.diagnosis.diagnose import Diagnosis
from identification.diagnosis.screening.observation import scene
from identification.diagnosis.screening.port_history import FittedModel
from identification.diagnosis.screening.port_response import probes
from identification.diagnosis.screening.score_test import screen
from identification.diagnosis.verdict import in_words
from identification.estimation.single_record import Fit, fit
from identification.study.data import Data
from identification.study.problem import Problem

DT, N, FINE = 5.0, 400, 5
LIKE_IT = ("low_pass", "sensor_lag", "sensor_gain", "delay", "creep", "linear_capacity")
OPTIONS = DiagnosisOptions(
    jobs=1, effects=1, keep=3, more=2,
    without=tuple(e.name for e in CATALOGUE if e.name not in LIKE_IT),
)  # fmt: skip


def steps(seed: int, low: float, high: float) -> Array:
    """Levels that change at random times, within seven samples."""
    rng = np.random.default_rng(seed)
    edges = np.sort(rng.integers(0, N, 25))
    levels = rng.uniform(low, high, 26)[np.searchsorted(edges, np.arange(N))]
    return np.asarray(np.convolve(np.pad(levels, 3, "edge"), np.ones(7) / 7, "valid"))


def run(a: Array, b: Array, u: Array) -> Array:
    """States of ``dx/dt = a x + b u`` from rest, by classical Runge-Kutta."""
    x, found, h = np.zeros(len(a)), [np.zeros(len(a))], DT / FINE
    fine = np.interp(np.arange((N - 1) * 2 * FINE + 1) / (2 * FINE), np.arange(N), u)
    for k in range((N - 1) * FINE):
        begin, middle, end = fine[2 * k : 2 * k + 3]
        k_1 = a @ x + b * begin
        k_2 = a @ (x + h / 2 * k_1) + b * middle
        k_3 = a @ (x + h / 2 * k_2) + b * middle
        k_4 = a @ (x + h * k_3) + b * end
        x = x + h / 6 * (k_1 + 2 * k_2 + 2 * k_3 + k_4)
        if (k + 1) % FINE == 0:
            found.append(x)
    return np.array(found)


def noisy(y: Array, seed: int) -> Array:
    return np.asarray(y + 0.02 * y.std() * np.random.default_rng(seed).normal(size=y.shape))


def told(graph: BondGraph, channels: dict[str, Array]) -> Diagnosis:
    units = {n: str(getattr(graph[n], "unit", "")) for n in channels}
    recording = Recording("run", np.asarray(DT * np.arange(N), np.float64), channels, units)
    return diagnose(graph, recording, options=OPTIONS, hold="linear")


def places(name: str, graph: BondGraph) -> list[str]:
    return [e.name for e in by_name(name).places(graph)]


C_H, R_W, C_R, R_O = 400.0, 0.3, 900.0, 0.5


def two_lumps(power: Array) -> Array:
    """Temperatures of a heater and of the room around it."""
    a = np.array([
        [-1 / (R_W * C_H), 1 / (R_W * C_H)],
        [1 / (R_W * C_R), -(1 / R_W + 1 / R_O) / C_R],
    ])  # fmt: skip
    return run(a, np.array([1 / C_H, 0.0]), power)


def oven(*, both: bool) -> BondGraph:
    """Return an oven whose heater has no heat capacity, or one that is a single lump."""
    with BondGraph("oven") as g:
        heater = Zero("heater")
        Sf("P", unit="W") >> heater >> De("T_1", unit="K")
        if both:
            wall, room = One("wall"), Zero("room")
            heater >> wall >> R("R_w", 0.3, unit="K/W", spread=1.5)
            wall >> room >> C("C_r", 900.0, unit="J/K", spread=1.5)
            room >> R("R_o", 0.5, unit="K/W", spread=1.5)
            room >> De("T_2", unit="K")
        else:
            heater >> C("C_r", 1300.0, unit="J/K")
            heater >> R("R_o", 0.5, unit="K/W")
    return g


def ladder(*, middle: bool) -> BondGraph:
    """Return a ladder without its first capacitor, or one resistor and one capacitor."""
    with BondGraph("ladder") as g:
        loop, out = One("loop"), Zero("out")
        Se("V", unit="V") >> loop >> R("R_1", 1.0 if middle else 3.0, unit="ohm")
        loop >> Df("i", unit="A")
        if middle:
            node, second = Zero("node"), One("second")
            loop >> node >> second >> R("R_2", 2.0, unit="ohm")
            second >> out
        else:
            loop >> out
        out >> C("C_2", 20.0, unit="F")
        out >> De("v", unit="V")
    return g


def test_where_a_capacity_may_be_lacking() -> None:
    assert places("linear_capacity", oven(both=True)) == ["P", "C_r"]
    assert places("linear_capacity", oven(both=False)) == ["C_r"]
    assert places("linear_capacity", ladder(middle=True)) == ["R_1"]
    assert places("linear_capacity", ladder(middle=False)) == ["R_1"]


def test_a_source_of_effort_leaves_no_place_for_a_capacity() -> None:
    with BondGraph("bus") as g:
        bus = Zero("bus")
        Se("U", unit="V") >> bus
        for i in (1, 2):
            load = One(f"load_{i}")
            bus >> load >> R(f"R_{i}", 2.0, unit="ohm")
            load >> I(f"L_{i}", 3.0, unit="H")
            load >> Df(f"i_{i}", unit="A")
    assert places("linear_capacity", g) == []
    assert places("inner_resistance", g) == ["U"]


def test_a_resistance_inside_is_none_where_an_element_does_the_same() -> None:
    assert places("inner_resistance", ladder(middle=False)) == []
    assert places("inner_resistance", oven(both=False)) == []
    assert places("inner_resistance", oven(both=True)) == ["P"]
    with BondGraph("stage") as g:
        Sf("v", unit="m/s") >> Zero("link") >> One("body") >> I("m", 1.0, unit="kg")
    assert places("inner_resistance", g) == []


def fitted(graph: BondGraph, channels: dict[str, Array], name: str, element: str) -> Fit:
    """Fit one effect at one place, from the starts of its screening."""
    t = DT * np.arange(N)
    commands = {n: v for n, v in channels.items() if n in ("P", "V", "U")}
    readings = tuple(s.name for s in graph.of_type(Sensor))
    y = np.stack([channels[n] for n in readings], axis=1)
    floor = 0.02 * y.std(axis=0)
    split = Split(slice(0, N), slice(N, N), "all")
    data = Data("run", t, commands, y, readings, floor, split, hold="linear")
    nominal = fit(Problem(graph, data))
    seen = scene(nominal)
    effect = by_name(name)
    (s,) = screen(seen, probes(nominal), [OnlyAt(effect, element)])
    assert s.hint is not None
    made = effect.insert(seen, graph[element], s.hint)
    found = (fit(Problem(made.graph, data, starts=dict(v))) for v in made.starts)
    return min(found, key=lambda f: f.cost)


class OnlyAt(Effect):
    """An effect at one place."""

    name = "only_there"

    def __init__(self, effect: Effect, element: str) -> None:
        self.effect, self.element = effect, element

    def places(self, graph: BondGraph) -> tuple[Element, ...]:
        return (graph[self.element],)

    def signatures(self, scene: FittedModel, element: Element) -> tuple[Signature, ...]:
        return self.effect.signatures(scene, element)


def near(found: Fit, name: str, true: float) -> bool:
    (e,) = (e for e in found.estimates if e.name == name)
    return e.ci95[0] <= true <= e.ci95[1] and abs(e.value / true - 1) < 0.1


def test_a_further_lump_behind_a_resistance() -> None:
    """The same in another form: a lump beside the store in place of one before the outlet."""
    power = steps(2, 0.0, 100.0)
    x = two_lumps(power)
    found = fitted(
        oven(both=False), {"P": power, "T_1": noisy(x[:, 0], 3)}, "linear_capacity", "C_r"
    )
    assert found.chi2("train") < 1.2
    assert near(found, "C_r", C_H)
    assert near(found, "R_o", R_W + R_O)
    assert near(found, "capacity_C_r", C_R * (R_O / (R_W + R_O)) ** 2)


def two_capacitors(voltage: Array) -> dict[str, Array]:
    a = np.array([[-(1 / 1.0 + 1 / 2.0) / 10.0, 1 / 2.0 / 10.0], [1 / 2.0 / 20.0, -1 / 2.0 / 20.0]])
    x = run(a, np.array([1 / 10.0, 0.0]), voltage)
    return {"V": voltage, "v": noisy(x[:, 1], 4), "i": noisy(voltage - x[:, 0], 5)}


@pytest.mark.parametrize("middle", [True, False])
def test_a_capacitor_between_two_resistors_or_inside_one(middle: bool) -> None:
    found = fitted(
        ladder(middle=middle), two_capacitors(steps(6, -5.0, 5.0)), "linear_capacity", "R_1"
    )
    assert found.chi2("train") < 1.2
    assert near(found, "capacity_R_1", 10.0)
    assert near(found, "C_2", 20.0)
    if not middle:
        assert near(found, "R_1", 3.0)
        assert near(found, "before_R_1", 1.0 / 3.0)


def test_a_battery_whose_voltage_falls_with_the_current() -> None:
    voltage, inside = steps(7, 0.0, 12.0), 0.5
    with BondGraph("bus") as g:
        bus = Zero("bus")
        Se("U", unit="V") >> bus
        for i in (1, 2):
            load = One(f"load_{i}")
            bus >> load >> R(f"R_{i}", 1.0 * i, unit="ohm", spread=1.3)
            load >> I(f"L_{i}", 20.0 * i**2, unit="H", spread=1.3)
            load >> Df(f"i_{i}", unit="A")
    a = np.array([
        [-(1.0 + inside) / 20.0, -inside / 20.0], [-inside / 80.0, -(2.0 + inside) / 80.0],
    ])  # fmt: skip
    x = run(a, np.array([1 / 20.0, 1 / 80.0]), voltage)
    channels = {"U": voltage, "i_1": noisy(x[:, 0], 8), "i_2": noisy(x[:, 1], 9)}
    found = fitted(g, channels, "inner_resistance", "U")
    assert found.chi2("train") < 1.2
    assert near(found, "inside_U", inside)


def test_an_oven_whose_heater_has_no_heat_capacity() -> None:
    """It was told a lag of its command, with gains of both sensors beside it."""
    power = steps(2, 0.0, 100.0)
    x = two_lumps(power)
    channels = {"P": power, "T_1": noisy(x[:, 0], 3), "T_2": noisy(x[:, 1], 4)}
    d = told(oven(both=True), channels)
    (step,) = d.findings
    assert step.chosen is not None
    assert (step.answer, step.chosen.label) == ("exact", "linear_capacity at P")
    assert abs(step.chosen.fit.values["capacity_P"] / C_H - 1) < 0.05
    said = in_words(d)
    assert said.startswith("Heat capacity (linear capacity) is missing at the source P.\n")
    assert (
        "A heat capacity of the temperature there, which the model lacks, takes up a part" in said
    )
