"""Two commands, one of them beside its monitor: what is wrong is placed at the right channel."""

from __future__ import annotations

import numpy as np
import pytest

from bondgraph import BondGraph, C, Dq, I, One, R, Se
from bondgraph.graph.composing.instruments import monitor
from bondgraph.graph.drives import Drive
from bondgraph.laws import Coulomb, Saturation
from bondgraph.signals.recording import Recording
from identification.diagnosis.diagnose import diagnose
from identification.diagnosis.search.candidates import DiagnosisOptions
from tests.settled import simulate

N, DT = 1200, 4e-3
T = np.asarray(DT * np.arange(N), np.float64)
NOISE = {"x": 2e-5, "u_1": 2e-3}
FASTER = DiagnosisOptions(jobs=1, effects=1, keep=3, more=1)


def pushed_twice() -> BondGraph:
    with BondGraph("pushed_twice") as g:
        body, first = One("body"), Se("F_1", unit="N")
        first >> body >> I("m", 0.5, unit="kg")
        Se("F_2", unit="N") >> body >> R("d", 3.0, unit="N*s/m")
        body >> C("k", stiffness=200.0, unit="N/m")
        body >> Dq("x", unit="m")
        monitor("u_1", first, 0.1, unit="V")
    return g


def recorded(
    truth: BondGraph, values: dict[str, float], noise: dict[str, float] = NOISE
) -> Recording:
    rng = np.random.default_rng(2)
    commands = {
        "F_1": 3.0 * np.sin(2 * np.pi * (0.5 + 0.6 * T) * T),
        "F_2": 2.0 * np.repeat(rng.uniform(-1, 1, N // 40), 40),
    }
    run = simulate(truth, T, commands, values)
    read = {n: np.asarray(run[n]) + s * rng.standard_normal(N) for n, s in noise.items()}
    units = {"F_1": "N", "F_2": "N", "x": "m", "u_1": "V"}
    return Recording("run", T, {**commands, **read}, units)


@pytest.mark.parametrize(
    ("place", "change", "values", "effect"),
    [
        ("F_1", {"drive": Drive(Saturation(-2.6, 2.6))}, {"k": 215.0}, "saturation"),
        # a misfit so gross that the recording is in question first
        pytest.param(
            *("F_1", {"drive": Drive(Saturation(-2.2, 2.2))}, {"k": 215.0}, "saturation"),
            marks=pytest.mark.long,
        ),
        pytest.param(
            "d", {"law": Coulomb()}, {"F_c_d": 0.3}, "coulomb_friction", marks=pytest.mark.long
        ),
        ("u_1", {"gain": 0.104}, {}, "sensor_gain"),
    ],
)
def test_the_channel_that_is_wrong(
    place: str, change: dict[str, object], values: dict[str, float], effect: str
) -> None:
    truth = pushed_twice().with_element(place, **change)
    found = diagnose(pushed_twice(), recorded(truth, values), noise=NOISE, options=FASTER)
    assert found.kind == "missing_physics"
    (first, *_) = found.findings
    assert first.chosen is not None
    assert (first.chosen.effect, first.chosen.element) == (effect, place)


@pytest.mark.parametrize("step", [None, 2e-3])
def test_right_commands_and_a_right_monitor_are_no_finding(step: float | None) -> None:
    """A coarse encoder is no physics either: its noise is not taken to be below its rounding."""
    model = pushed_twice().with_element("x", resolution=step)
    recording = recorded(model, {"k": 215.0}, {"x": 1e-7, "u_1": 2e-3} if step else NOISE)
    noise = {"u_1": 2e-3} if step else NOISE
    found = diagnose(model, recording, noise=noise, options=FASTER)
    assert found.kind in ("explained", "parameters_only")
