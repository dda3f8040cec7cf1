"""What a model tells only together stays so beside a memory: its thresholds set a scale by hand."""

from __future__ import annotations

import numpy as np

from bondgraph import BondGraph, C, De, One, R, Se, Zero
from bondgraph.signals.split import interleaved
from identification.diagnosis.catalogue import by_name
from identification.diagnosis.explanation.notes import tied_in
from identification.diagnosis.screening.observation import scene
from identification.diagnosis.search.candidates import trial_of
from identification.diagnosis.search.nominal import nominal_fit
from identification.estimation.single_record import fit
from identification.study.data import Data
from tests.settled import simulate


def charged() -> BondGraph:
    """A capacitor behind a resistor; its voltage alone is read, no current and no charge."""
    with BondGraph("charged") as g:
        loop, node = One("loop"), Zero("node")
        Se("V", unit="V") >> loop >> R("R_s", 50.0, unit="ohm")
        loop >> node >> C("C_p", 3e-6, unit="F")
        node >> De("V_p", unit="V")
    return g


def test_a_product_stays_the_only_thing_told_beside_hysteresis() -> None:
    n, dt = 600, 2e-5
    t = dt * np.arange(n)
    voltage = 50 * np.sin(2 * np.pi * 190 * t) + 20 * np.sin(2 * np.pi * 630 * t + 1)
    run = simulate(charged(), t, {"V": voltage})["V_p"]
    noise = np.array([0.02])
    readings = (run + 0.02 * np.random.default_rng(1).standard_normal(n))[:, None]
    data = Data("run", t, {"V": voltage}, readings, ("V_p",), noise, interleaved(0, n), "linear")
    template, nominal = nominal_fit(charged(), data, "linear")
    assert [t.only for t in tied_in(nominal, (), nominal)] == ["R_s*C_p"]
    seen = scene(nominal)
    made = by_name("hysteresis").insert(seen, seen.graph["C_p"])
    beside = type(template)(made.graph, data, starts={**nominal.values, **made.starts[0]})
    last = trial_of(made, True, fit(beside, max_iterations=4))
    (told,) = tied_in(last.fit, (last,), nominal)
    assert told.only == "R_s*C_p"
    low, high = told.told[0].ci95
    assert low < 150e-6 < high
    # a law whose constants are all fitted brings no scale of its own
    assert tied_in(last.fit, (), nominal) == ()
