"""A search that is stopped gives what was named before; without a step, what the model leaves."""

from __future__ import annotations

import signal
import threading
from dataclasses import replace
from pathlib import Path
from time import monotonic
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest

from bondgraph.support.deadline import SEARCHED, Deadline
from bondgraph.support.errors import UnusableInput
from identification.diagnosis.catalogue import CATALOGUE
from identification.diagnosis.diagnose import STOPPED_AT_ONCE, Diagnosis, diagnose
from identification.diagnosis.evidence.answer import Decision
from identification.diagnosis.evidence.hypotheses import Thresholds
from identification.diagnosis.evidence.nearest import Nearest
from identification.diagnosis.search import forward_selection, refining
from identification.diagnosis.search.candidates import DiagnosisOptions
from identification.diagnosis.search.forward_selection import NOT_AGAIN, Halted, not_again
from identification.diagnosis.search.refining import completed
from identification.diagnosis.verdict import read_verdict, sentence
from tests.identification.diagnosis.rubbing_spring import T, U, frame
from tests.patience import HANGS
from tests.settled import simulate
from tests.spring import spring


def step(number: int) -> Any:
    chosen = SimpleNamespace(fit=None, element=f"e{number}")
    return SimpleNamespace(kind="missing_physics", chosen=chosen)


@pytest.mark.parametrize("ends", [0, 1, 2])
def test_the_steps_before_are_kept(ends: int, monkeypatch: pytest.MonkeyPatch) -> None:
    def searched(_base: Any, _task: Any, number: int, _places: Any) -> int:
        if number == ends:
            raise KeyboardInterrupt
        return number

    monkeypatch.setattr(forward_selection, "searched", searched)
    monkeypatch.setattr(forward_selection, "decided", lambda number, task: step(number))
    monkeypatch.setattr(forward_selection, "base_of", lambda fit: fit)
    monkeypatch.setattr(forward_selection, "held_to_residual", lambda fit, given: fit)
    monkeypatch.setattr(forward_selection, "_in_its_valley", lambda *_: None)
    task: Any = SimpleNamespace(given=(), options=None)
    with pytest.raises(Halted) as stop:
        forward_selection._forward(SimpleNamespace(), task, 5)  # type: ignore[arg-type]
    assert [d.chosen.element for d in stop.value.decisions if d.chosen] == [
        f"e{i}" for i in range(ends)
    ]


