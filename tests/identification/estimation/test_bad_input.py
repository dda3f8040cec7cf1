"""Bad input ends in words or in wide intervals: no hang, no crash, no silent wrong answer."""

from __future__ import annotations

import signal
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from bondgraph.graph.parameter import Parameter
from bondgraph.signals.recording import Recording, Split
from bondgraph.support.arrays import FloatArray as Array
from bondgraph.support.errors import UnusableInput
from identification.estimation import (
    NO_NUISANCES,
    Estimation,
    FitStatus,
    Normal,
    Nuisances,
    Study,
    Vary,
    estimate,
)
from identification.estimation.starts import many_starts
from tests.identification.estimation.plants import (
    FREE,
    NOISE,
    TRUTH,
    caught,
    falling,
    force,
    misses,
    record,
    spring,
    study,
)

METHODS = ("single_shooting", "multiple_shooting")


def changed(force_: Array | None = None, x: Array | None = None, n: int = 600) -> Recording:
    made = record(n)
    return Recording.from_arrays(
        "odd",
        {"F[N]": made["F"] if force_ is None else force_, "x[m]": made["x"] if x is None else x},
        fs=100.0,
    )


def wide(found: Estimation, name: str, factor: float = 5.0) -> bool:
    """Whether the interval admits that the value is hardly known."""
    low, high = found.estimate_of(name).ci95
    return bool(high > factor * low)


def honest(found: Estimation) -> bool:
    """Whether each parameter is near the truth or its interval is wide or it sits at a bound."""
    off = misses(found, TRUTH)
    return all(off[n] < 4 or wide(found, n) or found.estimate_of(n).at_bound for n in TRUTH)


def test_not_a_number_is_refused_with_its_place() -> None:
    x = np.array(record(600)["x"])
    x[300:320] = np.nan
    with pytest.raises(UnusableInput, match=r"20 of 600 values are NaN.*sample 300"):
        changed(x=x)


@pytest.mark.parametrize("level", [0.0, 3e-3])
def test_constant_reading_ends(level: float) -> None:
    found = estimate(study(changed(x=np.full(600, level))))
    assert np.isfinite(list(found.values.values())).all()
    assert any(e.at_bound for e in found.estimates) or all(wide(found, n) for n in TRUTH)


@pytest.mark.parametrize("reading", ["zero", "noise"])
def test_nothing_moves_so_nothing_is_known(reading: str) -> None:
    rng = np.random.default_rng(0)
    x = np.zeros(600) if reading == "zero" else 1e-4 * rng.standard_normal(600)
    found = estimate(study(changed(np.zeros(600), x)))
    assert all(wide(found, n, 1e3) for n in TRUTH)


def test_unexcited_parameters_have_wide_intervals_with_coloured_residuals_too() -> None:
    """The force is silent, the reading wanders: no parameter has anything to do with it."""
    x = np.cumsum(np.random.default_rng(0).standard_normal(600)) * 1e-3
    made = Recording.from_arrays("wander", {"x[m]": x}, fs=100.0)
    found = estimate(study(made, silent=("F",), initial="rest"))
    assert any("coloured" in n for n in found.notes)
    assert all(wide(found, n, 100.0) for n in TRUTH)


def test_constant_force_only_gives_what_it_can() -> None:
    u = np.full(600, 1.0)
    x = 1.0 / 200.0 + NOISE * np.random.default_rng(1).standard_normal(600)
    alone = Nuisances(offsets=False)
    found = estimate(study(changed(u, x), nuisances=alone, initial="rest"))
    assert honest(found)
    assert wide(found, "m")
    assert found.values["k"] == pytest.approx(200.0, rel=0.03)


@pytest.mark.parametrize("factor", [pytest.param(1000.0, marks=pytest.mark.long), 1e-3])
def test_unit_off_by_a_thousand_scales_all_parameters(factor: float) -> None:
    """From far off many starts or multiple shooting; the wrong unit shows as a thousandth."""
    x = np.array(record(600)["x"]) * factor
    found = estimate(study(changed(x=x)), "multiple_shooting", max_iterations=80)
    good = found.rmse()["x"] < 2 * NOISE * factor
    assert good or any(n for n in found.notes)
    if good:
        assert found.values["k"] == pytest.approx(200.0 / factor, rel=0.05)


def test_bounds_that_exclude_the_truth_show() -> None:
    free = ("m", "d", Vary("k", start=300.0, lower=250.0, upper=500.0))
    found = estimate(study(free=free))
    assert found.estimate_of("k").at_bound
    assert any("coloured" in n for n in found.notes)
    assert "at its bound" in str(found)


def test_prior_that_excludes_the_truth_shows() -> None:
    free = ("m", "d", Vary("k", start=300.0, prior=Normal(500.0, 1e-3)))
    found = estimate(study(free=free, noise={"x": NOISE}))
    assert any("prior" in n for n in found.notes)
    free = ("m", "d", Vary("k", start=300.0, prior=Normal(500.0, 1e-3)))
    assert any("coloured" in n for n in estimate(study(free=free)).notes)


