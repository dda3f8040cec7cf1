"""What a fit says of its numbers: with units, by one measure, and in words that need no key."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from bondgraph import BondGraph, C, De, One, R, Se, Zero
from bondgraph.signals.recording import Recording
from bondgraph.simulation.simulate import simulate
from identification.estimation.estimate import estimate
from identification.report.numbers import within
from identification.study.study import Study
from identification.uncertainty.fitted import from_estimation
from identification.uncertainty.information import Sensitivities
from identification.uncertainty.postflight import practical_of
from identification.uncertainty.practical import practical
from identification.validation.judge import judge
from identification.validation.validation_data import Number

from .made import material, record
from .test_judge import white


def low_pass() -> BondGraph:
    with BondGraph("rc") as g:
        loop, node = One("loop"), Zero("node")
        Se("u", unit="V") >> loop >> R("R_1", 1000.0, unit="ohm")
        loop >> node >> C("C_1", 1e-6, unit="F")
        node >> De("y", unit="V")
    return g


def test_an_rc_circuit_is_told_to_know_its_time_constant() -> None:
    rng = np.random.default_rng(0)
    t = np.arange(1000) * 1e-4
    u = np.repeat(rng.choice([-5.0, 0.0, 5.0], 20), 50)
    y = simulate(low_pass(), t, {"u": u})["y"] + 2e-3 * rng.standard_normal(t.size)
    run = Recording.from_arrays("r", {"t_s": t, "u[V]": u, "y[V]": y})
    found = estimate(Study(low_pass(), run))
    text = f"{judge(found)}\n{' '.join(map(str, practical_of(from_estimation(found)).statements))}"
    said = " ".join(text.split())
    assert re.search(r"only as their product: R_1\*C_1 = \d\S* [mµ]s, 95 %", said)
    assert "other values of R_1 and C_1 together give the same readings" in said
    assert "what the recording tells is R_1*C_1 = 1 ms (±0." in said
    for jargon in ("flat", "unseen", "valley", "missing)", "mean square", "+-", "only differences"):
        assert jargon not in text


def test_a_pair_is_told_better_together_only_where_it_is() -> None:
    numbers = (Number("m", 1.0, "kg", (0.9, 1.1)), Number("k", 9.0, "N/m", (8.9, 9.1)))
    tied = np.array([[1.0, 0.995], [0.995, 1.0]])
    j = judge(replace(material(record(white(7)), numbers=numbers), correlation=tied))
    (note,) = (r.text for r in j.notes if "trade off" in r.text)
    assert "ratio" not in note  # k alone is known to a tenth of what m is
    assert "with m 10 % larger and k 1.1 % larger" in note
    even = (numbers[0], replace(numbers[1], ci95=(8.1, 9.9)))
    j = judge(replace(material(record(white(7)), numbers=even), correlation=tied))
    (note,) = (r.text for r in j.notes if "trade off" in r.text)
    assert "their ratio is known to ±1 %, m alone to ±10 %, k to ±10 %" in note


@pytest.mark.parametrize(
    ("units", "told"), [(("N/m", "kg"), "N"), (("ohm", "F"), "s"), (("", "kg"), "")]
)
def test_a_combination_has_its_unit(units: tuple[str, str], told: str) -> None:
    a = np.random.default_rng(0).standard_normal(300)
    s = Sensitivities(("R", "C"), np.array([3.0, 5.0]), np.column_stack([a, a]) * 20, units=units)
    (flat,) = practical(s).of("flat direction")
    assert "R*C = 15" in flat.text
    assert told in flat.text.partition("R*C = ")[2].partition(" (")[0]


def test_widths_in_words() -> None:
    assert within(1e4) == "nothing at all"
    assert "error / noise" in str(judge(material(record(white(1)))))