def test_a_law_that_only_left_a_wrong_valley_of_the_repair_is_not_named(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The repair is fitted from where that law ended, and the step is searched anew beside it."""
    seen: list[tuple[int, str]] = []

    def searched(base: Any, _task: Any, number: int, _places: Any) -> str:
        seen.append((number, base.fit.name))
        return str(base.fit.name)

    def decided(base: str, _task: Any) -> Decision:
        if base == "deeper":
            return Decision("explained", None, (), (), 0.0, 0.0, ())
        fit = SimpleNamespace(name=f"after {base}", values={})
        chosen: Any = SimpleNamespace(fit=fit, element="d", insertion=None, home=True)
        return Decision("missing_physics", chosen, (), (), 1.0, 0.9, ())

    def deeper(fit: Any, _values: Any) -> Any:
        return SimpleNamespace(name="deeper") if fit.name == "after start" else None

    monkeypatch.setattr(forward_selection, "searched", searched)
    monkeypatch.setattr(forward_selection, "decided", decided)
    monkeypatch.setattr(forward_selection, "deeper", deeper)
    monkeypatch.setattr(
        forward_selection, "trial_of", lambda _i, _h, fit: SimpleNamespace(fit=fit, element="d")
    )
    monkeypatch.setattr(forward_selection, "base_of", lambda fit: SimpleNamespace(fit=fit))
    monkeypatch.setattr(forward_selection, "held_to_residual", lambda fit, given: fit)
    task: Any = SimpleNamespace(given=(), options=None)
    start: Any = SimpleNamespace(fit=SimpleNamespace(name="start"))
    first, last = forward_selection._forward(start, task, 4)
    assert seen == [(0, "start"), (1, "after start"), (1, "deeper")]
    assert first.chosen is not None
    assert first.chosen.fit.name == "deeper"  # type: ignore[attr-defined]
    assert last.kind == "explained"


def test_a_first_name_that_was_not_tried_again_has_no_probability() -> None:
    """A value that changes in time had stood for the friction that was named after it."""

    def named(answer: str, kind: str = "missing_physics") -> Decision:
        return Decision(kind, None, (), (), 0.0, 0.96, (), answer=answer)

    told = not_again([named("approximate"), named("exact")])
    assert [d.confidence for d in told] == [0.0, 0.96]
    assert told[0].reasons == (NOT_AGAIN,)
    sure = [named("exact"), named("approximate")]
    assert [d.confidence for d in not_again(sure)] == [0.96, 0.96]
    alone = [named("approximate"), named("unknown", "unknown_physics")]
    assert [d.confidence for d in not_again(alone)] == [0.96, 0.96]
    assert not_again([]) == []


def test_a_deadline_ends_the_search_and_not_what_is_written() -> None:
    said: list[str] = []
    late = Deadline(lambda text, part: said.append(text), -1.0)
    with pytest.raises(KeyboardInterrupt):
        late("searching", 0.5)
    late("writing", 0.95)
    Deadline(lambda text, part: said.append(text), None)("no limit", 0.5)
    assert said == ["searching", "writing", "no limit"]


def test_an_alarm_ends_what_says_nothing() -> None:
    before = signal.getsignal(signal.SIGALRM)
    late = Deadline(lambda text, part: None, monotonic() + 0.05)
    with pytest.raises(KeyboardInterrupt), late:
        threading.Event().wait(HANGS)
    assert late.over
    assert signal.getsignal(signal.SIGALRM) == before
    assert signal.getitimer(signal.ITIMER_REAL) == (0.0, 0.0)


def test_an_alarm_does_not_end_what_is_written() -> None:
    late = Deadline(lambda text, part: None, monotonic() + HANGS)
    with late:
        late("writing", 0.95)
        signal.raise_signal(signal.SIGALRM)
    assert not late.over


def test_in_another_thread_words_alone_look_at_the_clock() -> None:
    ended: list[bool] = []

    def work() -> None:
        with Deadline(lambda text, part: None, -1.0) as late:
            try:
                late("searching", 0.5)
            except KeyboardInterrupt:
                ended.append(late.over)

    thread = threading.Thread(target=work)
    thread.start()
    thread.join(HANGS)
    assert ended == [True]


def stopped_at(
    word: str, recorded: pd.DataFrame | None = None, time: float | None = None
) -> Diagnosis:
    def progress(text: str, fraction: float) -> None:
        if word in text and time is not None:
            signal.raise_signal(signal.SIGALRM)  # as if the time were over
        elif word in text:
            raise KeyboardInterrupt

    without = tuple(e.name for e in CATALOGUE if e.name != "coulomb_friction")
    options = DiagnosisOptions(jobs=1, effects=1, keep=1, more=0, without=without)
    recorded = frame() if recorded is None else recorded
    return diagnose(spring(), recorded, options=options, progress=progress, time=time)


@pytest.mark.parametrize("word", ["screening", "fitting coulomb"])
def test_without_a_step_it_says_what_the_model_leaves(word: str, tmp_path: Path) -> None:
    d = stopped_at(word)
    assert (d.kind, d.stopped) == ("unknown_physics", STOPPED_AT_ONCE)
    assert d.findings[0].chosen is None
    assert d.left is not None
    assert d.left.most > d.limits.noise
    assert d.left.words in str(d)
    left = f"leaves {d.left.most:.3g} times the noise, and why is not known yet"
    assert sentence(d).startswith("The search was stopped before its first step had ended: ")
    assert left in sentence(d)
    assert "is missing" not in sentence(d)
    assert "cannot name" not in sentence(d)
    assert bool(d.ranking) == (word != "screening")
    assert d.report(tmp_path).exists()
    found = read_verdict(tmp_path / "verdict.json")
    assert found["verdict"] == "unknown_physics"
    assert STOPPED_AT_ONCE in found["notes"]


def test_the_headline_says_what_comes_nearest() -> None:
    d = stopped_at("screening")
    near = (Nearest("F", "", "command", 0.43), Nearest("x", "sensor_lag", "", 0.31))
    said = sentence(replace(d, steps=(replace(d.steps[0], nearest=near),)))
    assert "nearest is a distortion of the command at F (43 % of the misfit)" in said
    assert "sensor lag" not in said


def test_noise_reassures_nobody_where_nothing_was_looked_for(tmp_path: Path) -> None:
    x = simulate(spring(), T, {"F": U})["x"] + 1e-5 * np.random.default_rng(2).standard_normal(1200)
    d = stopped_at("screening", frame().assign(**{"x[m]": x}))
    assert d.left is not None
    assert d.left.is_noise(d.limits.noise)
    assert (d.kind, d.findings, d.stopped) == ("insufficient_data", (), STOPPED_AT_ONCE)
    assert f"There is too little to go on: {STOPPED_AT_ONCE}" in str(d)
    assert d.report(tmp_path).exists()
    assert read_verdict(tmp_path / "verdict.json")["verdict"] == "insufficient_data"


def test_before_the_model_is_fitted_there_is_nothing_to_say() -> None:
    with pytest.raises(KeyboardInterrupt):
        stopped_at("as it is")


def test_a_time_ends_the_search_as_on_the_command_line() -> None:
    d = stopped_at("screening", time=HANGS)
    assert (d.kind, d.stopped) == ("unknown_physics", STOPPED_AT_ONCE)
    with pytest.raises(UnusableInput, match="were over before the model as it is had been fitted"):
        stopped_at("as it is", time=HANGS)
    with pytest.raises(UnusableInput, match=r"time = -1\.0: give the seconds"):
        stopped_at("screening", time=-1.0)


def test_a_repair_that_is_stopped_is_told_as_it_was_found(monkeypatch: pytest.MonkeyPatch) -> None:
    def refined(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(refining, "refined", refined)
    monkeypatch.setattr(refining, "unthinned", lambda decisions, *_: decisions)
    said: list[float] = []
    found: Any = (step(0),)
    task: Any = SimpleNamespace(holds=())
    told = completed(found, task, task, Thresholds(), lambda text, part: said.append(part))
    assert told == (found, True)
    assert said[0] < SEARCHED <= said[-1]
