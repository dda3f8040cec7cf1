"""Known recordings: those in the folder of the user, and small stand-ins made here."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bondgraph.signals.split import whole
from bondgraph.support.errors import UnknownName, UnusableInput
from identification import datasets as data
from identification.datasets.places import CACHE_VARIABLE, originals_folder
from identification.datasets.readers import EMPS_FORCE_PER_VOLT


def real(name: str) -> data.LoadedRecording:
    """Load a known recording or skip with the reason."""
    if not data.available(name):
        pytest.skip(f"{name}: set {data.FOLDER_VARIABLE} to a folder with {data.about(name).files}")
    return data.load(name)


def test_names_and_aliases() -> None:
    assert {"piezo-actuator-sine", "emps", "silverbox", "hair_dryer"} <= set(data.names())
    assert data.about("daisy-mechatronics/hair_dryer") is data.KNOWN["hair_dryer"]
    assert data.about("silverbox/multisine") is data.KNOWN["silverbox"]
    with pytest.raises(UnknownName, match="Did you mean 'emps'"):
        data.load("emsp")


@pytest.mark.parametrize("name", data.names())
def test_every_entry_is_documented(name: str) -> None:
    known = data.about(name)
    entry = known.set
    for text in (known.title, entry.source, entry.citation, entry.licence):
        assert text
        assert "http" not in text
    assert " @ " in entry.source
    assert known.files
    assert entry.outputs


@pytest.mark.parametrize("name", data.names())
def test_absent_is_one_line(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(data.FOLDER_VARIABLE, raising=False)
    monkeypatch.setenv(CACHE_VARIABLE, str(tmp_path))
    assert not data.available(name)
    for folder, why in ((None, "is not set"), (tmp_path, "no such file")):
        with pytest.raises(UnusableInput, match=why) as info:
            data.load(name, folder)
        text = str(info.value)
        assert "\n" not in text
        assert data.FOLDER_VARIABLE in text
        assert data.about(name).set.source in text
        assert data.about(name).files[0] in text


def test_folder_from_the_environment(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "daisy-mechatronics").mkdir()
    file = tmp_path / "daisy-mechatronics" / "hair_dryer.csv"
    file.write_text("t_s,heater_voltage_V,air_temperature_V\n0,6,1\n0.08,6,2\n0.16,3,3\n")
    monkeypatch.setenv(data.FOLDER_VARIABLE, str(tmp_path))
    assert data.available("hair_dryer")
    recording, split = data.load("hair_dryer")
    assert recording.n == 3
    assert recording.name == "hair_dryer"
    assert recording.source == "hair_dryer.csv"
    assert len(recording.sha256) == 64
    assert split.test == slice(2, 3)


def test_stand_in_piezo(tmp_path: Path) -> None:
    t = np.arange(1000) / 100.0
    v = np.where(t < 3.26, 0.0, 150.0 * np.sin(2 * np.pi * (t - 3.26) - 0.6))
    rows = "".join(f"{a:.4f},{0.13 * b:.6f},{b:.6f}\n" for a, b in zip(t, v, strict=True))
    (tmp_path / "piezo-actuator-sine").mkdir()
    file = tmp_path / "piezo-actuator-sine" / "sine_150V_1Hz.csv"
    file.write_text("t_s,displacement_um,voltage_V\n" + rows)
    recording, split = data.load("piezo-actuator-sine", tmp_path)
    assert recording["x"].max() == pytest.approx(19.5e-6, rel=1e-3)
    assert split.rest == slice(0, 326)
    assert (split.train, split.test) == (slice(400, 800), slice(800, 1000))


def test_originals_of_emps_and_hair_dryer(tmp_path: Path) -> None:
    io = pytest.importorskip("scipy.io")
    for folder in ("emps", "daisy-mechatronics"):
        (tmp_path / folder).mkdir()
    t = np.arange(9)[:, None] / 1000.0
    stored = {"t": t, "vir": np.ones((9, 1)), "qm": 0.1 * t, "gtau": 35.15}
    io.savemat(tmp_path / "emps" / "DATA_EMPS.mat", stored)
    emps, _ = data.load("emps", tmp_path)
    assert emps["F"] == pytest.approx(np.full(9, EMPS_FORCE_PER_VOLT))
    assert emps.fs == pytest.approx(1000.0)
    file = tmp_path / "daisy-mechatronics" / "dryer.mat"
    io.savemat(file, {"X": np.ones((1, 6)), "y": np.arange(6.0)[None, :]})
    dryer, _ = data.load("hair_dryer", tmp_path)
    assert dryer["y"][5] == 5.0
    assert dryer.dt == pytest.approx(0.08)
    io.savemat(file, {"other": np.ones(6)})
    with pytest.raises(UnknownName, match=r"dryer\.mat"):
        data.load("hair_dryer", tmp_path)


def test_what_was_fetched_is_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    io = pytest.importorskip("scipy.io")
    monkeypatch.delenv(data.FOLDER_VARIABLE, raising=False)
    monkeypatch.setenv(CACHE_VARIABLE, str(tmp_path))
    assert not data.available("hair_dryer")
    file = originals_folder() / "daisy-mechatronics" / "dryer.mat"
    file.parent.mkdir(parents=True)
    io.savemat(file, {"X": np.ones((1, 6)), "y": np.arange(6.0)[None, :]})
    for cache in (None, tmp_path):
        assert data.available("hair_dryer", cache=cache)
        assert data.load("hair_dryer", cache=cache).recording["y"][5] == 5.0
    # the folder of the user goes first
    mine = tmp_path / "mine" / "daisy-mechatronics"
    mine.mkdir(parents=True)
    io.savemat(mine / "dryer.mat", {"X": np.ones((1, 6)), "y": np.zeros((1, 6))})
    assert data.load("hair_dryer", tmp_path / "mine").recording["y"][5] == 0.0


def test_original_of_silverbox(tmp_path: Path) -> None:
    io = pytest.importorskip("scipy.io")
    (tmp_path / "silverbox").mkdir()
    file = tmp_path / "silverbox" / "SNLS80mV.mat"
    v = np.arange(131_072.0)
    io.savemat(file, {"V1": v[None, :], "V2": 2 * v[None, :]})
    recording, split = data.load("silverbox", tmp_path)
    assert recording.n == 86_750
    assert recording["u"][0] == pytest.approx(40_650 - v.mean())
    assert split.test == slice(65_062, 86_750)
    io.savemat(file, {"V1": v[None, :9], "V2": v[None, :9]})
    with pytest.raises(UnusableInput, match="131072"):
        data.load("silverbox", tmp_path)


# --- the real ones --------------------------------------------------------------------------


@pytest.mark.parametrize("name", data.names())
def test_real_recording_loads(name: str) -> None:
    entry = data.about(name).set
    recording, split = real(name)
    assert set(recording.channels) == {*entry.inputs, *entry.outputs}
    assert recording.meta["citation"] == entry.citation
    train, test = whole(split.train), whole(split.test)
    assert 0 < train.stop <= test.start < test.stop == recording.n


def test_real_piezo() -> None:
    recording, split = real("piezo-actuator-sine")
    assert split.rest is not None
    assert recording.time[split.rest.stop] == pytest.approx(3.2572)
    assert (split.train, split.test) == (slice(20_001, 40_001), slice(40_001, 50_001))
    drive, x = recording["V"][split.test], recording["x"][split.test]
    gain, offset = np.polyfit(drive, x, 1)
    left = np.linalg.norm(x - gain * drive - offset) / np.linalg.norm(x - x.mean())
    assert 0.12 < left < 0.16
    assert recording["x"][split.rest].std() < 0.1e-6


def test_real_emps_has_the_published_friction() -> None:
    # central differences twice: a rough regression, so 6 to 10 % from the published values
    recording, _ = real("emps")
    r = recording.decimate(10)
    v = np.gradient(r["x"], r.dt)
    a = np.gradient(v, r.dt)
    moving = np.abs(v) > 0.01
    table = np.column_stack([a, v, np.sign(v), np.ones(r.n)])[moving]
    mass, viscous, coulomb, offset = np.linalg.lstsq(table, r["F"][moving], rcond=None)[0]
    assert mass == pytest.approx(95.1, rel=0.06)
    assert viscous == pytest.approx(203.5, rel=0.1)
    assert coulomb == pytest.approx(20.4, rel=0.1)
    assert offset == pytest.approx(-3.2, abs=0.3)


def test_real_silverbox() -> None:
    recording, split = real("silverbox")
    assert recording.fs == pytest.approx(610.3515625)
    assert abs(recording["u"].mean()) < 1e-3
    assert split.train == slice(0, 65_062)
    arrow, _ = real("silverbox/arrow")
    assert arrow["y"].max() > recording["y"].max()


def test_real_hair_dryer() -> None:
    recording, split = real("hair_dryer")
    assert recording.n == 1000
    assert recording.dt == pytest.approx(0.08)
    assert recording["u"].min() > 3.0
    assert split.test == slice(667, 1000)
