"""What a reader is told of a verdict: one measure, a law with its numbers, the way there."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter

from bondgraph.graph.elements import Se
from bondgraph.signals.recording import Split
from bondgraph.support.errors import UnknownName
from bondsight.cli.main import main
from identification.diagnosis.catalogue import CATALOGUE
from identification.diagnosis.catalogue.places import law_of
from identification.diagnosis.catalogue.words import briefly, described, formula, parameters
from identification.diagnosis.diagnose import Diagnosis
from identification.diagnosis.evidence.block_score import BlockScore
from identification.diagnosis.evidence.judged import judged_on
from identification.diagnosis.evidence.kind_score import KindScore
from identification.diagnosis.evidence.leave_out import LeftOut, Rows
from identification.diagnosis.explanation.colour import (
    COLOURED,
    colour_notes,
    coloured,
    too_narrow,
)
from identification.diagnosis.explanation.law_formula import in_symbols, meaning_of
from identification.diagnosis.report.sections import beside
from identification.diagnosis.screening.undoing import Mixup
from identification.diagnosis.search.candidates import Candidate
from identification.diagnosis.studio import page
from identification.diagnosis.verdict import (
    normalised_error,
    parse_verdict,
    retold,
    sentence,
    verdict,
)
from identification.estimation.single_record import Fit
from identification.study.driven import STANDS
from tests.identification.diagnosis import rubbing_spring
from tests.identification.diagnosis.effect_plants import scene

JARGON = ("Laws still in the set", "Bonds widen", "(z ", "z = ", "times the floor", "mean square")


@pytest.fixture(scope="module")
def found() -> Diagnosis:
    return rubbing_spring.diagnosed()


def named(d: Diagnosis) -> Candidate:
    (step,) = d.findings
    assert step.chosen is not None
    return step.chosen


def test_the_law_is_a_formula_and_its_numbers_have_a_meaning(found: Diagnosis) -> None:
    law = "force of d = F_c_d*sign(v) + d*v, where v is the velocity of d"
    assert in_symbols(named(found)) == law
    words = str(found)
    assert f"  law: {law}" in words
    assert "N  [" in words
    assert "]  friction level, the same at every speed" in words
    (f,) = verdict(found)["findings"]
    assert f["formula"] == law
    assert [p["meaning"] for p in f["parameters"]] == ["friction level, the same at every speed"]


@pytest.mark.parametrize("plant", ["diagnosed", "mechanical", "hydraulic", "electrical"])
def test_every_parameter_of_every_effect_says_what_it_is(plant: str, found: Diagnosis) -> None:
    seen = found.scene if plant == "diagnosed" else scene(plant)  # only that has sources' pasts
    assert seen is not None
    for effect in CATALOGUE:
        for element in [e for e in effect.places(seen.graph) if e.name in seen.past][:2]:
            made = effect.insert(seen, element)
            values = {n: p.value for n, p in made.graph.parameters.items()}
            fit: Any = SimpleNamespace(problem=SimpleNamespace(graph=made.graph), values=values)
            trial = Candidate(made, True, fit, 1.0, 1.0, np.ones(1))
            assert in_symbols(trial), effect.name
            new = [n for n in made.graph.parameters if n not in seen.graph.parameters]
            assert all(meaning_of(n, trial) for n in new), (effect.name, new)
            held = made.graph.elements.get(element.name)
            law = None if held is None else law_of(held)
            if law is not None:
                assert type(getattr(law, "inner", law)) in effect.laws, effect.name


@pytest.mark.parametrize("effect", CATALOGUE, ids=lambda e: e.name)
def test_the_catalogue_tells_the_law_and_what_its_numbers_are(effect: object) -> None:
    assert formula(effect)  # type: ignore[arg-type]
    text = described(effect.name)  # type: ignore[attr-defined]
    assert "``" not in text
    for name, meaning in parameters(effect):  # type: ignore[arg-type]
        assert f"  {name}: {meaning}" in text


def test_a_friction_is_told_in_its_own_formula() -> None:
    text = described("stribeck_friction")
    assert "(F_c + F_d exp(-(f/f_s)^2)) sign(f)" in text
    assert described("stribeck") == text  # what a verdict calls its law
    assert "    F_d: by how much the level at rest is higher (in N, say)" in text


def test_every_name_that_is_printed_is_described() -> None:
    for e in CATALOGUE:
        for name in (e.name, e.law, *e.richer, *(law.name for law in e.laws)):
            text = described(name)
            assert f"{e.name} (" in text or name in {other.name for other in CATALOGUE}, name
            assert described(name.replace("_", " ")) == text
    assert described("backlash_with_damper") == described("backlash")
    assert described("unknown").startswith("unknown (")
    with pytest.raises(UnknownName, match="backlash_with_damper"):
        described("backlash_with_dampr")


def test_a_long_list_is_cut_in_words_and_whole_in_the_data(found: Diagnosis) -> None:
    many = [f"creep at k_{n}" for n in range(28)]
    (first,) = found.steps
    long = replace(first, reasons=(f"these do as well: {', '.join(many)}",))
    d = replace(found, steps=(long,))
    for text in (str(d), " ".join(retold(parse_verdict(json.dumps(verdict(d)))).split()), page(d)):
        assert "creep at k_2 and 25 more (all in verdict.json)" in text
        assert "k_3" not in text
    assert all(label in json.dumps(verdict(d)) for label in many)
    assert (
        briefly("held-out samples refute a at b, c at d")
        == "held-out samples refute a at b, c at d"
    )


def test_a_second_step_says_so_and_a_kind_is_told_in_words(found: Diagnosis) -> None:
    (first,) = found.steps
    score = KindScore("k", "surface", None, np.zeros(1))  # type: ignore[arg-type]
    assert score.label == "an effort that depends on displacement and flow together at k"
    more = replace(
        first, kind="unknown_physics", reasons=(f"{score.label} explains little of the misfit",)
    )
    told = str(replace(found, steps=(first, more), left=None))
    assert f"second step: {score.label} explains little" in told
    assert "second step: something more is missing, and these data do not tell its name" in told
    assert not [w for w in ("step 2", "surface", "may not be named") if w in told]


def test_what_comes_next_is_told_without_names_of_the_catalogue(found: Diagnosis) -> None:
    d = replace(found, advice=("a step: tells coulomb_friction at d from creep at k",))
    for text in (str(d), retold(parse_verdict(json.dumps(verdict(d))))):
        assert "a step: tells coulomb friction at d from creep at k" in text


def test_what_many_recordings_say_alike_is_told_once(found: Diagnosis) -> None:
    notes = (*(f"run {n}: every third sample is kept" for n in range(48)), "held out: the last")
    names = " + ".join(f"run {n}" for n in range(48))
    d = replace(
        found, kind="explained", notes=notes, recording=replace(found.recording, name=names)
    )
    for text in (str(d), " ".join(retold(parse_verdict(json.dumps(verdict(d)))).split())):
        assert "run 0 and 47 more: every third sample is kept" in text
        assert "run 0 + run 1 and 46 more" in text
        assert "run 2" not in text
    assert verdict(d)["notes"] == list(notes)


def test_a_percentage_does_not_depend_on_which_stretches_were_held_out(found: Diagnosis) -> None:
    """Little moves in some stretches: their own spread made a small error of them a large one."""
    assert found.nominal is not None
    fit, data = found.nominal, found.nominal.problem.data
    n, whole = data.n, np.std(data.readings[:, 0])
    for part in (slice(0, n // 4), slice(n // 2, n)):
        rest = tuple(s for s in (slice(0, part.start), slice(part.stop, n)) if s.stop > s.start)
        judged = judged_on(fit, Split(rest, part, "a part"))
        assert normalised_error(judged)["x"] == pytest.approx(judged.rmse("test")["x"] / whole)


def with_residuals(made: Fit, left: np.ndarray) -> Fit:
    return replace(made, simulated=made.problem.data.readings - left[:, None])


def test_a_command_that_stands_still_comes_before_what_is_said_of_the_file_as_it_is(
    found: Diagnosis,
) -> None:
    note = f"input F is 2 in all 1200 samples: {STANDS}"
    said = sentence(replace(found, kind="unknown_physics", notes=(note,)))
    assert said.startswith(f"First check the recording: {note}. Taken as it is: ")
    assert "First check" not in sentence(replace(found, notes=(note,)))
    pulled = found.graph.with_branch(found.graph.neighbour("F"), [Se("F_2", unit="N")])
    two = replace(found, kind="unknown_physics", notes=(note,), graph=pulled)
    assert "First check" not in sentence(two)  # the other one moves


def test_a_law_as_good_as_any_form_beside_a_rest_is_not_called_near(found: Diagnosis) -> None:
    def said(fit: float) -> str:
        steps = (replace(found.steps[0], answer="approximate", law_fit=fit), *found.steps[1:])
        return sentence(replace(found, steps=steps))

    assert "no freer form does better there, but more than noise is left" in said(0.999)
    assert "the law fits to 95 %: near, not exact" in said(0.95)


def test_no_form_is_called_best_where_a_later_step_found_a_better_one(found: Diagnosis) -> None:
    first = replace(found.steps[0], answer="approximate", law_fit=0.999)
    score = BlockScore(LeftOut(Rows(*(np.zeros(3, int),) * 3), *(np.zeros(3),) * 3))

    def said(element: str) -> str:
        better = KindScore(element, "surface", score, np.zeros(3))
        later = replace(
            first, kind="unknown_physics", answer="unknown", chosen=None, kinds=(better,)
        )
        return sentence(replace(found, steps=(first, later)))

    assert "no freer form does better there, but more than noise is left" in said("k")
    assert "(a loss that depends on the velocity, explains all of the misfit; more than" in said(
        "d"
    )


def test_residuals_with_a_memory_are_told_beside_the_answer(found: Diagnosis) -> None:
    assert found.repaired is not None
    data = found.repaired.problem.data
    white = data.floor[0] * np.random.default_rng(2).standard_normal(data.n)
    slow = lfilter([0.8], [1.0, -0.6], white)
    assert colour_notes(with_residuals(found.repaired, 10.0 * slow)) == ()  # that is no noise
    (narrow,) = too_narrow(with_residuals(found.repaired, 10.0 * slow))
    assert "times the noise of x" in narrow
    assert "are too narrow then" in narrow
    assert too_narrow(with_residuals(found.repaired, slow)) == ()
    assert coloured(with_residuals(found.repaired, white)) == {}
    assert colour_notes(with_residuals(found.repaired, white)) == ()
    share = coloured(with_residuals(found.repaired, slow))["x"]
    assert 0.25 < share < 0.45  # 0.36 of an autoregression with 0.6
    assert colour_notes(with_residuals(found.repaired, 0.05 * slow)) == ()  # far below the noise
    (note,) = colour_notes(with_residuals(found.repaired, slow))
    assert note.startswith(COLOURED)
    assert "The 95 % intervals allow for such noise" in note
    told = str(replace(found, notes=(note, *found.notes))).splitlines()
    assert told[2] == f"{note[0].upper()}{note[1:]}."
    assert sum(COLOURED[1:] in line for line in told) == 1
    shown = page(replace(found, notes=(note, *found.notes)))
    assert f'<div class="callout"><ul><li>{told[2]}</li></ul></div>' in "".join(shown.split("\n"))
    assert beside(found) == ""


def test_the_verdict_is_told_without_words_of_the_house(found: Diagnosis) -> None:
    for text in (str(found), retold(parse_verdict(json.dumps(verdict(found))))):
        assert not [w for w in JARGON if w in text]


def test_a_folder_is_explained_with_the_way_to_the_answer(
    found: Diagnosis, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    found.report(tmp_path)
    assert main(["explain", str(tmp_path)]) == 0
    text = " ".join(capsys.readouterr().out.split())
    for words in (
        "What in the recording led there",
        f"Without what was found, {verdict(found)['regions'][0]}.",
        "What coulomb friction looks like as a rule: flat tops where the motion turns",
        "What was tried, and how far behind it was",
        "- coulomb friction at d leaves 1",
        "standard errors behind",
        "In symbols: force of d = F_c_d*sign(v) + d*v",
    ):
        assert words in text, words
    assert str(found).splitlines()[0] not in text


def test_a_verdict_of_before_is_explained_too(found: Diagnosis) -> None:
    old = verdict(found)
    for key in ("regions", "steps"):
        del old[key]
    for f in old["findings"]:
        del f["formula"]
        for p in f["parameters"]:
            del p["meaning"]
    text = retold(parse_verdict(json.dumps(old)))
    assert "What was found" in text
    assert "What was tried" not in text


@pytest.mark.parametrize(("after", "more"), [(57.0**2, True), (1.1, False)])
def test_what_an_undone_mistake_gains_is_a_plain_sentence(after: float, more: bool) -> None:
    said = replace(Mixup("sign", ("x",)), before=16800.0**2, after=after).undoing
    left = "57" if more else "1"
    assert said.startswith(
        f"with that undone the model misses all readings together by {left} times the noise, not "
        "by 17 thousand times, on held-out samples"
    )
    assert said.endswith("once the file is mended") == more
