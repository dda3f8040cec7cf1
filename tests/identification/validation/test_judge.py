"""Each known fault is said, nothing else is, and noise alone is left in peace."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bondgraph.support.errors import UnusableInput
from identification.diagnosis.explanation.colour import colour_notes
from identification.statistics.whiteness import EITHER
from identification.uncertainty.finding import Finding
from identification.validation import Judgement, Number, judge
from identification.validation.report.sections import words

from .made import coloured, material, record

N = 3000


def white(seed: int, n: int = N) -> np.ndarray:
    return np.random.default_rng(seed).standard_normal(n)


def faults(j: Judgement) -> str:
    return "\n".join(f"{r.text} | {r.advice}" for r in j.faults)


def test_noise_alone_is_acceptable_in_nearly_all_trials() -> None:
    found = []
    for seed in range(60):
        u = coloured(np.random.default_rng(1000 + seed), 1200, 0.9)
        number = Number("k", 2.0, "N/m", (1.9, 2.1))
        found.append(judge(material(record(white(seed, 1200), inputs={"F": u}), numbers=(number,))))
    assert np.mean([j.acceptable for j in found]) >= 0.85
    j = next(j for j in found if j.acceptable)
    text = str(j)
    assert text.startswith("plant: nothing to object to")
    assert "at the floor" in text
    assert "is white" in text
    assert "independent of F" in text
    assert "every parameter is determined" in text


def test_a_residual_above_the_floor_is_a_fault() -> None:
    j = judge(material(record(3 * white(1))))
    assert "3 times the floor" in faults(j) or "2.9" in faults(j) or "3.0" in faults(j)
    assert not j.acceptable


def test_a_floor_stated_too_high_is_said() -> None:
    j = judge(material(record(white(2), floor=1.5)))
    assert j.acceptable
    assert any("the floor is stated too high" in r.advice for r in j.notes)


@pytest.mark.parametrize(("floor", "clears"), [(1.6, True), (8.0, False)])
def test_a_floor_far_above_all_that_is_left_was_misread_and_clears_nothing(
    floor: float, clears: bool
) -> None:
    """Read off a command with steps it hid a branch of eddy currents in a coil."""
    u = coloured(np.random.default_rng(7), N, 0.5)
    missing = white(8) + 0.4 * u
    j = judge(material(record(missing, inputs={"F": u}, floor=floor)))
    assert j.acceptable is clears
    assert ("residual follows F" in faults(j)) is not clears
    said = "\n".join(r.text for r in j.notes)
    assert ("was read too high" in said) is not clears
    quiet = judge(material(record(white(8), inputs={"F": u}, floor=floor)))
    assert quiet.acceptable
    memory = coloured(np.random.default_rng(4), N, 0.9)
    assert judge(material(record(memory, floor=8.0 * float(memory.std())))).acceptable


def test_white_noise_a_little_above_an_estimated_floor_is_a_note() -> None:
    j = judge(material(record(1.15 * white(2))))
    assert j.acceptable
    assert any("noise a little above the floor" in r.text for r in j.notes)
    assert not judge(material(record(1.15 * coloured(np.random.default_rng(2), N, 0.5)))).acceptable


def test_a_record_that_is_only_judged_has_its_held_out_residual_tested() -> None:
    e = coloured(np.random.default_rng(2), N, 0.9)
    assert "the held-out residual is coloured" in faults(judge(material(record(e, held=1.0))))


def test_a_worse_held_out_part_is_said() -> None:
    r = white(3)
    r[2000:] *= 2.5
    assert "held-out error is 2.6 times that" in faults(judge(material(record(r))))


def test_colour_above_the_floor_is_a_fault_and_below_it_a_note() -> None:
    e = coloured(np.random.default_rng(4), N, 0.9)
    above = judge(material(record(e)))
    assert "coloured up to lag" in faults(above)
    below = judge(material(record(e, floor=float(e.std()))))
    (said,) = (r for r in below.notes if EITHER in r.text)
    assert said.advice.startswith("noise='coloured', which fits the colour too (")
    # a diagnosis says so of the same residuals: their intervals need not be made anew
    left = SimpleNamespace(
        readings=e[:, None], mask=lambda _: np.ones(N, bool), names=("x",), dt=0.01,
        floor=np.array([float(e.std())]),
    )  # fmt: skip
    last: Any = SimpleNamespace(
        problem=SimpleNamespace(data=left), simulated=np.zeros((N, 1)),
        residuals=lambda _: e[:, None],
    )  # fmt: skip
    (note,) = colour_notes(last)
    assert EITHER in note
    allowed = "allow for such noise, but not for a law that is slightly wrong"
    assert allowed in note
    assert allowed in said.advice


def test_a_noise_model_that_whitens_is_judged_by_its_innovations() -> None:
    rng = np.random.default_rng(5)
    e, u = coloured(rng, N, 0.9), coloured(rng, N, 0.9)
    model = (np.array([1.0, -0.9]),)
    j = judge(material(record(e, whitening=model, inputs={"F": u})))
    assert j.channels[0].white is not None
    assert j.channels[0].white.white
    assert "but coloured noise" in "\n".join(r.text for r in j.notes)
    assert j.criteria is not None
    assert j.criteria.effective == pytest.approx(2000, rel=0.1)


def test_a_delay_is_measured() -> None:
    t = np.arange(N) * 0.01
    s = 10 * np.sin(5 * t)
    r = 10 * np.sin(5 * (t - 0.008)) - s + 0.1 * white(6)
    j = judge(material(record(r, simulated=s, floor=0.1)))
    assert j.channels[0].timing is not None
    assert j.channels[0].timing.delay == pytest.approx(0.008, rel=0.05)
    assert "samples) later than the model" in faults(j)


def test_parameters_that_the_data_do_not_determine_are_named() -> None:
    numbers = (
        Number("m", 1.0, "kg", (0.99, 1.01)),
        Number("d", 1.0, "N*s/m", (0.01, 40.0)),
        Number("k", 9.0, "N/m", (8.9, 9.1), at_bound=True),
    )
    m = material(record(white(7)), numbers=numbers)
    correlation = np.eye(3)
    correlation[0, 2] = correlation[2, 0] = 0.9995
    j = judge(replace(m, correlation=correlation))
    assert "do not determine d" in faults(j)
    assert "k = 9 N/m lies at its bound" in faults(j)
    assert "m, " not in faults(j)
    assert any("m and k trade off" in r.text and "ratio" in r.text for r in j.notes)


def test_a_fit_that_did_not_converge_is_said_first() -> None:
    j = judge(replace(material(record(white(8))), status="stopped at the largest number"))
    assert "did not converge" in j.faults[0].text


def test_what_is_found_after_a_fit_is_a_fault_and_units_come_first() -> None:
    j = judge(material(record(white(8))))
    assert j.acceptable
    found = [
        Finding("not pinned", "d lies anywhere", "s, d", "too wide", "fix it"),
        Finding("unit", "m is 1000 times the declared value", "s, m", "mostly a unit", "check"),
        Finding("unit", "k is 1000 times the declared value", "s, k", "mostly a unit", "check"),
    ]
    told = j.with_findings(found)
    assert not told.acceptable
    assert told.faults[0].text.startswith("unit: m is 1000 times")
    assert "k is 1000 times" in told.faults[0].text
    assert "not pinned: d lies anywhere" in faults(told)
    assert j.with_findings(()).acceptable


def test_far_above_the_noise_one_fault_leads_and_the_others_are_counted() -> None:
    numbers = (Number("d", 1.0, "N*s/m", (0.01, 40.0)), Number("k", 9.0, "N/m", (0.01, 90.0)))
    m = replace(material(record(8.0 * white(8)), numbers=numbers, n_free=6), states=2)
    j = judge(m)
    (first,) = j.leading
    assert first.text.startswith("the fit ended far above the noise, 8.29 times that of x: ")
    assert "many_starts(study, 32)" in first.advice
    assert j.faults[0] is first
    assert "do not determine d" in faults(j)
    text = str(j)
    assert text.startswith("plant: far above the noise")
    assert "do not determine" not in text
    assert f"{len(j.faults) - 1} more that most likely come of it" in text
    assert "do not determine d" in words(j)  # the report lists all
    near = judge(replace(m, records=(record(4.0 * white(8)),)))
    assert near.leading == near.faults
    assert "do not determine d" in str(near)


def test_far_above_the_noise_no_input_is_cleared() -> None:
    drive = coloured(np.random.default_rng(3), N, 0.9)
    near = judge(material(record(white(8), inputs={"F": drive})))
    assert any("no effect of F is missing" in r.text for r in near.fine)
    for size in (3.0, 30.0):
        far = judge(material(record(size * white(8), inputs={"F": drive})))
        assert "no effect of F" not in str(far)
        assert any("not judged whether an effect of F is missing" in r.text for r in far.notes)
    # what the fit lacks stands beside the valley, not behind it
    assert "either the model lacks something, or" in faults(far)


def test_a_pair_is_told_once_and_not_where_each_is_known_well() -> None:
    tied = np.array([[1.0, -0.998], [-0.998, 1.0]])
    ends = ((7.3994, 7.4014), (3.596, 3.6013))
    numbers = (Number("Bl", 7.4, "N/A", ends[0]), Number("d", 3.6, "N*s/m", ends[1]))
    m = material(record(white(7)), numbers=numbers)
    assert "trade off" not in str(judge(replace(m, correlation=tied)))
    wide = tuple(replace(n, ci95=(0.8 * n.value, 1.2 * n.value)) for n in numbers)
    j = judge(replace(m, numbers=wide, correlation=tied))
    assert "d and Bl trade off" in str(j) or "Bl and d trade off" in str(j)
    pair = Finding("trade-off pair", "Bl and d go together", "s, Bl, d", "it hides", "record")
    told = str(j.with_findings((pair,)))
    assert "Bl and d go together" in told
    assert "trade off" not in told


def test_what_was_fitted_is_told_by_sort() -> None:
    numbers = (Number("k", 9.0, "N/m", (8.9, 9.1)),)
    m = replace(material(record(white(8)), numbers=numbers, n_free=5), states=2)
    assert (
        "1 value of the model and its laws, 2 initial states, 2 offsets, lags and the like of the "
        "readings and 1 noise level"
    ) in str(judge(m))


def test_nothing_held_out_is_said() -> None:
    j = judge(material(record(white(9), held=0.0)))
    assert any("nothing is held out" in r.text for r in j.notes)


def test_html_escapes_every_name() -> None:
    j = judge(material(record(white(10), name="<script>alert(1)</script>")))
    page = j._repr_html_()
    assert "<script>" not in page
    assert "&lt;script&gt;" in page


def test_a_periodic_drive_tells_distortion_from_missing_dynamics() -> None:
    n, periods = 400, 6
    t = np.arange(n * periods)
    lines = np.array([1, 3, 7, 9, 13, 15])
    phase = np.random.default_rng(1).uniform(0, 6.28, lines.size)
    u = np.sum(np.cos(2 * np.pi * lines[:, None] * t / n + phase[:, None]), axis=0)
    noise = 1e-3 * white(11, u.size)

    def judged(left: np.ndarray) -> Judgement:
        r = record(left + noise, simulated=u, inputs={"F": u}, floor=1e-3)
        return judge(material(r))

    assert "odd distortion" in faults(judged(0.01 * u**3))
    assert "the plant distorts" in faults(judged(0.01 * u**3))
    linear = judged(0.05 * np.roll(u, 20))
    assert "without distortion" in faults(linear)
    clean = judged(np.zeros(u.size))
    assert any("none beyond the noise" in r.text for r in clean.fine)


def test_what_is_no_fit_is_refused() -> None:
    with pytest.raises(UnusableInput, match="dict is no fit"):
        judge({})  # type: ignore[arg-type]
    with pytest.raises(UnusableInput, match="no simulated sample"):
        judge(material(record(np.full(100, np.nan))))
    with pytest.raises(UnusableInput, match="two records are called 'run'"):
        material(record(white(1)), record(white(2)))
    with pytest.raises(UnusableInput, match="noise floor"):
        record(white(1), floor=0.0)


@pytest.mark.parametrize(
    ("unit", "said"), [("N", "their sum"), ("m", "one combination of the two")]
)
def test_only_numbers_of_one_unit_are_added(unit: str, said: str) -> None:
    numbers = (Number("F_0", -2.0, "N", (-2.1, -1.9)), Number("b", 1.0, unit, (0.9, 1.1)))
    tied = np.array([[1.0, -0.999], [-0.999, 1.0]])
    j = judge(replace(material(record(white(7)), numbers=numbers), correlation=tied))
    (note,) = (r.text for r in j.notes if "trade off" in r.text)
    assert said in note
