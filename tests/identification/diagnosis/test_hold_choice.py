"""How the commands behave between samples: what is said of it goes with what was chosen."""

from __future__ import annotations

import re
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bondgraph.signals.recording import Recording
from bondgraph.signals.split import interleaved
from identification.diagnosis import diagnose as whole
from identification.diagnosis.evidence.answer import Decision
from identification.diagnosis.evidence.hypotheses import Thresholds
from identification.diagnosis.screening.flexible_forms import flexible_forms
from identification.diagnosis.screening.port_history import PortHistory
from identification.diagnosis.search.asked import asked_of
from identification.diagnosis.search.base import unthinned
from identification.diagnosis.search.candidates import trial_of
from identification.diagnosis.search.hold_choice import hold_margin, with_best_hold
from identification.diagnosis.search.material import material_of
from identification.diagnosis.search.nominal import nominal_fit
from identification.estimation.single_record import Fit
from identification.study.data import Data
from identification.study.problem import Problem
from tests.identification.diagnosis.test_nominal import DT, cart
from tests.settled import simulate

BOTH = ("hold", "linear")


def recorded(hold: str, noise: float, n: int = 1500, floor: float | None = None) -> Data:
    """A cart on a spring under random steps, taken as `hold` between samples."""
    rng = np.random.default_rng(0)
    t = np.asarray(DT * np.arange(n), np.float64)
    u = np.repeat(rng.uniform(-2, 2, n // 10), 10)
    y = np.asarray(simulate(cart(spring=True), t, {"F": u}, hold=hold)["y"])
    y = (y + noise * rng.standard_normal(n))[:, None]
    return Data("run", t, {"F": u}, y, ("y",), np.array([floor or noise]), interleaved(0, n))


def fitted(data: Data, hold: str | None = None) -> Fit:
    return nominal_fit(cart(spring=True), data, hold)[1]


def test_no_other_behaviour_is_said_to_be_better_than_the_one_that_stays() -> None:
    """It leaves three per cent less, which half a sample does as well; what it moves is told."""
    data, graph = recorded("linear", 14e-3, 6000), cart(spring=True)
    asked = Problem(graph, data, lags=False)  # no delay tells which of them needs one
    made, other = (nominal_fit(graph, data, h, asked)[1] for h in (None, "linear"))
    assert made.problem.data.hold == "hold"
    assert 0.97 * made.cost < other.cost < 0.99 * made.cost
    said = hold_margin(made, BOTH)
    assert re.fullmatch("linear predicts as well; with it m = 0.79[0-9]* kg, beyond .*", said)


@pytest.mark.parametrize("true", BOTH)
@pytest.mark.parametrize("begun", BOTH)
def test_of_behaviours_that_fit_equally_well_that_without_a_delay_is_taken(
    true: str, begun: str
) -> None:
    """Half a sample of every sensor is the other behaviour, wherever the search began."""
    data = recorded(true, 8e-3, 6000)
    fits = {h: fitted(data, h) for h in BOTH}
    costs = sorted(f.cost for f in fits.values())
    assert costs[0] > 0.97 * costs[1]
    made = with_best_hold(fits[begun], 30, BOTH)
    assert made.problem.data.hold == true
    (delay,) = (e for e in made.nuisances if e.name.startswith("delay"))
    assert delay.ci95[0] < 0.0 < delay.ci95[1]
    assert fitted(data).problem.data.hold == true


def test_a_repair_takes_the_better_behaviour_though_its_law_was_found_beside_another() -> None:
    wrong = fitted(recorded("hold", 1e-5), "linear")
    insertion: Any = SimpleNamespace(label="d", effect="", element="")
    step = Decision("missing_physics", trial_of(insertion, True, wrong), (), (), 1.0, 1.0, ())
    assert step.chosen is not None
    (made,) = unthinned([step], wrong.problem, BOTH)
    assert made.chosen is not None
    assert made.chosen.fit.problem.data.hold == "hold"
    assert made.chosen.train < 0.1 * step.chosen.train
    (same,) = unthinned([step], wrong.problem)  # no time: as it was found
    assert same.chosen is step.chosen


def test_beside_less_noise_the_behaviour_is_chosen_again(monkeypatch: pytest.MonkeyPatch) -> None:
    data = recorded("hold", 1e-5)
    y = {"F[N]": data.commands["F"], "y[m]": data.readings[:, 0]}
    recording = Recording.from_arrays("run", y, fs=1 / DT)
    asked = asked_of(cart(spring=True), recording, None, None, {})
    loud = fitted(replace(data, floor=np.array([1.0])), "linear")
    monkeypatch.setattr(whole, "nominal_fit", lambda *_: (loud.problem, loud))
    monkeypatch.setattr(whole, "deepest", lambda first, lowered, *_: lowered)
    result: Any = SimpleNamespace(asked=asked, limits=Thresholds())
    nominal, _ = whole._nominal(result, material_of(asked), BOTH)
    assert nominal.problem.data.floor[0] < 0.1
    assert nominal.problem.data.hold == "hold"


def test_a_command_that_stands_still_is_not_searched_as_if_it_told_something() -> None:
    """It was said first that it tells nothing, and then how surely it is band-limited."""
    data = recorded("hold", 1e-3)
    u = np.full(data.n, 1.5)
    y = np.exp(-0.5 * data.time) * np.cos(3.0 * data.time)
    still = fitted(replace(data, commands={"F": u}, readings=y[:, None]))
    every = ("hold", "linear", "band-limited")
    assert with_best_hold(still, 20, every) is still
    assert hold_margin(still, every) == "no command moves, so it does not show"
    assert hold_margin(still, (still.problem.data.hold,)) == "as given"
    source = still.problem.graph["F"]
    assert flexible_forms(source, PortHistory(u, u, DT)) == {}
    assert set(flexible_forms(source, PortHistory(y, y, DT))) == {"command"}
