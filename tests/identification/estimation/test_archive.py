"""A saved fit comes back with every bit, refuses damage, and fits on as if it had never left."""

from __future__ import annotations

import math
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest

from bondgraph.signals.recording import Recording, Split
from bondgraph.support.archive import read_archive, write_archive
from bondgraph.support.errors import UnusableInput
from identification.estimation import (
    Estimation,
    LogNormal,
    Normal,
    Nuisances,
    SettledSetting,
    Study,
    Vary,
    estimate,
)
from identification.estimation.archive import SCHEMA, open_fit, save_fit
from tests.settled import simulate
from tests.spring import spring

N, DT = 900, 0.01


def recording(name: str, seed: int) -> Recording:
    rng = np.random.default_rng(seed)
    t = np.asarray(DT * np.arange(N), np.float64)
    u = np.repeat(rng.uniform(-5, 5, N // 20), 20)
    x = np.asarray(simulate(spring(), t, {"F": u})["x"]) + 2e-4 * rng.standard_normal(N)
    meta = {"notes": ("resampled",), "bench": {"gain": (1.0, math.inf)}}
    return Recording(name, t, {"F": u, "x": x}, {"F": "N", "x": "m"}, "a.csv", "ab" * 32, meta)


@pytest.fixture(scope="module")
def fitted() -> Estimation:
    split = Split(slice(100, 600), slice(600, N), "a third", slice(0, 100), 100)
    study = Study(
        spring(k=260.0),
        [recording("one", 1), recording("two", 2)],
        free=(
            Vary("k", start=240.0, lower=10.0, upper=1e4, prior=LogNormal(200.0, 2.0)),
            Vary("d", prior=Normal(2.0, 1.0), own=True),
        ),
        fixed={"m": 0.5},
        noise="coloured",
        nuisances=Nuisances(offsets=True, lags=False),
        splits=[split, split],
        validation=[recording("three", 3)],
        init=50,
    )
    return estimate(study)


@pytest.fixture
def file(fitted: Estimation, tmp_path: Path) -> Path:
    path = tmp_path / "fit.npz"
    save_fit(fitted, path, command="made here")
    return path


def same(a: Estimation, b: Estimation) -> None:
    assert repr(a) == repr(b)
    assert str(a) == str(b)
    assert a.values == b.values
    assert (a.estimates, a.nuisances, a.trace, a.cost) == (
        b.estimates, b.nuisances, b.trace, b.cost,
    )  # fmt: skip
    pairs = [
        *zip(a.simulated, b.simulated, strict=True),
        *zip(a.point.states, b.point.states, strict=True),
        *zip(a.setting.floors, b.setting.floors, strict=True),
        (a.covariance, b.covariance),
        (a.point.theta, b.point.theta),
    ]
    for w, v in zip(a.setting.whitening, b.setting.whitening, strict=True):
        pairs += list(zip(w, v, strict=True))
    assert (a.setting.n_sub, a.setting.n_fine) == (b.setting.n_sub, b.setting.n_fine)
    for x, y in zip(a.setting.corrections, b.setting.corrections, strict=True):
        assert (x is None) == (y is None)
        if x is not None and y is not None:
            pairs.append((x, y))
    for left, right in pairs:
        assert left.dtype == right.dtype
        assert left.tobytes() == right.tobytes()


def test_everything_comes_back_bit_by_bit(fitted: Estimation, file: Path) -> None:
    back = open_fit(file)
    same(fitted, back)
    assert back.setting.hold == fitted.setting.hold
    assert (back.status, back.seconds, back.notes) == (fitted.status, fitted.seconds, fitted.notes)
    for r, s in zip(fitted.study.records, back.study.records, strict=True):
        assert (r.name, r.source, r.sha256) == (s.name, s.source, s.sha256)
        assert dict(r.meta) == dict(s.meta)
    for name in ("free", "fixed", "noise", "nuisances", "splits", "init", "initial", "hold"):
        assert getattr(back.study, name) == getattr(fitted.study, name)


def test_a_refit_of_the_reopened_study_gives_the_same_bits(fitted: Estimation, file: Path) -> None:
    again, there = estimate(fitted.study), estimate(open_fit(file).study)
    same(replace(again, seconds=0.0), replace(there, seconds=0.0))


def test_predictions_on_new_data_are_the_same(fitted: Estimation, file: Path) -> None:
    new = recording("new", 9)
    assert np.array_equal(fitted.predict(new, init=20), open_fit(file).predict(new, init=20))


def test_all_fields_of_a_fit_are_stored() -> None:
    """A field added to these classes must be added to the file."""
    assert {f.name for f in fields(Estimation)} == {
        "study", "setting", "method", "optimiser", "status", "point", "covariance", "cost",
        "trace", "estimates", "nuisances", "simulated", "notes", "seconds",
        "filtered", "run",
    }  # fmt: skip
    assert {f.name for f in fields(SettledSetting)} == {
        "hold", "n_sub", "floors", "whitening", "n_fine", "corrections",
        "corrected_at",
    }  # fmt: skip
    assert {f.name for f in fields(Study)} == {
        "graph", "recordings", "free", "fixed", "initial", "hold", "noise", "nuisances", "splits",
        "validation", "init", "silent", "window", "n_sub", "process_noise",
    }  # fmt: skip
    assert {f.name for f in fields(Nuisances)} == {
        "offsets", "lags", "commands", "clock", "gains",
    }  # fmt: skip
    assert {f.name for f in fields(Vary)} == {
        "name", "start", "lower", "upper", "prior", "scale", "own",
    }  # fmt: skip


@pytest.mark.parametrize("noise", [("m", "F"), {"m": 0.1}, ()])
def test_what_a_filter_saw_is_stored(
    noise: tuple[str, ...] | dict[str, float], tmp_path: Path
) -> None:
    study = Study(spring(), recording("one", 1), process_noise=noise)
    made = estimate(study, method="prediction_error", max_iterations=5)
    save_fit(made, tmp_path / "fit.npz")
    again = open_fit(tmp_path / "fit.npz")
    assert again.study.process_noise == study.process_noise
    assert made.filtered is not None
    assert again.filtered is not None
    assert again.filtered.log_likelihood == made.filtered.log_likelihood
    assert [(e.name, e.value) for e in again.noises] == [(e.name, e.value) for e in made.noises]
    for name in ("reading", "innovation", "state"):
        (one,), (other,) = (getattr(f.filtered, name) for f in (made, again))
        assert np.array_equal(one, other, equal_nan=True)
    assert str(again) == str(made)


def test_a_file_from_before_there_was_process_noise_opens(
    fitted: Estimation, file: Path, tmp_path: Path
) -> None:
    document, arrays = read_archive(file, SCHEMA)
    older = {**document, "study": dict(document["study"]), "fit": dict(document["fit"])}
    del older["study"]["process_noise"], older["fit"]["filtered"]
    write_archive(tmp_path / "old.npz", SCHEMA, older, arrays)
    same(fitted, open_fit(tmp_path / "old.npz"))


def test_noise_of_each_recording_predicts_and_is_stored(tmp_path: Path) -> None:
    parts = [recording("one", 1).slice(0, 200), recording("two", 2).slice(0, 200)]
    study = Study(spring(), parts, free=("k",), noise={"x": np.array([2e-4, 3e-4])}, hold="linear")  # type: ignore[dict-item]
    made = estimate(study, max_iterations=2)
    assert made.predict(parts[0]).shape == (200, 1)
    save_fit(made, tmp_path / "fit.npz")
    again = open_fit(tmp_path / "fit.npz")
    assert [float(f[0]) for f in again.study.first_setting.floors] == [2e-4, 3e-4]
    assert np.array_equal(again.predict(parts[1]), made.predict(parts[1]))


def test_recordings_may_stay_outside_and_are_then_checked(
    fitted: Estimation, tmp_path: Path
) -> None:
    path = tmp_path / "small.npz"
    save_fit(fitted, path, embed=False)
    assert not [n for n in read_archive(path, SCHEMA)[1] if n.startswith("recordings")]
    same(fitted, open_fit(path, fitted.study.records))
    with pytest.raises(UnusableInput, match=r"no samples of recording 'one' \(read from a.csv\)"):
        open_fit(path)
    changed = recording("one", 8)
    with pytest.raises(UnusableInput, match="the one given differs"):
        open_fit(path, [changed, *fitted.study.records[1:]])


def test_a_changed_byte_is_found(file: Path, tmp_path: Path) -> None:
    raw = bytearray(file.read_bytes())
    raw[len(raw) // 2] ^= 1
    bad = tmp_path / "bad.npz"
    bad.write_bytes(bytes(raw))
    with pytest.raises(UnusableInput, match="damaged"):
        open_fit(bad)


def test_a_document_of_another_shape_is_refused_in_one_line(file: Path, tmp_path: Path) -> None:
    document, arrays = read_archive(file, SCHEMA)
    del document["fit"]["status"]
    bad = tmp_path / "bad.npz"
    write_archive(bad, SCHEMA, document, arrays)
    with pytest.raises(UnusableInput, match="not that of a fit") as caught:
        open_fit(bad)
    assert "\n" not in str(caught.value)


def test_the_file_says_who_made_it(file: Path) -> None:
    document, _ = read_archive(file, SCHEMA)
    made = document["made"]
    assert made["command"] == "made here"
    assert made["software"].startswith("bondsight")
    assert made["numpy"] == np.__version__
    assert made["saved"].startswith("20")


def test_a_failed_save_leaves_the_old_file(fitted: Estimation, file: Path) -> None:
    before = file.read_bytes()
    broken = replace(fitted, simulated=(np.array([object()]),))
    with pytest.raises(UnusableInput):
        save_fit(broken, file)
    assert file.read_bytes() == before
    assert list(file.parent.iterdir()) == [file]


def test_another_ending_is_refused(fitted: Estimation, tmp_path: Path) -> None:
    with pytest.raises(UnusableInput, match=r"saved as \.npz"):
        save_fit(fitted, tmp_path / "fit.pickle")
