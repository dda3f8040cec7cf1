"""A cell whose charge diffuses: creep explains most of it, Warburg's impedance all."""

from __future__ import annotations

import numpy as np
import pytest

from bondgraph import BondGraph, C, De, One, R, Sf, Zero
from bondgraph.graph.composing.components import COMPONENTS
from bondgraph.graph.composing.hierarchy import use
from bondgraph.signals.recording import Recording
from identification.diagnosis.catalogue import CATALOGUE
from identification.diagnosis.diagnose import diagnose
from identification.diagnosis.search.candidates import DiagnosisOptions
from tests.settled import simulate

N, DT, NOISE = 990, 0.5, 1e-4


def cell(*, diffuses: bool = False, unit: str = "F") -> BondGraph:
    with BondGraph("cell") as g:
        node, path, layer = Zero("node"), One("path"), Zero("layer")
        Sf("I", unit="A") >> node >> De("u", unit="V")
        node >> path >> R("R_0", 0.02, unit="ohm")
        path >> C("Q", 2000.0, unit=unit)
        path >> layer >> C("C_dl", 50.0, unit=unit)
        layer >> R("R_ct", 0.03, unit="ohm")
        if diffuses:
            part = COMPONENTS.make("warburg", coefficient=0.004, slowest=600.0, fastest=1.0)
            w = use(part, "w")
            path >> w.left
            w.right >> R("end", 1e-9, unit="ohm")
    return g


@pytest.mark.long
def test_a_cell_whose_charge_diffuses_gets_its_one_number() -> None:
    rng = np.random.default_rng(1)
    t = np.asarray(DT * np.arange(N), np.float64)
    current = np.repeat(rng.uniform(-3.0, 3.0, N // 30), 30)
    u = np.asarray(simulate(cell(diffuses=True), t, {"I": current}, hold="hold")["u"])
    run = Recording(
        "run", t, {"I": current, "u": u + NOISE * rng.standard_normal(N)}, {"I": "A", "u": "V"}
    )
    others = tuple(e.name for e in CATALOGUE if e.name not in ("creep", "leakage", "low_pass"))
    options = DiagnosisOptions(jobs=1, effects=1, keep=2, more=0, without=others)
    d = diagnose(cell(), run, options=options, hold="hold", noise={"u": NOISE})
    assert d.kind == "missing_physics"
    chosen = d.findings[0].chosen
    assert chosen is not None
    assert chosen.label == "creep at Q"
    assert chosen.insertion.law == "warburg"
    assert d.repaired is not None
    assert d.repaired.values["W_Q"] == pytest.approx(0.004, rel=0.02)
    assert d.repaired.values["Q"] == pytest.approx(2000.0, rel=0.02)
    assert d.left is not None
    assert d.left.most < 1.2
