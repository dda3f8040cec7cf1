"""What a repair takes to be the measuring chain's is shown, and a gain is told as a number."""

from __future__ import annotations

import json

import numpy as np
import pytest

from bondgraph.signals.recording import Recording
from identification.diagnosis.catalogue import CATALOGUE
from identification.diagnosis.diagnose import Diagnosis, diagnose
from identification.diagnosis.report.evidence import parameters
from identification.diagnosis.report.sections import beside
from identification.diagnosis.search.candidates import DiagnosisOptions
from identification.diagnosis.verdict import in_words, parse_verdict, retold, sentence, verdict
from identification.estimation.estimates import Estimate
from identification.estimation.leaning import Leaning, leaning_words, made_up_for
from tests.identification.diagnosis import dragged_spring
from tests.identification.diagnosis.rubbing_spring import T, U
from tests.settled import simulate
from tests.spring import spring


def misread(gain: float) -> Diagnosis:
    draw, seen = np.random.default_rng(1), simulate(spring(speed="v"), T, {"F": U})
    x = gain * np.asarray(seen["x"]) + 1e-5 * draw.standard_normal(T.size)
    v = np.asarray(seen["v"]) + 1e-4 * draw.standard_normal(T.size)
    run = Recording.from_arrays("run", {"t[s]": T, "F[N]": U, "x[m]": x, "v[m/s]": v})
    others = tuple(e.name for e in CATALOGUE if e.name != "sensor_gain")
    options = DiagnosisOptions(jobs=1, effects=1, keep=4, more=0, without=others)
    return diagnose(spring(speed="v"), run, options=options, noise={"x": 1e-5, "v": 1e-4})


@pytest.mark.parametrize("offset", [1.5e-5, 0.0])
def test_an_offset_that_the_fit_leans_on_is_shown(offset: float) -> None:
    found = dragged_spring.diagnosed(offset)
    assert found.kind == "missing_physics"
    document = parse_verdict(json.dumps(verdict(found)))
    nuisances = {n["name"]: n for n in document["nuisances"]}
    own = nuisances["offset x"]
    assert own["ci95"][0] < offset < own["ci95"][1]
    said = [text for n in found.leanings if (text := str(n)).startswith("offset x = ")]
    if not offset:
        assert not said
        assert "leans on offset x" not in in_words(found)
        return
    (text,) = said
    assert text.endswith(f"which moves x by {own['over_noise']:.2g} times its noise")
    assert own["over_noise"] == pytest.approx(offset / dragged_spring.NOISE, rel=0.2)
    assert f"the fit leans on {text}" in in_words(found)
    assert f"leans on {text}" in " ".join(retold(document).split())
    assert "leans on offset x" in beside(found)
    assert "times its noise" in parameters(found)


@pytest.mark.parametrize(("kelvin", "ambient"), [(21.7, True), (0.4, False)])
def test_the_ambient_of_a_temperature_is_nothing_that_a_fit_leans_on(
    kelvin: float, ambient: bool
) -> None:
    offset = Estimate("offset T1", kelvin, "K", (kelvin - 0.1, kelvin + 0.1))
    text = str(leaning := Leaning(offset, "T1", 700.0))
    assert leaning.is_ambient == ambient
    said = leaning_words(text)
    if ambient:
        assert said.startswith(f"offset T1 = {kelvin} K (95 %: ")
        assert said.endswith("the model's zero lies on the scale of T1: the ambient of an "
                             "absolute reading")  # fmt: skip
    else:
        assert said.startswith("the fit leans on offset T1 = ")
        assert said.endswith("which moves T1 by 7e+02 times its noise")


def test_what_moves_a_reading_by_less_than_its_noise_is_nothing_to_lean_on() -> None:
    offset = Estimate("offset x", 3e-6, "m", (2e-6, 4e-6))
    said = leaning_words(str(Leaning(offset, "x", 0.33)))
    assert said.startswith("offset x = 3 µm")
    assert said.endswith("which moves x by 0.33 times its noise: little")


@pytest.mark.parametrize(("half", "open_one"), [(0.48, True), (1e-5, False)])
def test_nothing_leans_on_an_offset_that_a_start_makes_up_for(half: float, open_one: bool) -> None:
    """Where a position integrates, its offset and where it starts are one number."""
    assert made_up_for(Estimate("offset x", -8.6e-7, "m", (-half, half))) is open_one


def test_the_gain_of_a_sensor_is_a_number() -> None:
    found = misread(0.905)
    (step,) = found.findings
    assert step.chosen is not None
    place = step.chosen.element
    gain = {"x": "0.905", "v": "1.105"}[place]
    assert f"its gain is {gain}" in sentence(found)
    (told,) = verdict(found)["findings"]
    assert told["formula"].startswith(f"reading of {place} = {gain}*s")
    assert told["parameters"][0]["meaning"].endswith(f"the gain is {gain}")
    assert f"the gain is {gain}" in in_words(found)