@pytest.mark.sampled(every=3)
@pytest.mark.parametrize("n", [2, 3, 4, 5, 8, 12, 20, 40])
@pytest.mark.parametrize("noise", ["white", "coloured"])
def test_tiny_records_never_pretend(n: int, noise: str) -> None:
    found = estimate(study(record(n), noise=noise))
    assert honest(found)
    if n <= 8:
        assert any("training readings for" in note for note in found.notes)


def test_one_sample_is_refused() -> None:
    with pytest.raises(UnusableInput, match="has 1 sample"):
        estimate(study(Recording.from_arrays("one", {"F[N]": [1.0], "x[m]": [0.0]}, fs=100.0)))


@pytest.mark.sampled(every=3)
@pytest.mark.parametrize("n", [3, 8, 20])
def test_tiny_records_end_with_multiple_shooting_too(n: int) -> None:
    found = estimate(study(record(n)), "multiple_shooting")
    assert np.isfinite(found.cost)


@pytest.mark.sampled(every=3)
@pytest.mark.parametrize("noise", ["white", "coloured"])
@pytest.mark.parametrize("method", METHODS)
def test_exact_data_give_exact_values(noise: str, method: str) -> None:
    found = estimate(study(record(300, noise=0.0), noise=noise), method)
    assert found.status in (FitStatus.CONVERGED, FitStatus.NO_PROGRESS)
    for n, t in TRUTH.items():
        assert found.values[n] == pytest.approx(t, rel=1e-6)
        assert np.isfinite(found.estimate_of(n).ci95).all()


@pytest.mark.parametrize("offset", [1.0, 1e3])
def test_huge_offsets_are_offsets(offset: float) -> None:
    found = estimate(study(record(600, offset=offset)))
    assert found.values["k"] == pytest.approx(200.0, rel=5e-3)
    assert found.estimate_of("offset x").value == pytest.approx(offset, rel=1e-4)


def test_an_offset_that_hides_a_wrong_level_is_said() -> None:
    """A known offset of 50 m at a reading of centimetres: the nuisance takes all of it back."""
    level = spring(m=0.7).with_element("x", offset=50.0)
    said = [n for n in estimate(Study(level, record(400), FREE)).notes if "offset of x" in n]
    assert len(said) == 1
    assert "moved by -50 m" in said[0]
    assert not any("offset of x" in n for n in estimate(study(record(400, offset=50.0))).notes)


def test_offset_that_may_not_be_fitted_shows() -> None:
    found = estimate(study(record(600, offset=1e-2), nuisances=Nuisances(offsets=False)))
    assert found.rmse()["x"] > 3 * NOISE
    assert any("coloured" in n for n in found.notes)


def test_start_where_nothing_can_be_simulated_is_said() -> None:
    with pytest.raises(UnusableInput, match="check m = 0"):
        estimate(study(fixed={"m": 0.0}, free=("k", "d")))


@pytest.mark.parametrize("k", [2e-9, 2e13])
def test_starts_far_beyond_reason_are_said(k: float) -> None:
    found = estimate(study(record(600), free=(Vary("k", start=k), "m", "d")))
    assert found.notes
    assert wide(found, "k") or wide(found, "m")


def test_scales_eleven_decades_apart() -> None:
    """Displacements of picometres under forces of meganewtons."""
    u = force(900, 100.0, 5)
    x = np.array(record(900)["x"])
    tiny = Recording.from_arrays("tiny", {"F[N]": u * 1e6, "x[m]": x * 1e-9}, fs=100.0)
    stiff = {n: t * 1e15 for n, t in TRUTH.items()}
    graph = spring().with_values({n: 1.3 * t for n, t in stiff.items()})
    found = estimate(Study(graph, tiny))
    assert max(misses(found, stiff).values()) < 3.3
    assert found.values["k"] == pytest.approx(stiff["k"], rel=5e-3)


def test_all_parameters_fixed_judges_the_model() -> None:
    right = estimate(Study(spring(), record(600), free=()))
    assert right.estimates == ()
    assert right.rmse("test")["x"] == pytest.approx(NOISE, rel=0.1)
    wrong = estimate(Study(spring(k=260.0), record(600), free=()))
    assert wrong.rmse("test")["x"] > 5 * NOISE


@pytest.mark.parametrize(
    "options",
    [
        {"max_iterations": -1},
        {"tolerance": float("nan")},
        {"tolerance": -1.0},
        {"tolerance": 2.0},
    ],
)
def test_ways_of_ending_that_mean_nothing_are_refused(options: dict[str, float]) -> None:
    with pytest.raises(UnusableInput, match="give a number of iterations"):
        estimate(study(record(60)), **options)  # type: ignore[arg-type]


def test_windows_with_a_given_initial_state_are_refused() -> None:
    for initial in ("rest", {"q_k": 0.0}):
        with pytest.raises(UnusableInput, match="every window a free initial state"):
            estimate(study(record(300), window=60, initial=initial))


