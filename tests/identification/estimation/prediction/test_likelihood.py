"""The filter's likelihood against a dense Gaussian, its gradient against differences."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm, solve_discrete_are
from scipy.stats import multivariate_normal

from bondgraph import BondGraph, C, De, I, One, R, Se, Zero
from bondgraph.laws import Coulomb, Law, Polynomial, QuadraticDrag, StopSum, Stribeck
from bondgraph.support.arrays import Array
from bondgraph.support.errors import BondsightError
from identification.estimation.prediction.exact_plant import ExactPlant
from identification.estimation.prediction.kalman import KalmanFilter
from identification.estimation.prediction.likelihood import evaluate, pass_over
from identification.estimation.prediction.loop import filter_runner
from identification.study.residual import parameters_at
from identification.study.specification import Nuisances, Vary
from tests.identification.estimation.prediction.plants import (
    DAMPING,
    MASS,
    STIFFNESS,
    filter_of,
    random_force,
    recording_of,
    spring,
    study_of,
    transducer,
)
from tests.settled import simulate

DT = 0.02


def measured(n: int, seed: int = 1, both: bool = False, size: float = 4.0) -> tuple[Array, Array]:
    """Force and readings; what they are made of does not matter here."""
    rng = np.random.default_rng(seed)
    u = random_force(n, rng, size=size)
    run = simulate(spring(both), DT * np.arange(n), {"F": u})
    y = np.stack([run[name] for name in (("x", "s") if both else ("x",))], axis=1)
    return u, y * (1 + 0.1 * rng.standard_normal(y.shape)) + 1e-3 * rng.standard_normal(y.shape)


def moved(model: KalmanFilter, seed: int = 2, by: float = 0.1) -> Array:
    start = model.start()
    rng = np.random.default_rng(seed)
    lower, upper = model.bounds
    return np.clip(start + by * rng.standard_normal(start.size), lower, upper)


def differences(model: KalmanFilter, theta: Array, e: float = 2e-6) -> Array:
    found = np.empty(theta.size)
    for i in range(theta.size):
        step = np.zeros(theta.size)
        step[i] = e
        up, down = (evaluate(model, theta + k * step, False).log_likelihood for k in (1, -1))
        found[i] = (up - down) / (2 * e)
    return found


def assert_gradient(model: KalmanFilter, tolerance: float = 1e-6, by: float = 0.1) -> None:
    theta = moved(model, by=by)
    lower, upper = model.bounds
    moving = upper > lower  # a study's offsets and lags that are not fitted stand still
    exact, wanted = evaluate(model, theta).gradient[moving], differences(model, theta)[moving]
    assert np.isfinite(exact).all()
    assert np.abs(exact).min() > 0
    assert np.abs(exact - wanted).max() < tolerance * np.abs(wanted).max()
    assert np.allclose(exact, wanted, rtol=100 * tolerance, atol=tolerance * np.abs(wanted).max())


# -- values ----------------------------------------------------------------------------------


def dense(
    a: Array, b: Array, c: Array, s: Array, r: Array, p0: Array, x0: Array, u: Array, y: Array
) -> float:
    """Log-density of all readings as one Gaussian vector; linear inputs by a ramp state."""
    n, steps = a.shape[0], y.shape[0]
    ramp = np.zeros((n + 2, n + 2))
    ramp[:n, :n], ramp[:n, n : n + 1], ramp[n, n + 1] = a, b, 1.0
    whole = expm(ramp * DT)
    phi, g0, g1 = whole[:n, :n], whole[:n, n], whole[:n, n + 1] / DT
    short = DT / 32  # the block exponential loses digits as exp(|A| DT)
    e = expm(np.block([[-a, s], [np.zeros((n, n)), a.T]]) * short)
    part, q = e[n:, n:].T @ e[:n, n:], np.zeros((n, n))
    for _ in range(32):
        q = e[n:, n:].T @ q @ e[n:, n:] + part
    means, variances = [x0], [p0]
    for k in range(steps - 1):
        means.append(phi @ means[-1] + g0 * u[k] + g1 * (u[k + 1] - u[k]))
        variances.append(phi @ variances[-1] @ phi.T + q)
    joint = np.zeros((steps * n, steps * n))
    for i in range(steps):
        moving = variances[i]
        for j in range(i, steps):
            joint[j * n : (j + 1) * n, i * n : (i + 1) * n] = moving
            joint[i * n : (i + 1) * n, j * n : (j + 1) * n] = moving.T
            moving = phi @ moving
    big = np.kron(np.eye(steps), c)
    cover = big @ joint @ big.T + np.kron(np.eye(steps), np.diag(r))
    mean = (np.array(means) @ c.T).ravel()
    seen = np.isfinite(y.ravel())
    return float(
        multivariate_normal(mean[seen], cover[np.ix_(seen, seen)], allow_singular=False).logpdf(
            y.ravel()[seen]
        )
    )


A = np.array([[-DAMPING / MASS, -STIFFNESS], [1 / MASS, 0.0]])
B = np.array([[1.0], [0.0]])
READ = np.array([[0.0, 1.0], [1 / MASS, 0.0]])


@pytest.mark.parametrize("initial", ["free", "rest"])
def test_equals_a_dense_gaussian(initial: str) -> None:
    u, y = measured(30, both=True)
    seen = y.copy()
    seen[4, 0] = seen[9, 1] = seen[12] = np.nan
    model = filter_of(
        spring(True), recording_of(y, DT, u, ("x", "s")), {"m": 0.3, "q_k": 0.02},
        noise={"x": 2e-3, "s": 0.05}, initial=initial, readings=seen,
    )  # fmt: skip
    assert model.first.dynamics.state_names == ("p_m", "q_k")
    theta = model.start()
    found = evaluate(model, theta, False)
    s, r = np.diag([0.3**2, 0.02**2]), np.array([2e-3, 0.05]) ** 2
    wanted = dense(A, B, READ, s, r, np.zeros((2, 2)), model.rest[0], u, seen)
    assert abs(found.log_likelihood - wanted) < 1e-9 * abs(wanted)


def test_a_record_at_rest_begins_at_the_rest_of_its_values() -> None:
    u, y = measured(60)
    model = filter_of(
        spring(), recording_of(y + 0.02, DT, u + 4.0), {"m": 0.3}, noise={"x": 2e-3}, initial="rest"
    )
    theta = moved(model)
    p = parameters_at(model.first, model.local(theta, 0))
    stiffness = p[model.first.dynamics.parameter_names.index("k")]
    assert abs(stiffness / STIFFNESS - 1.0) > 0.01
    x = model.initial(theta, 0)[model.first.dynamics.state_names.index("q_k")]
    assert x == pytest.approx((u[0] + 4.0) / stiffness, rel=1e-9)
    assert_gradient(model)


def test_noise_at_a_source_acts_where_the_command_acts() -> None:
    u, y = measured(25)
    model, same = (
        filter_of(spring(), recording_of(y, DT, u), {place: 0.3}, noise={"x": 2e-3})
        for place in ("F", "p_m")
    )
    values = [evaluate(m, m.start(), False).log_likelihood for m in (model, same)]
    assert values[0] == pytest.approx(values[1], rel=1e-12)
    wanted = dense(
        A,
        B,
        READ[:1],
        np.diag([0.09, 0.0]),
        np.array([4e-6]),
        np.zeros((2, 2)),
        model.rest[0],
        u,
        y,
    )
    assert values[0] == pytest.approx(wanted, rel=1e-9)


def test_charges_beside_momenta() -> None:
    """States that differ by many orders of magnitude: the same dense Gaussian, in wide numbers."""
    rng = np.random.default_rng(4)
    n = 24
    u = random_force(n, rng, size=100.0)
    run = simulate(transducer(), DT * np.arange(n), {"V": u})
    y = np.stack([run["Q"], run["s"]], axis=1)
    y = y + rng.standard_normal(y.shape) * y.std(axis=0) * 0.05
    level = 0.05 * y.std(axis=0)
    model = filter_of(
        transducer(), recording_of(y, DT, u, ("Q", "s"), source="V"), ("m", "C0"),
        noise={"Q": float(level[0]), "s": float(level[1])}, initial="rest",
    )  # fmt: skip
    (scale,) = model.state_scale
    assert scale.max() / scale.min() > 1e3
    theta = model.start()
    compiled = model.first.compiled
    block = np.asarray(compiled.matrices(model.first.start_vector).full())
    order = compiled.n_x
    sigma = np.zeros(order)
    for d, t in zip(model.diffusions(), theta[model.slots.sigma], strict=True):
        assert d is not None
        sigma[d.index] = np.exp(t)
    a = block[:order, :order] * scale / scale[:, None]
    b = block[:order, order:] / scale[:, None]
    # readings in units of their noise, or the dense covariance is singular to SciPy
    c = block[order:, :order] * scale / level[:, None]
    wanted = dense(
        a, b, c, np.diag((sigma / scale) ** 2), np.ones(2), np.zeros((order, order)),
        model.rest[0] / scale, u, y / level,
    ) - n * np.log(level).sum()  # fmt: skip
    found = evaluate(model, theta, False).log_likelihood
    assert abs(found - wanted) < 1e-9 * abs(wanted)


def test_records_add_up() -> None:
    parts = [
        recording_of(y, DT, u, name=name)
        for name, (u, y) in (("a", measured(40, 1)), ("b", measured(60, 2)))
    ]
    values = []
    for records in (parts, parts[:1], parts[1:]):
        model = filter_of(spring(), records, {"m": 0.3}, noise={"x": 2e-3}, initial="rest")
        values.append(evaluate(model, model.start(), False).log_likelihood)
    assert values[0] == pytest.approx(values[1] + values[2], rel=1e-12)


def test_settled_gain_solves_the_riccati_equation() -> None:
    u, y = measured(400)
    model = filter_of(spring(), recording_of(y, DT, u), {"m": 0.3, "k": 0.01}, noise={"x": 2e-3})
    theta = model.start()
    passed, _ = pass_over(model, theta, 0, np.ones((400, 1)), True)
    assert 0 < passed.settled_at < 380
    e = expm(np.block([[-A, np.diag([0.09, 1e-4])], [np.zeros((2, 2)), A.T]]) * DT)
    q = e[2:, 2:].T @ e[:2, 2:]
    phi, c = expm(A * DT), READ[:1]
    p = solve_discrete_are(phi.T, c.T, q, np.array([[4e-6]]))
    wanted = float((c @ p @ c.T)[0, 0]) + 4e-6
    found = passed.variance[-1, 0] * model.reading_scale(0)[0] ** 2
    assert found == pytest.approx(wanted, rel=1e-9)


def test_a_missing_sample_after_settling_takes_the_long_way() -> None:
    """The settled gain is a short cut, not another filter: a dense Gaussian with a late gap."""
    u, y = measured(220)
    seen = y.copy()
    seen[200] = np.nan
    model = filter_of(
        spring(), recording_of(y, DT, u), {"m": 0.3, "k": 0.01}, noise={"x": 2e-3},
        initial="rest", readings=seen,
    )  # fmt: skip
    theta = model.start()
    passed, _ = pass_over(model, theta, 0, np.isfinite(seen).astype(float), True)
    assert 0 < passed.settled_at < 200
    wanted = dense(
        A, B, READ[:1], np.diag([0.09, 1e-4]), np.array([4e-6]), np.zeros((2, 2)),
        model.rest[0], u, seen,
    )  # fmt: skip
    assert evaluate(model, theta).log_likelihood == pytest.approx(wanted, rel=1e-9)


# -- gradients -------------------------------------------------------------------------------


def test_gradient_of_a_linear_model() -> None:
    u, y = measured(300, both=True)
    seen = y.copy()
    seen[4, 0] = seen[250] = np.nan
    records = [
        recording_of(y, DT, u, ("x", "s")),
        recording_of(*reversed_readings(80), ("x", "s"), name="other"),
    ]
    model = filter_of(
        spring(True), records, ("m", "q_k", "F"), nuisances=Nuisances(lags=False), readings=seen
    )
    lower, upper = model.bounds
    # three diffusions, two noises, three parameters, and four own numbers of each record
    assert (upper > lower).sum() == 3 + 3 + 2 + 2 * 4
    assert_gradient(model)


def reversed_readings(n: int) -> tuple[Array, float, Array]:
    u, y = measured(n, 7, both=True)
    return y, DT, u


def duffing() -> BondGraph:
    law = Polynomial(half=0.05, size=5.0, orders=(2, 3), unit="N")
    g = spring().with_element("k", law=law)
    return g.with_values({"a_2_k": 1.0, "a_3_k": 3.0})


def dragged() -> BondGraph:
    return duffing().with_element("d", law=QuadraticDrag(1.0))


def rubbing() -> BondGraph:
    return spring().with_element("d", law=Coulomb(0.4))


def hysteretic() -> BondGraph:
    return spring().with_element("k", law=StopSum((0.005, 0.02), 40.0, 40.0, unit="N/m"))


@pytest.mark.sampled(every=2)
@pytest.mark.parametrize(
    ("graph", "n_sub"), [(duffing, 2), (rubbing, 1), (hysteretic, 1), (dragged, 1)]
)
def test_gradient_with_laws(graph: object, n_sub: int) -> None:
    assert callable(graph)
    u, y = measured(120)
    model = filter_of(graph(), recording_of(y, DT, u), ("m", "F"), n_sub=n_sub)
    assert_gradient(model, 1e-5, 0.02)


@pytest.mark.parametrize(
    ("law", "coarse"), [(Coulomb(0.4), False), (Stribeck(0.4, 0.2, 0.05), True)]
)
def test_what_bends_while_it_slides_asks_for_finer_steps(law: Law, coarse: bool) -> None:
    """Friction that falls with speed jumps as dry friction does, but is no level."""
    u, y = measured(20)
    model = filter_of(spring().with_element("d", law=law), recording_of(y, DT, u), ("m", "F"))
    assert model.coarse is coarse


def test_gradient_where_a_reading_contains_a_law() -> None:
    """A sensor under the damper: the reading follows the state through the law."""
    with BondGraph("felt") as g:
        body, foot = One("v"), Zero("foot")
        Se("F", unit="N") >> body >> I("m", MASS, unit="kg")
        body >> C("k", stiffness=STIFFNESS, unit="N/m")
        body >> foot >> R("d", DAMPING, unit="N*s/m", law=QuadraticDrag(1.0))
        foot >> De("f", unit="N")
    u, y = measured(100, both=True)
    model = filter_of(g, recording_of(DAMPING * y[:, 1:], DT, u, ("f",)), ("m",))
    assert isinstance(model.plants[0], ExactPlant)
    assert model.plants[0].feedthrough
    assert_gradient(model, 1e-5, 0.02)


def assert_the_same_without_a_compiler(
    model: KalmanFilter, monkeypatch: pytest.MonkeyPatch, close: float = 1e-8
) -> None:
    theta = moved(model, by=0.02)
    compiled = evaluate(model, theta)
    filter_runner.cache_clear()
    monkeypatch.setenv("BONDSIGHT_NO_COMPILER", "1")
    plain = evaluate(model, theta)
    monkeypatch.delenv("BONDSIGHT_NO_COMPILER")
    filter_runner.cache_clear()
    assert plain.log_likelihood == pytest.approx(compiled.log_likelihood, rel=1e-3 * close)
    assert np.allclose(plain.gradient, compiled.gradient, rtol=close, atol=1e-8)
    assert np.allclose(plain.information, compiled.information, rtol=close, atol=1e-8)


def test_without_a_compiler_all_is_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    u, y = measured(60)
    for graph in (spring(), duffing(), hysteretic()):
        model = filter_of(graph, recording_of(y, DT, u), ("m",), n_sub=2)
        assert_the_same_without_a_compiler(model, monkeypatch)


def test_bad_names_are_said_in_one_line() -> None:
    u, y = measured(30)
    record = recording_of(y, DT, u)
    cases: list[tuple[dict[str, object], str]] = [
        ({"process_noise": ("mass",)}, "no place for process noise 'mass' in spring"),
        ({"process_noise": "m"}, r"give a sequence, such as \('m',\)"),
        ({"process_noise": {"m": 0.0}}, "process noise at m = 0: give a positive intensity"),
        ({"process_noise": ("m", "m")}, "names a place twice"),
        ({"process_noise": 3}, "process_noise = 3: give names of states"),
        ({"process_noise": [["m"]]}, "give names of states"),
        ({"process_noise": {"m": True}}, "m = True is not a finite number"),
        ({"noise": {"z": 1.0}}, "no sensor 'z'"),
        ({"initial": "fre"}, "no initial state 'fre'"),
    ]
    for given, words in cases:
        with pytest.raises(BondsightError, match=words):
            study_of(spring(), record, **given)  # type: ignore[arg-type]


def test_bounds_and_starts_of_overrides_count() -> None:
    u, y = measured(30)
    model = filter_of(
        spring(), recording_of(y, DT, u), free=(Vary("k", start=155.0, lower=150.0, upper=160.0),)
    )
    lower, upper = model.bounds
    ((i, free),) = model.stack.free.items()
    assert free.value(lower[i]) == pytest.approx(150.0)
    assert free.value(upper[i]) == pytest.approx(160.0)
