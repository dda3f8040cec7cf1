"""Where no name is given: the fitted values, what they are worth, and one thing to do next."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from bondgraph import BondGraph, C, Dq, I, One, R, Reading, Se, Zero, effort
from identification.diagnosis.catalogue import CATALOGUE
from identification.diagnosis.diagnose import Diagnosis
from identification.diagnosis.evidence.nearest import Nearest
from identification.diagnosis.explanation.advice import ANYTHING, advice
from identification.diagnosis.explanation.next_step import PROBES, _separated, junction_signal
from identification.diagnosis.localisation.recording.region import Region
from identification.diagnosis.report.evidence import parameters
from identification.diagnosis.screening.flexible_forms import KINDS
from identification.diagnosis.verdict import in_words, retold, verdict
from tests.identification.diagnosis.rubbing_spring import diagnosed


def untold(**step: Any) -> Diagnosis:
    """The rubbing spring, were its friction no law that the catalogue has."""
    found = diagnosed()
    at = {"kind": "unknown_physics", "answer": "kind", "physics": "dissipative", "places": ("d",)}
    told = replace(found.steps[0], **{**at, "chosen": None, "share": 0.0, **step})
    d = replace(found, kind="unknown_physics", steps=(told,), regions=(), experiments=())
    return replace(d, advice=advice(d, np.array([1.0])))


def test_values_stand_with_their_intervals_and_with_what_they_are_worth() -> None:
    d = untold()
    assert d.left is not None
    assert d.nominal is not None
    d = replace(d, left=replace(d.left, over_noise={"x": 57.0}))
    head, row = "values of the model as it is, which leaves 57 times the noise", "m       "
    said = in_words(d).splitlines()
    (at,) = [i for i, line in enumerate(said) if line.startswith(head)]
    assert "their intervals do not say by how much" in said[at]
    assert said[at + 1].split() == ["fitted", "value", "95", "%", "interval", "declared"]
    assert said[at + 2].startswith(row)
    assert head.capitalize() in parameters(d)
    again = " ".join(retold(verdict(d)).split())
    assert "Fitted to the model as it is, bent by what is missing: m = " in again
    assert head not in in_words(diagnosed())  # beside a repair they are those of the repair


def test_a_kind_without_a_law_is_followed_by_the_experiment_that_shows_it() -> None:
    (told,) = untold().advice
    assert told == f"to see what is missing at d: {PROBES['dissipative']}"
    assert set(PROBES) == set(KINDS)


def test_a_law_that_comes_close_brings_its_own_experiment() -> None:
    close = diagnosed().steps[0].chosen
    (told,) = untold(chosen=close, share=0.9).advice
    assert told.startswith("to see whether it is coulomb_friction at d: constant slow speeds")
    (told,) = untold(chosen=close, share=0.9, physics="time").advice  # a law of another kind
    assert told == f"to see what is missing at d: {PROBES['time']}"
    (told,) = untold(
        answer="unknown", places=(), nearest=(Nearest("F", "low_pass", "", 0.4),)
    ).advice
    assert told.startswith("to see whether low_pass at F is part of it: a multisine")


@pytest.mark.parametrize("turned", [False, True])
def test_what_separates_a_pair_speaks_of_that_pair(turned: bool) -> None:
    """A lag of the drive was told from one of the sensor by what tells it from a delay."""

    def said(*pair: str) -> str:
        return _separated(*(pair[::-1] if turned else pair))

    assert "delay" not in said("low_pass", "sensor_lag")
    assert "record what the drive really puts out" in said("low_pass", "sensor_lag")
    assert said("low_pass", "delay").endswith("a lag falls in gain, a delay does not")
    assert "sensor" not in said("low_pass", "delay")
    assert "drive" not in said("sensor_lag", "delay")
    assert "half the amplitude" in said("low_pass", "slew_limit")
    known = {e.name for e in CATALOGUE}
    assert all({*e.from_one} <= known & {*e.confused_with} for e in CATALOGUE)


def test_a_signal_that_nobody_reads_at_the_place_is_told() -> None:
    with BondGraph("rod") as rod:
        load, pushed = One("load"), Se("F", unit="N")
        pushed >> load >> I("m", 0.5, unit="kg")
        node, body = Zero("node"), One("body")
        load >> node >> C("k", stiffness=200.0, unit="N/m")
        node >> body >> R("d", 2.0, unit="N*s/m")
        load >> Dq("x", unit="m")
        Reading("force", effort("k"), unit="N")  # of no junction: it has no bond
    d = replace(untold(), graph=rod)
    says = "measure the velocity v (the flow at body) too: it shows d by itself"
    assert says in advice(d, np.array([1.0]))
    assert junction_signal(rod, "e_node") == "the force (the effort at node)"
    step = replace(d.steps[0], places=("m",))  # its speed is that of x
    assert not any("measure" in a for a in advice(replace(d, steps=(step,)), np.array([1.0])))


@pytest.mark.parametrize("band", [True, False])
def test_without_a_place_the_drive_dwells_where_the_model_fails(band: bool) -> None:
    d = untold(answer="unknown", places=())
    worst = Region("frequency", 2.0, 5.0, 0.9, 9.0, "Hz", "x", "frequency")
    d = replace(d, regions=(worst,) if band else ())
    (told,) = advice(d, np.array([1.0]))
    if band:
        assert "a sine of F swept slowly over 2.0 … 5.0 Hz, where x misses most" in told
    else:
        assert told == ANYTHING[0]
