"""What was added at a port is read off the readings, and every form is held against it."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy import signal

from bondgraph import I
from bondgraph.signals.recording import Recording
from bondgraph.support.errors import BondsightError
from identification.diagnosis.catalogue import CATALOGUE
from identification.diagnosis.diagnose import diagnose
from identification.diagnosis.evidence.remaining import loudness
from identification.diagnosis.localisation.latent_history import equal_ports, latent_history
from identification.diagnosis.localisation.places_without_name import located
from identification.diagnosis.localisation.relations.course import latent_course
from identification.diagnosis.localisation.relations.latent import Sampled, latent_model
from identification.diagnosis.screening.port_history import PortHistory
from identification.diagnosis.screening.port_response import probes
from identification.diagnosis.search.base import base_of
from identification.diagnosis.search.candidates import DiagnosisOptions
from identification.diagnosis.search.there import There, grows_with, look_there
from identification.estimation.single_record import Fit, fit
from tests.identification.diagnosis.three_masses import (
    DT,
    INTERLEAVED,
    NOISE,
    N,
    chain,
    course,
    fitted,
    relations,
)

related = cache(relations)
"""Several tests look at the same fits; none changes what relations are judged by."""


def test_the_course_is_the_likeliest_of_the_whole_record() -> None:
    rng = np.random.default_rng(2)
    phi, n, size = np.array([[0.9, 0.2], [-0.2, 0.85]]), 150, 5.0
    c, d = rng.standard_normal((3, 2)), 0.3 * rng.standard_normal((3, 1))
    model = Sampled(phi, np.array([[0.3], [1.0]]), c, d)
    powers = [np.linalg.matrix_power(phi, i) for i in range(n)]
    g = np.kron(np.eye(n), d)
    for lag in range(1, n):
        one = model.c @ powers[lag - 1] @ model.gamma
        g += np.kron(np.eye(n, k=-lag), one)
    free = np.concatenate([c @ p for p in powers])
    true = size * rng.standard_normal(n)
    seen = g @ true + free @ [3.0, -2.0] + rng.standard_normal(3 * n)
    found = latent_course(model, np.array([30 * size]), seen.reshape(n, 3))[:, 0]
    # least squares of all at once, with the size that the course itself has
    own = found.std()
    wide = np.vstack([np.hstack([g, free]), np.hstack([np.eye(n) / own, np.zeros((n, 2))])])
    best = np.linalg.lstsq(wide, np.concatenate([seen, np.zeros(n)]), rcond=None)[0][:n]
    assert np.std(found - best) < 0.02 * true.std()
    assert np.std(found - true) < 0.2 * true.std()


def test_the_course_at_a_spring_is_the_force_that_the_model_lacks() -> None:
    f = fitted(cubic_k2=5e4, split=INTERLEAVED)
    relation, model = related(f)[0], latent_model(probes(f))
    (springs,) = [p for p in equal_ports(model, relation.ports, relation.theta) if "k2" in p]
    assert "b2" in springs
    found = latent_history(f, relation, "k2", model)
    _, x, v = course(5e4)
    stretch, speed = x[:, 1] - x[:, 0], v[:, 1] - v[:, 0]
    past = found.scene.past["k2"].argument
    assert np.std(past - stretch) < 0.01 * np.std(stretch)
    force = found.likely[:, 0]
    columns = np.stack([stretch, speed, np.ones(N)], axis=1)

    def beside(z: np.ndarray) -> np.ndarray:
        # what the relation does not see is the linear part of this very port; force has quick noise
        left = z - columns @ np.linalg.lstsq(columns, z, rcond=None)[0]
        return np.convolve(left, np.hanning(11), mode="valid")

    assert abs(np.corrcoef(beside(force), beside(5e4 * stretch**3))[0, 1]) > 0.9
    with pytest.raises(BondsightError, match="no signal of its own"):
        latent_history(f, next(r for r in related(f) if r.ports == ("x1",)), "x1", model)


def look(f: Fit) -> There:
    found = related(f)
    where = located(found, f.problem.data.names)
    assert where
    made = look_there(base_of(f), found, where, CATALOGUE, f.problem.with_chain)
    assert made is not None
    return made


def test_laws_are_ranked_along_what_was_added() -> None:
    made = look(fitted(cubic_k2=5e4, split=INTERLEAVED))
    ranked = [s for look in made.looks for s in look.ranking]
    best = max((s for s in ranked if s.effect.name == "nonlinear_stiffness"), key=lambda s: s.share)
    assert best.element.name == "k2"
    assert best.share > 0.9
    assert made.kinds[0].element == "k2"
    assert made.kinds[0].kind in ("restoring", "surface")
    assert all(k.kind != "exogenous" for k in made.kinds)


def test_pushes_follow_nothing_at_their_port() -> None:
    made = look(fitted(pushes=15.0, split=INTERLEAVED))
    assert made.kinds[0].label == "an influence from outside at m1"


def test_what_acts_seldom_is_loud() -> None:
    rng = np.random.default_rng(0)
    noise = rng.standard_normal(4000)
    pulses = np.zeros(4000)
    pulses[1000:1040] = pulses[2500:2530] = 10.0
    assert loudness(noise) < 1.5
    assert loudness(np.sin(0.05 * np.arange(4000))) < 1.0
    assert loudness(noise + pulses) > 2.5


def test_a_force_that_grows_with_the_motion_is_none_from_outside() -> None:
    rng = np.random.default_rng(1)
    level = np.repeat(rng.uniform(0.0, 1.0, 40) ** 4, 100)
    flow = level * rng.standard_normal(4000)
    past = PortHistory(flow, flow, 1e-3)
    assert grows_with(level**2 * rng.standard_normal(4000), [past])
    assert not grows_with(rng.standard_normal(4000), [past])


@pytest.mark.parametrize("hold", ["hold", "linear"])
def test_an_addition_runs_between_samples_whatever_the_commands_do(hold: str) -> None:
    f = fitted()
    data = replace(f.problem.data, hold=hold)
    f = fit(replace(f.problem, data=data), max_iterations=0)
    t = DT * np.arange(N)
    added = np.sin(2 * np.pi * 6.0 * t) * np.hanning(N)
    moved = probes(f).respond("m1", added[:, None])[:, 0, 0]
    p = f.values
    mass, spring, drag = (np.diag([p[f"{n}{i}"] for i in (1, 2, 3)]) for n in "mkb")
    between = np.array([[1.0, 0, 0], [-1, 1, 0], [0, -1, 1]])  # stretches of the springs
    a = np.zeros((6, 6))
    a[:3, 3:] = np.eye(3)
    a[3:, :3] = -np.linalg.solve(mass, between.T @ spring @ between)
    a[3:, 3:] = -np.linalg.solve(mass, between.T @ drag @ between)
    push = np.linalg.solve(mass, [1.0, 0, 0])
    exact = signal.lsim((a, np.r_[np.zeros(3), push][:, None], np.eye(1, 6), 0.0), added, t)[1]
    sign = np.sign(moved @ exact)
    assert (
        np.max(np.abs(sign * moved - exact)) < 0.02 * np.abs(exact).max()
    )  # late by half a sample: 0.19


@pytest.mark.long
def test_an_inertia_whose_motion_is_not_known_is_passed_over() -> None:
    """Two inertias at one junction: one of them depends on the other."""
    force, x, _ = course(pushes=15.0)
    g = chain(1.1, 380.0, 1.4).with_element("m1", value=0.7)
    g = g.with_branch("v1", [I("load", 0.4, unit="kg")])
    seen = x + NOISE * np.random.default_rng(1).standard_normal(x.shape)
    channels = {"F": force} | {f"x{i + 1}": seen[:, i] for i in range(3)}
    units = dict.fromkeys(channels, "m") | {"F": "N"}
    run = Recording("run", np.asarray(DT * np.arange(N), np.float64), channels, units)
    d = diagnose(g, run, options=DiagnosisOptions(jobs=1, effects=1, keep=2, more=1), hold="linear")
    assert d.kind == "unknown_physics"
    assert d.decision is not None
    assert {"k1", "b1"} & set(d.decision.places)
