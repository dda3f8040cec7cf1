"""Where in the recording: planted misfit is found where it was planted, and nowhere else."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from bondgraph import BondGraph, C, I, One, R, Se
from bondgraph.graph.elements import TF, Element
from bondgraph.signals.recording import Split
from bondgraph.support.arrays import Array
from identification.diagnosis.localisation.recording import axes_of, where, words
from identification.diagnosis.localisation.recording.bands import bands, spectrum
from identification.diagnosis.localisation.recording.binned import heat_map, profile
from identification.diagnosis.localisation.recording.history import since_turning, turning_points
from identification.diagnosis.localisation.recording.ranking import _Found, distinct
from identification.diagnosis.localisation.recording.region import multiple
from identification.diagnosis.localisation.recording.scan import contrast, densest, stretches
from identification.diagnosis.localisation.recording.variables import variables_of
from identification.diagnosis.localisation.regions import Region, regions, summary
from identification.diagnosis.screening.port_history import FittedModel, PortHistory
from identification.estimation.levenberg_marquardt import FitStatus
from identification.estimation.single_record import Fit
from identification.study.data import Data
from identification.study.problem import Problem
from identification.study.residual import Point
from tests.spring import spring

N, DT, FLOOR = 4000, 0.01, 0.1


def motion(seed: int = 3) -> Array:
    """Displacement with many amplitudes."""
    t = np.arange(N) * DT
    phase = np.random.default_rng(seed).uniform(0, 2 * np.pi, 5)
    rates = (0.31, 0.53, 0.87, 1.31, 1.97)
    return np.asarray(sum(np.sin(2 * np.pi * f * t + p) for f, p in zip(rates, phase, strict=True)))


def band(high: float, share: float, channel: str = "x") -> Any:
    found = Region(
        "frequency", 0.1, high, share, 100 * share / high, "Hz", channel, "frequency", "", 9.0, 9.0
    )
    return _Found(found, None, found.gain)


def test_a_wider_band_that_adds_hardly_any_misfit_is_not_listed() -> None:
    narrow = band(3.0, 0.98)
    assert distinct([narrow, band(30.0, 1.0)]) == (narrow.region,)
    assert len(distinct([narrow, band(30.0, 1.0, "y")])) == 2, "another reading"
    assert len(distinct([band(3.0, 0.5), band(30.0, 1.0)])) == 2, "half of it lies outside"


def fitted(extra: Array, seed: int = 0) -> Fit:
    """A fit whose residual is white noise at the floor plus `extra`."""
    noise = FLOOR * np.random.default_rng(seed).standard_normal(N)
    t, x = np.arange(N) * DT, motion()
    split = Split(slice(100, 3000), slice(3000, N), "planted")
    data = Data("planted", t, {"F": x}, (x + noise + extra)[:, None], ("x",), np.array([FLOOR]),
                split)  # fmt: skip
    problem = Problem(spring(), data)
    return Fit(
        problem, Point(np.zeros(0), np.zeros((1, 2))), FitStatus.CONVERGED, 1.0, 1, x[:, None]
    )


def pasts() -> dict[str, PortHistory]:
    x = motion()
    v = np.gradient(x, DT)
    return {
        "k": PortHistory(x, 200 * x, DT),
        "d": PortHistory(v, 2 * v, DT, x - x[0]),
        "x": PortHistory(x, x, DT),
    }


def louder(where_: Array, times: float = 3.0) -> Array:
    """Independent noise that is added at some samples only."""
    return np.where(where_, times * FLOOR, 0.0) * np.random.default_rng(7).standard_normal(N)


def first(fit: Fit, kind: str, places: tuple[str, ...] = ("k",)) -> Region:
    return next(r for r in where(fit, pasts(), places) if r.kind == kind)


def test_a_burst_is_found_in_time() -> None:
    t = np.arange(N) * DT
    found = where(fitted(louder((t > 12) & (t < 16))), pasts())
    assert found[0].kind == "time"
    assert found[0].low == pytest.approx(12, abs=1.1)
    assert found[0].high == pytest.approx(16, abs=1.1)
    assert found[0].times == pytest.approx(10, rel=0.25)
    assert found[0].z > 8
    assert "between 12" in str(found[0]) or "between 11" in str(found[0])


def test_a_tone_is_found_in_frequency() -> None:
    t = np.arange(N) * DT
    r = first(fitted(0.3 * FLOOR * np.sin(2 * np.pi * 7.0 * t)), "frequency")
    assert r.low < 7.0 < r.high
    assert r.high < 3 * r.low
    assert r.z > 6


def test_a_large_amplitude_is_found() -> None:
    x = motion()
    r = first(fitted(louder(x > 1.5)), "amplitude")
    assert r.element == "k"
    assert r.low == pytest.approx(1.5, abs=0.25)
    assert r.high == pytest.approx(x.max(), rel=0.02)
    assert r.axis == "position of k"
    assert r.unit == "m"


def test_low_speed_is_found() -> None:
    v = np.gradient(motion(), DT)
    r = first(fitted(louder(np.abs(v) < 3.0)), "velocity", ("d",))
    assert r.low == pytest.approx(-3.0, abs=1.0)
    assert r.high == pytest.approx(3.0, abs=1.0)
    assert (r.axis, r.unit) == ("velocity of d", "m/s")


def test_what_follows_a_reversal_is_found() -> None:
    way = since_turning(motion())
    r = first(fitted(louder(way < 0.3)), "history")
    assert r.low == pytest.approx(0.0, abs=0.01)
    assert r.high == pytest.approx(0.3, abs=0.1)


def test_noise_has_no_region() -> None:
    """Each fit is scanned along nine axes and its spectrum; 12 of them say nothing."""
    false = [r for seed in range(12) for r in where(fitted(np.zeros(N), seed), pasts())]
    assert len(false) <= 1


def test_the_same_samples_are_told_once() -> None:
    """The reading, the spring and the command all follow one motion."""
    found = where(fitted(louder(motion() > 1.5)), pasts(), ("k",))
    assert sum(r.kind == "amplitude" and r.low > 0.5 for r in found) == 1
    assert [r.gain for r in found] == sorted((r.gain for r in found), reverse=True)


def test_a_scene_gives_the_ports_and_without_it_the_commands() -> None:
    fit = fitted(louder(motion() > 1.5))
    scene = FittedModel(spring(), fit.problem.data, fit, np.zeros((N, 1)), pasts())
    assert {r.element for r in regions(fit, scene, ("k",))} >= {"k"}
    assert {r.element for r in regions(fit)} <= {"F", ""}
    assert summary(regions(fit, scene))


def test_too_short_or_not_finite_gives_nothing() -> None:
    fit = fitted(np.zeros(N))
    assert where(replace(fit, simulated=np.full((N, 1), np.nan)), pasts()) == ()
    broken = {"k": PortHistory(np.full(N, np.nan), np.full(N, np.nan), DT)}
    assert all(r.element == "" for r in where(fitted(louder(motion() > 1.5)), broken))


def test_turning_points_match_a_plain_loop() -> None:
    x = np.round(motion()[:600], 12)
    turns = [0]
    for i in range(1, 599):
        if (x[i] - x[i - 1]) * (x[i + 1] - x[i]) < 0:
            turns.append(i)
    turns.append(599)
    assert turning_points(x, 1e-9).tolist() == turns
    way = since_turning(x, 1e-9)
    for i in (0, 17, 250, 401, 598):
        last = max(k for k in turns if k <= i)
        assert way[i] == pytest.approx(abs(x[i] - x[last]))


def test_contrast_is_a_standard_score() -> None:
    rng = np.random.default_rng(5)
    inside = np.arange(2000) % 700 < 200
    z = [contrast(rng.standard_normal(2000) ** 2, inside) for _ in range(200)]
    assert np.std(z) == pytest.approx(1.0, abs=0.15)
    assert abs(np.mean(z)) < 0.25


def test_densest_stops_at_the_widest() -> None:
    total, count = np.array([5.0, 5, 5, 5, 5, 5, 5, 5, 0, 0]), np.ones(10)
    ends = densest(total, count)
    assert ends is not None
    assert ends[1] - ends[0] + 1 <= 6
    assert densest(np.ones(4), np.ones(4)) is None
    assert stretches(np.zeros(100), np.ones(100)) == ()


def test_the_spectrum_of_the_floor_is_one() -> None:
    r = 0.2 * np.random.default_rng(2).standard_normal(8192)
    f, power = spectrum(r, 0.2, 0.001)
    assert power.mean() == pytest.approx(1.0, abs=0.05)
    assert f[-1] == pytest.approx(500.0)
    assert bands(np.zeros(100), 0.2, 0.001) == ()


def test_profiles_and_maps() -> None:
    rng = np.random.default_rng(1)
    x, y = rng.uniform(-1, 1, (2, 20000))
    square = (1 + 4 * (x > 0)) * rng.standard_normal(20000) ** 2
    p = profile(x, square, 10)
    assert p.mean[p.centre < 0] == pytest.approx(np.ones(5), abs=0.2)
    assert p.mean[p.centre > 0] == pytest.approx(5 * np.ones(5), abs=0.9)
    assert p.error[-1] == pytest.approx(5 * np.sqrt(2 / 2000), rel=0.4)
    m = heat_map(x, y, square, 4, 3)
    assert m.mean.shape == (3, 4)
    assert (m.mean[:, 2:] > 3).all()
    assert (m.mean[:, :2] < 2).all()


@pytest.mark.parametrize(
    ("element", "displacement", "flow"),
    [
        (C("C_1", 1e-6, unit="F"), "charge", "current"),
        (C("k", stiffness=1.0, unit="N*m/rad"), "angle", "angular velocity"),
        (R("r", 1.0, unit="Pa*s/m^3"), "volume", "volume flow"),
        (I("m", 1.0, unit="kg"), "position", "velocity"),
        (R("r", 1.0), "displacement", "flow"),
    ],
)
def test_variables_are_called_by_their_domain(
    element: Element, displacement: str, flow: str
) -> None:
    v = variables_of(element)
    assert (v.displacement, v.flow) == (displacement, flow)


def test_axes_of_two_ports_and_sources() -> None:
    with BondGraph("gear") as g:
        a, b = One("a"), One("b")
        Se("F", unit="N") >> a >> TF("T", 2.0) >> b >> R("d", 1.0, unit="N*s/m")
    past = PortHistory(motion(), motion(), DT)
    assert [a.kind for a in axes_of(g, "F", past)] == ["amplitude", "velocity", "history"]
    assert axes_of(g, "F", past)[1].unit == "N/s"
    assert axes_of(g, "T", past)[0].name == "effort behind T"
    assert axes_of(g, "F", PortHistory(np.ones(N), np.ones(N), DT)) == ()


def test_words() -> None:
    r = Region("position of k", -1e-9, 2.0, 0.5, 2.5, "m", "x", "amplitude", "k", 2.5e13, 9.0)
    assert words(r) == (
        "where position of k is between 0 and 2 m the misfit of x is 5 million times its noise "
        "there (50 % of it in 20 % of the samples)"
    )
    assert [multiple(v) for v in (1.26, 43.0, 2480.0, 5.3e4)] == [
        "1.3 times", "43 times", "2500 times", "53 thousand times"
    ]  # fmt: skip