def test_a_sensor_that_no_recording_holds_is_said() -> None:
    r = record(600)
    near = Recording("run", r.time, {**r.channels, "w_2": r["x"]}, {**r.units, "w_2": "m"})
    (said,) = (n for n in estimate(Study(spring(speed=True), near)).notes if "sensor" in n)
    assert "'w'" in said
    assert "Known: F, x, w_2" in said
    assert "remove('w')" in said
    assert not any("sensor" in n for n in estimate(study(near)).notes)


def test_too_few_iterations_are_said() -> None:
    found = estimate(study(record(300)), max_iterations=0)
    assert found.status is FitStatus.ITERATIONS
    assert "raise max_iterations" in str(found)
    assert "bondsight fit: --iterations" in str(found)


def test_training_on_what_says_nothing() -> None:
    """The force comes after the training samples: only their end, and the noise, are known."""
    u = np.where(np.arange(600) < 400, 0.0, force(600, 100.0, 1))
    quiet = Split(slice(0, 390), slice(390, 600), "before the force")
    x = NOISE * np.random.default_rng(4).standard_normal(600)
    found = estimate(study(changed(u, x), splits=quiet, free=FREE))
    assert all(wide(found, n, 100.0) for n in TRUTH)


@pytest.mark.long
def test_a_bent_step_finds_the_way_from_an_unstable_start() -> None:
    """The mass would be gone in a tenth of a second, but steps that bend come back."""
    made = Study(falling(-200.0), caught(400), hold="hold", nuisances=NO_NUISANCES)
    assert estimate(made).rmse()["x"] < 1.2 * NOISE


@pytest.mark.long
@pytest.mark.parametrize("slope", [-2000.0, -4000.0])
def test_unstable_start_is_said_and_multiple_shooting_finds_the_way(slope: float) -> None:
    """From these starts the mass would be gone in a tenth of a second; the record lasts four."""
    made = Study(falling(slope), caught(400), hold="hold", nuisances=NO_NUISANCES)
    lost = estimate(made)
    assert lost.rmse()["x"] > 10 * NOISE
    assert lost.notes or lost.status.value.startswith("failed: ")
    found = estimate(made, "multiple_shooting")
    assert max(misses(found, {"m": 0.5, "d": 1.0, "t_0_k": 20.0}).values()) < 4.0


@pytest.mark.long
def test_at_the_edge_a_fit_arrives_or_says_that_it_did_not() -> None:
    """Whether bent steps come back from here hangs on the last bits."""
    made = Study(falling(-1000.0), caught(400), hold="hold", nuisances=NO_NUISANCES)
    once = estimate(made)
    arrived = once.rmse()["x"] < 1.2 * NOISE
    assert arrived or once.notes or once.status.value.startswith("failed: ")
    found = estimate(made, "multiple_shooting")
    assert max(misses(found, {"m": 0.5, "d": 1.0, "t_0_k": 20.0}).values()) < 4.0


def test_readings_that_no_number_can_hold_are_a_failure_in_words() -> None:
    push = Parameter("c", 1.0, "N*s/m", positive=False)
    graph = spring().with_element("d", value="c").with_parameters([push])
    made = Study(graph, record(1500), free=("m", "k", Vary("c", start=-80.0)))
    found = estimate(made)
    assert found.status.value.startswith("failed: ")
    assert found.status.value in str(found)
    assert found.values["c"] == pytest.approx(-80.0, rel=0.1)
    with pytest.raises(UnusableInput, match="none of 1 starts gives a finite simulation"):
        many_starts(made, 1, jobs=1, max_iterations=5)
    better = estimate(made.starting({"c": 1.0}))
    assert better.values["c"] == pytest.approx(2.0, rel=0.05)


def test_fits_in_threads_do_not_disturb_each_other() -> None:
    studies = [study(record(300, seed=s)) for s in range(4)]
    one_by_one = [estimate(s).values for s in studies]
    with ThreadPoolExecutor(4) as pool:
        together = [f.values for f in pool.map(estimate, studies)]
    assert together == one_by_one


SCRIPT = """
import signal
import time
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell may have had it ignored
from identification.estimation import estimate
from tests.identification.estimation.plants import record, study

def wait(text, share):
    print("going", flush=True)
    time.sleep(20)

found = estimate(study(record(600)), progress=wait)
print(found.status.name, found.values["k"], flush=True)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="no such signal")
def test_ctrl_c_in_a_terminal_keeps_the_best_so_far() -> None:
    """The key stops the first report; the second one says that the fit is done."""
    script = SCRIPT.replace("time.sleep(20)", "time.sleep(0.0 if text == 'done' else 20)")
    with subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True) as run:
        assert run.stdout is not None
        assert run.stdout.readline() == "going\n"
        run.send_signal(signal.SIGINT)
        said = run.stdout.read().split()
    assert run.returncode == 0
    assert said[-2] == "CANCELLED"
    assert abs(float(said[-1]) - 200.0) < 100.0
