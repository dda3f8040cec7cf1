"""Values that a fit carries absurdly far from what is declared, told in one sentence."""

from __future__ import annotations

import re
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bondgraph import BondGraph, C, De, Df, I, One, R, Se, Sf, Zero
from bondgraph.graph.parameter import Parameter
from bondgraph.signals.recording import Recording
from bondgraph.support.notice import Notice
from identification.diagnosis.diagnose import diagnose
from identification.diagnosis.screening import mixups
from identification.diagnosis.screening.mixups import moved
from identification.diagnosis.search.candidates import DiagnosisOptions
from identification.diagnosis.verdict.text import sentence
from tests.settled import simulate
from tests.spring import spring

DECLARED = spring().parameters


def fitted(known_to: float = 1.1, **factors: float) -> Any:
    declared = {**DECLARED, "c_d": Parameter("c_d", 1.0, unit="N")}
    estimates = []
    for n, f in factors.items():
        v = declared[n].value * f
        ends = (v / known_to, v * known_to)
        estimates.append(SimpleNamespace(name=n, value=v, unit=declared[n].unit, ci95=ends))
    data = SimpleNamespace(commands={"F": None}, names=("x",))
    return SimpleNamespace(estimates=estimates, problem=SimpleNamespace(data=data))


def test_one_value_far_off_is_told_with_its_numbers() -> None:
    (said,) = moved(fitted(m=1e3, d=1.1, k=0.9), DECLARED)
    assert said.startswith("m is declared as")


def test_a_value_whose_interval_holds_what_is_declared_is_no_word_worth() -> None:
    assert moved(fitted(known_to=1e4, m=1e3, d=1e-3), DECLARED) == ()


def test_several_values_far_off_tell_of_a_unit_and_name_the_channels(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(mixups, "_blamed", lambda *_: ())  # nothing to derive from here
    (said,) = moved(fitted(m=1e3, d=1e3, k=1e-3), DECLARED)
    assert said.startswith("check the units of F, x first: 3 parameters")
    assert "m 1e+03, d 1e+03, k 0.001" in said


def test_values_near_what_is_declared_are_no_word_worth() -> None:
    assert moved(fitted(m=1.3, d=5.0, k=0.7), DECLARED) == ()


def test_what_a_law_is_sized_by_was_declared_by_nobody() -> None:
    assert moved(fitted(m=1.3, c_d=1e6), DECLARED) == ()


def charged(farad: float, ohm: float) -> BondGraph:
    with BondGraph("charge") as g:
        node = Zero("node")
        Sf("I", unit="A") >> node >> C("C", farad, unit="F")
        node >> R("R", ohm, unit="Ohm")
        node >> De("v", unit="V")
    return g


def test_values_that_make_up_for_a_unit_are_said_in_the_answer() -> None:
    rng = np.random.default_rng(0)
    t = np.asarray(1e-3 * np.arange(600), np.float64)
    current = np.repeat(rng.standard_normal(30), 20)
    v = np.asarray(simulate(charged(1e-3, 20.0), t, {"I": current}, hold="hold")["v"])
    v = v + 1e-3 * v.std() * rng.standard_normal(t.size)
    kilo = Recording("run", t, {"I": 1e-3 * current, "v": v}, {"I": "A", "v": "V"})
    options = DiagnosisOptions(jobs=1, keep=2, more=1, effects=1)
    told: list[str] = []
    d = diagnose(
        charged(8e-4, 25.0), kilo, hold="hold", options=options,
        progress=lambda text, _: told.append(text),
    )  # fmt: skip
    # at once: the search has not begun
    first = next(i for i, text in enumerate(told) if isinstance(text, Notice))
    assert told[first].startswith("check the unit of ")
    assert not any("screening" in text for text in told[:first])
    assert any("screening" in text for text in told[first:])
    assert d.kind == "parameters_only"
    assert "nothing missing shows. But check the unit of " in sentence(d)
    said = sentence(d)
    assert re.search(r"\bv \(about (800|900|1000) times too large\)", said)
    assert re.search(r"\bI \(about (800|900|1000) times too small\)", said)
    assert "first: 2 parameters are fitted absurdly far" in sentence(d)


def coil(farad: float, henry: float, ohm: float) -> BondGraph:
    with BondGraph("coil") as g:
        loop, node = One("loop"), Zero("node")
        Se("V", unit="V") >> loop >> I("L", henry, unit="H")
        loop >> R("R", ohm, unit="ohm")
        loop >> node >> C("Cap", farad, unit="F")
        node >> De("v", unit="V")
        loop >> Df("i", unit="A")
    return g


@pytest.mark.parametrize(
    ("channel", "factor", "says"),
    [
        ("i", 1e-3, "check the unit of i (about 1000 times too small) first: 3 parameters"),
        ("t", 1e3, "check the unit of time (about 1000 times too large) first: "),
        # below what alone would be absurd
        ("i", 10.0, "all values are fitted as if a unit were forgotten: check that of i (about 9 "),
    ],
)
def test_the_channel_is_named_whose_unit_the_values_make_up_for(
    channel: str, factor: float, says: str
) -> None:
    rng = np.random.default_rng(4)
    t = np.asarray(1e-4 * np.arange(400), np.float64)
    volts = np.repeat(rng.standard_normal(40), 10)
    run = simulate(coil(1e-3, 2e-3, 1.0), t, {"V": volts}, hold="hold")
    seen = {"V": volts}
    for name in ("v", "i"):
        y = np.asarray(run[name])
        seen[name] = y + 1e-3 * y.std() * rng.standard_normal(t.size)
    if channel in seen:
        seen[channel] = factor * seen[channel]
    time = factor * t if channel == "t" else t
    record = Recording("run", time, seen, {"V": "V", "v": "V", "i": "A"})
    options = DiagnosisOptions(jobs=1, keep=2, more=1, effects=1)
    d = diagnose(coil(1.2e-3, 1.8e-3, 0.9), record, hold="hold", options=options)
    assert f". But {says}" in sentence(d)
    assert sum("unit" in n for n in d.notes if "check" in n) == 1
