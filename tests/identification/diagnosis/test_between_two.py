"""Laws through two nodes: a leak from one store into another, a spring or damper between masses."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from bondgraph import TF, BondGraph, C, De, Df, I, One, R, Se, Sf, Zero, simulate
from bondgraph.graph.elements import Source
from bondgraph.graph.sensors import Sensor
from bondgraph.laws import Orifice
from bondgraph.signals.recording import Recording, Split
from identification.diagnosis.catalogue import by_name
from identification.diagnosis.catalogue.effect import Hint
from identification.diagnosis.diagnose import Diagnosis, diagnose
from identification.diagnosis.screening.observation import scene
from identification.diagnosis.search.candidates import DiagnosisOptions
from identification.estimation.single_record import fit
from identification.study.data import Data
from identification.study.problem import Problem

N, DT, NOISE = 1500, 0.02, 2e-3


def cylinder(missing: str = "") -> BondGraph:
    """Return two chambers on either side of a piston; something may seep between or out."""
    with BondGraph("cylinder") as g:
        front, back, rod = Zero("front"), Zero("back"), One("rod")
        Sf("Q", unit="m3/s") >> front >> C("C_A", 0.5, unit="m3/Pa")
        front >> TF("area_A", ratio=1.0, fixed=True) >> rod >> I("m", 0.4, unit="kg")
        rod >> R("b", 1.5, unit="N*s/m")
        rod >> TF("area_B", ratio=0.7, fixed=True) >> back >> C("C_B", 0.3, unit="m3/Pa")
        back >> R("R_B", 2.5, unit="Pa*s/m3")
        front >> De("p_A", unit="Pa")
        back >> De("p_B", unit="Pa")
        if missing == "out":
            front >> R("leak", 4.0, unit="Pa*s/m3")
        elif missing:
            hole = Orifice(0.2, 1.0) if missing == "hole" else None
            gap = One("gap")
            front >> gap >> R("leak", 1e-3 if hole else 4.0, law=hole, unit="Pa*s/m3")
            gap >> back
    return g


def chain(missing: str = "") -> BondGraph:
    """Return three masses one behind the other; the first and the last may be joined."""
    with BondGraph("chain") as g:
        first, between, second, behind, third = (
            One("first"), Zero("between"), One("second"), Zero("behind"), One("third"),
        )  # fmt: skip
        Se("F", unit="N") >> first >> I("m_1", 1.0, unit="kg")
        first >> between >> second >> I("m_2", 0.6, unit="kg")
        second >> behind >> third >> I("m_3", 0.8, unit="kg")
        for node, n, k in ((between, 1, 40.0), (behind, 2, 25.0)):
            strut = One(f"strut_{n}")
            node >> strut >> C(f"k_{n}", stiffness=k, unit="N/m")
            strut >> R(f"d_{n}", 0.5, unit="N*s/m")
        third >> C("k_3", stiffness=30.0, unit="N/m")
        third >> R("d_3", 0.8, unit="N*s/m")
        first >> Df("v_1", unit="m/s")
        third >> Df("v_3", unit="m/s")
        if missing:
            joint = Zero("joint")
            first >> joint >> third
            joint >> (R("x", 1.2) if missing == "damper" else C("x", stiffness=9.0))
    return g


def recorded(graph: BondGraph, size: float) -> Recording:
    t = np.asarray(DT * np.arange(N), np.float64)
    rng = np.random.default_rng(3)
    u = np.repeat(rng.uniform(-size, size, N // 25), 25)
    (drive,) = graph.of_type(Source)
    source = drive.name
    run: Any = simulate(graph, t, {source: u}, hold="hold")
    units = {e.name: e.unit for e in (drive, *graph.of_type(Sensor))}
    seen = {s.name: np.asarray(run[s.name]) for s in graph.of_type(Sensor)}
    noisy = {n: v + NOISE * v.std() * rng.standard_normal(N) for n, v in seen.items()}
    return Recording("run", t, {source: u, **noisy}, units)


def found(model: Callable[[str], BondGraph], missing: str) -> Diagnosis:
    options = DiagnosisOptions(jobs=1, effects=1, keep=4, more=3)
    return diagnose(model(""), recorded(model(missing), 1.0), options=options, hold="hold")


@pytest.mark.parametrize(
    ("model", "missing", "label", "law", "parameter", "truth"),
    [
        (cylinder, "gap", "internal_leakage at C_A", "resistor_between", "seep_C_A", 0.5),
        (cylinder, "hole", "internal_leakage at C_A", "orifice", "full_R_seep_C_A", None),
        (cylinder, "out", "leakage at C_A", "parallel_resistor", "leak_C_A", 0.5),
        (chain, "spring", "cross_coupling at m_1", "spring_between", "k_x_m_1", 9.0),
        (chain, "damper", "cross_coupling at m_1", "damper_between", "d_x_m_1", 1.2),
    ],
    ids=lambda v: v if isinstance(v, str) else "",
)
@pytest.mark.sampled(every=3)
def test_a_law_between_two_is_named_with_its_number(
    model: Callable[[str], BondGraph],
    missing: str,
    label: str,
    law: str,
    parameter: str,
    truth: float | None,
) -> None:
    d = found(model, missing)
    assert d.kind == "missing_physics"
    assert d.repaired is not None
    assert d.left is not None
    chosen = d.findings[0].chosen
    assert chosen is not None
    assert (chosen.label, chosen.insertion.law) == (label, law)
    assert d.left.most < 1.2
    if truth is not None:
        (own,) = (e for e in d.repaired.estimates if e.name == parameter)
        low, high = own.ci95
        assert low < truth < high
    if label != "leakage at C_A":
        assert ("C_B" if model is cylinder else "m_3") in chosen.insertion.sentence


def test_nothing_is_named_where_nothing_is_missing() -> None:
    assert found(cylinder, "").findings == ()
    assert found(chain, "").findings == ()


def test_only_two_that_nothing_joins_are_paired() -> None:
    """Not across a pipe or a spring, not across domains, not where a store shares its flow."""
    with BondGraph("mixed") as mixed:
        upper, pipe, lower, loop = Zero("upper"), One("pipe"), Zero("lower"), One("loop")
        Sf("Q", unit="m3/s") >> upper >> C("T_1", 0.02, unit="m3/Pa")
        upper >> pipe >> lower >> C("T_2", 0.02, unit="m3/Pa")
        pipe >> R("R_1", 50.0, unit="Pa*s/m3")
        lower >> TF("pump", ratio=1.0) >> loop >> C("C_e", 1.0, unit="F")
        loop >> R("R_e", 1.0, unit="ohm")
    assert by_name("internal_leakage").places(mixed) == ()
    assert [e.name for e in by_name("internal_leakage").places(cylinder())] == ["C_A"]
    assert [e.name for e in by_name("cross_coupling").places(chain())] == ["m_1"]
    assert by_name("cross_coupling").places(cylinder()) == ()


@pytest.mark.parametrize(
    ("store", "resistor"), [("F", "ohm"), ("J/K", "K/W"), ("m3/Pa", "Pa*s/m3")]
)
def test_what_seeps_has_the_units_of_its_domain(store: str, resistor: str) -> None:
    with BondGraph("two") as g:
        left, right = Zero("left"), Zero("right")
        ways = [One(f"way_{n}") for n in (1, 2)]
        middle = Zero("middle")
        Sf("in") >> left >> C("C_1", 2.0, unit=store)
        left >> ways[0] >> middle >> ways[1] >> right >> C("C_2", 3.0, unit=store)
        for number, way in enumerate(ways, start=1):
            way >> R(f"R_{number}", 1.0, unit=resistor)
        left >> De("e_1")
        right >> De("e_2")
    assert check_insertions(g, "internal_leakage", "C_1") == {"resistor_between", "orifice"}


def check_insertions(graph: BondGraph, effect: str, place: str) -> set[str]:
    """Insert every course of an effect, see that the graphs are sound, and return their laws."""
    t = np.asarray(DT * np.arange(300), np.float64)
    (source,) = graph.of_type(Sf)
    run: Any = simulate(graph, t, {source.name: np.sin(t)})
    read = {s.name: np.asarray(run[s.name]) for s in graph.of_type(De)}
    y = np.stack(list(read.values()), axis=1)
    split = Split(slice(0, 200), slice(200, 300), "first part")
    data = Data("run", t, {source.name: np.sin(t)}, y, tuple(read), 1e-3 * y.std(axis=0), split)
    seen, laws = scene(fit(Problem(graph, data), max_iterations=1)), set()
    own = by_name(effect)
    for s in own.signatures(seen, graph[place]):
        made = own.insert(seen, graph[place], Hint(s.shape or {}, np.ones(1)))
        assert made.graph.check() == ()
        laws.add(made.law)
    return laws
