"""Public data sets: documented, parted as stated, read from copies and from originals."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.signal import lfilter

from bondgraph.support.errors import UnknownName, UnusableInput
from bondsight.cli.main import main
from identification.datasets import SETS, Protocol, protocol, public_set, set_available
from identification.datasets.listing import details, listing
from identification.datasets.places import CACHE_VARIABLE, FOLDER_VARIABLE


@pytest.fixture(autouse=True)
def no_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(CACHE_VARIABLE, str(tmp_path / "cache"))


def real(name: str) -> Protocol:
    if set_available(name) != "folder":
        pytest.skip(f"{name}: set {FOLDER_VARIABLE} to the folder of the recordings")
    return protocol(name)


@pytest.mark.parametrize("name", SETS)
def test_every_set_is_documented(name: str) -> None:
    entry = public_set(name)
    for text in (entry.title, entry.citation, entry.licence, entry.official or entry.note):
        assert text
        assert text.isascii()
    assert " @ " in entry.source
    for original in entry.originals:
        assert len(original.commit) == 40
        assert original.url().startswith("https://raw.githubusercontent.com/")
        assert " " not in original.url()
    if not entry.official:
        assert "parts" in entry.note


def test_names_and_aliases() -> None:
    assert public_set("piezo-steering-mirror").name == "steering_mirror"
    with pytest.raises(UnknownName, match="Did you mean 'silverbox'"):
        protocol("silver_box")


@pytest.mark.parametrize("name", SETS)
def test_absent_is_one_line(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(FOLDER_VARIABLE, raising=False)
    assert set_available(name) == ""
    for folder, why in ((None, "is not set"), (tmp_path, "are not in")):
        with pytest.raises(UnusableInput, match=why) as info:
            protocol(name, folder)
        assert "\n" not in str(info.value)
        assert public_set(name).source in str(info.value)


# --- originals, made here in the form the sources publish -----------------------------------


def original_silverbox(folder: Path) -> dict[str, Any]:
    io = pytest.importorskip("scipy.io")
    v = np.arange(131_072.0)
    io.savemat(folder / "SNLS80mV.mat", {"V1": v[None, :], "V2": 2.0 * v[None, :]})
    return {"v": v}


def test_silverbox_split_is_the_official_one(tmp_path: Path) -> None:
    (tmp_path / "silverbox").mkdir()
    v = original_silverbox(tmp_path / "silverbox")["v"]
    p = protocol("silverbox", tmp_path)
    mean = v[40_650 : 40_650 + 65_062].mean()
    spans = {
        "multisine": (40_650 + 65_062, 127_400),
        "arrow_full": (100, 40_575),
        "arrow_no_extrapolation": (100, 32_100),
    }
    assert p.train[0].n == int((127_400 - 40_650) * 0.75)
    assert p.train[0]["u"] == pytest.approx(v[40_650 : 40_650 + 65_062] - mean)
    for name, (start, stop) in spans.items():
        assert p.tests[name]["u"] == pytest.approx(v[start:stop] - mean)
        assert p.tests[name]["y"] == pytest.approx(2.0 * (v[start:stop] - mean))
    assert p.init == 50
    assert p.official
    assert p.train[0].name == "silverbox/train/multisine"
    assert p.train[0].meta["citation"]
    assert len(p.train[0].sha256) == 64
    assert "mean of the training part" in p.train[0].notes[-1]


def test_wiener_hammerstein_split_is_the_official_one(tmp_path: Path) -> None:
    io = pytest.importorskip("scipy.io")
    folder = tmp_path / "wiener-hammerstein-circuit"
    folder.mkdir()
    v = np.arange(188_000.0)
    stored = {"uBenchMark": v[:, None], "yBenchMark": -v[:, None], "fs": 51_200.0}
    io.savemat(folder / "WienerHammerBenchMark.mat", stored)
    p = protocol("wiener_hammerstein", tmp_path)
    assert np.array_equal(p.train[0]["u"], v[5200:105_200])
    assert np.array_equal(p.tests["noise"]["y"], -v[105_200:184_000])
    assert p.train[0].fs == pytest.approx(51_200.0)
    io.savemat(folder / "WienerHammerBenchMark.mat", {k: v[:9] for k in stored})
    with pytest.raises(UnusableInput, match="9 samples, 105200 are needed"):
        protocol("wiener_hammerstein", tmp_path)


def test_emps_takes_both_official_records(tmp_path: Path) -> None:
    io = pytest.importorskip("scipy.io")
    folder = tmp_path / "emps"
    folder.mkdir()
    t = np.arange(30)[:, None] / 1000.0
    stored = {"t": t, "vir": np.ones((30, 1)), "qm": 0.1 * t, "gtau": 35.15}
    io.savemat(folder / "DATA_EMPS.mat", stored)
    alone = protocol("emps", tmp_path)
    assert not alone.official
    assert alone.train[0].meta["split"] == "own"
    assert (alone.train[0].n, alone.tests["last_third"].n) == (20, 10)
    io.savemat(folder / "DATA_EMPS_PULSES.mat", {**stored, "qm": 0.2 * t})
    both = protocol("emps", tmp_path)
    assert both.official
    assert both.train[0].n == both.tests["pulses"].n == 30
    assert both.tests["pulses"]["x"][9] == pytest.approx(0.0018)


def test_steering_mirror_originals(tmp_path: Path) -> None:
    folder = tmp_path / "piezo-steering-mirror"
    folder.mkdir()
    rng = np.random.default_rng(1)
    arrays = {}
    for level in ("100mV", "200mV", "300mV"):
        for kind, count in (("train", 6), ("test", 3)):
            for k in "uy":
                values = rng.normal(size=(16, 3, count, 2))
                arrays[f"{k}_{level}_{kind}"] = values
                np.save(folder / f"{k}_{level}_{kind}.npy", values)
    p = protocol("steering_mirror", tmp_path)
    assert p.official
    assert len(p.train) == 18
    assert len(p.tests) == 9
    record = p.tests["200mV_3"]
    source = arrays["y_200mV_test"][:, 1, 2, :]
    assert np.array_equal(record["y2"], np.concatenate([source[:, 0], source[:, 1]]))
    assert record.meta["period"] == 16
    assert record.source == "y_200mV_test.npy"
    np.save(folder / "u_100mV_test.npy", np.zeros((16, 2)))
    with pytest.raises(UnusableInput, match=r"no array 'u_100mV_test' of shape"):
        protocol("steering_mirror", tmp_path)


@pytest.mark.parametrize("held", [b"a page that says not found", b""])
def test_a_damaged_mirror_file_is_one_line(held: bytes, tmp_path: Path) -> None:
    folder = tmp_path / "piezo-steering-mirror"
    folder.mkdir()
    file = folder / public_set("steering_mirror").files[0][0]
    for name in public_set("steering_mirror").files[0]:
        (folder / name).write_bytes(held)
    with pytest.raises(UnusableInput, match=rf"{file.name}: .*again") as stop:
        protocol("steering_mirror", tmp_path)
    assert "\n" not in str(stop.value)


def test_coupled_drives_and_bouc_wen_originals(tmp_path: Path) -> None:
    io = pytest.importorskip("scipy.io")
    h5py = pytest.importorskip("h5py")
    folder = tmp_path / "coupled-electric-drives"
    folder.mkdir()
    v = np.arange(500.0)[:, None]
    io.savemat(folder / "drive.mat", {f"{k}{i}": i * v for k in "uz" for i in (1, 2, 3)})
    p = protocol("coupled_drives", tmp_path)
    assert p["1.5V"] is p["test/1.5V"] is p.tests["1.5V"]
    assert p["train/1.5V"] is p.train[1]
    assert np.array_equal(p.tests["1.5V"]["y"], 2.0 * v[400:, 0])
    assert not p.official
    folder = tmp_path / "bouc-wen-SIMULATED"
    folder.mkdir()
    for file, groups in (("train", ["multisine"]), ("test", ["multisine", "sinesweep"])):
        with h5py.File(folder / f"{file}.h5", "w") as f:
            for g in groups:
                f[f"{g}/u"], f[f"{g}/y"] = v, 1e-3 * v
                f[f"{g}/fs"] = [750.0]
    p = protocol("bouc_wen", tmp_path)
    assert p.tests["sinesweep"]["x"][3] == pytest.approx(3e-3)
    assert p.train[0].fs == pytest.approx(750.0)


def test_pneumatic_cylinder_leaves_pauses_out(tmp_path: Path) -> None:
    folder = tmp_path / "pneumatic-cylinder-friction"
    folder.mkdir()
    steps = np.where(np.arange(300) % 7 == 0, 0.011, 0.01)
    steps[99] = 2.0
    t = np.cumsum(steps)
    rows = "".join(f"{a:.4f},{10.0 * a:.6f},1,{a:.6f}\n" for a in t)
    for group in public_set("pneumatic_cylinder").files[0]:
        (folder / group).write_text("t_s,position_mm,pressure_bar,force_N\n" + rows)
    p = protocol("pneumatic_cylinder", tmp_path)
    r = p.train[0]
    assert r.fs == pytest.approx(100.0)
    assert r["x"][1] - r["x"][0] == pytest.approx(1e-4, rel=1e-3)
    assert r.n == pytest.approx(201, abs=5)
    assert "samples 99 to 299 of 300" in r.notes[-1]


def test_rollouts_of_the_servo_are_records(tmp_path: Path) -> None:
    folder = tmp_path / "hobby-servo-arm"
    folder.mkdir()
    head = "rollout,kind,t_s,command_rad,angle_rad\n"
    rows = [f"{i},1,{j / 50},{i + 1},{0.01 * i + 0.1 * j}\n" for i in range(96) for j in range(5)]
    (folder / "rollouts.csv").write_text(head + "".join(rows))
    p = protocol("hobby_servo", tmp_path)
    assert (len(p.train), len(p.tests)) == (64, 32)
    r = p.tests["rollout_42"]
    assert set(r.channels) == {"u", "q"}
    assert np.array_equal(r["u"], np.full(5, 43.0))
    assert r["q"] == pytest.approx(0.42 + 0.1 * np.arange(5))
    assert r.time == pytest.approx(np.arange(5) / 50)
    assert r.meta["resolution"] == {"q": pytest.approx(2 * np.pi / 4096)}
    for wrong in (rows[:-5], [*rows[5:10], *rows[:5], *rows[10:], rows[0]]):
        (folder / "rollouts.csv").write_text(head + "".join(wrong))
        with pytest.raises(UnusableInput, match="is absent or in pieces"):
            protocol("hobby_servo", tmp_path)


def test_pulses_of_the_motor_are_declared(tmp_path: Path) -> None:
    folder = tmp_path / "motoshield-dc-motor"
    folder.mkdir()
    rows = "".join(f"{i / 50},3,{i}\n" for i in range(9))
    for board in ("board1", "board2"):
        text = "t_s,voltage_V,speed_rad_per_s\n" + rows
        (folder / f"{board}_steps.csv").write_text(text)
    p = protocol("motoshield", tmp_path)
    assert p.train[0].meta["resolution"]["w"] == pytest.approx(22.4399, rel=1e-5)
    assert p.tests["board2"].meta["resolution"]["w"] == pytest.approx(11.22, rel=1e-4)


def test_parts_and_shown(tmp_path: Path) -> None:
    (tmp_path / "silverbox").mkdir()
    original_silverbox(tmp_path / "silverbox")
    p = protocol("silverbox", tmp_path)
    assert p["train/multisine"] is p.train[0]
    assert p.records == (*p.train, *p.tests.values())
    with pytest.raises(UnknownName, match="Did you mean 'arrow_full'"):
        _ = p["arow_full"]
    assert "arrow_full 40475" in repr(p)
    assert "test/arrow_full" in details("silverbox", p)
    for name in SETS:
        assert name in listing()


def test_command(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["recordings"]) == 0
    assert "silverbox" in capsys.readouterr().out


# --- the real ones --------------------------------------------------------------------------


@pytest.mark.recordings
@pytest.mark.parametrize("name", SETS)
def test_real_set(name: str) -> None:
    p = real(name)
    entry = p.about
    for record in (*p.train, *p.tests.values()):
        assert {*entry.inputs, *entry.outputs} <= set(record.channels)
        assert record.n > p.init
        assert record.meta["origin"] == entry.source
        assert len(record.sha256) == 64
    fitted = {r.time.tobytes() + r[entry.outputs[0]].tobytes() for r in p.train}
    judged = {r.time.tobytes() + r[entry.outputs[0]].tobytes() for r in p.tests.values()}
    assert not fitted & judged
    assert len(fitted) == len(p.train)
    assert str(p.train[0].n) in details(name)


@pytest.mark.recordings
def test_real_sizes_units_and_levels() -> None:
    silverbox = real("silverbox")
    assert silverbox.train[0]["y"].std() == pytest.approx(0.053, rel=0.1)
    assert np.abs(silverbox.tests["arrow_full"]["y"]).max() > np.abs(silverbox.train[0]["y"]).max()
    mirror = real("steering_mirror")
    level = [mirror.tests[k]["u1"].std() for k in ("100mV", "200mV", "300mV")]
    assert level == pytest.approx([0.1, 0.2, 0.3], rel=0.05)
    period = mirror.tests["300mV"]["y1"].reshape(2, 8192)
    assert np.std(period[0] - period[1]) < 0.03 * np.std(period)
    wiener = real("wiener_hammerstein")
    assert (wiener.train[0].n, wiener.tests["noise"].n) == (100_000, 78_800)
    assert [r.n for r in real("bouc_wen").tests.values()] == [8192, 153_000]
    assert real("pendulum").train[0]["theta"][-100:].mean() == pytest.approx(0.0, abs=2e-3)
    assert real("mr_damper").train[0]["v"].max() < 0.5
    assert real("pneumatic_cylinder").train[0]["p"].mean() == pytest.approx(1e5, rel=0.05)
    heaters = real("tclab")
    assert heaters.train[0]["Q1"].mean() == pytest.approx(0.3, abs=0.01)
    assert heaters.tests["closed_loop_collapse"]["T1"][-1] == pytest.approx(24.1, abs=0.2)
    damper = real("friction_damper").train[0]
    assert damper.fs == pytest.approx(256.0)
    slope = np.gradient(damper["x"], damper.dt)
    assert slope[16:-16] == pytest.approx(damper["v"][16:-16], abs=5e-3)
    assert np.mean(damper["F"] * damper["v"]) > 0.0
    assert real("hobby_servo").tests["rollout_42"].n == 150
    for board in real("motoshield").records:
        counts = board["w"] / board.meta["resolution"]["w"]
        assert counts == pytest.approx(np.round(counts), abs=1e-4)


@pytest.mark.recordings
def test_linear_models_give_the_published_errors() -> None:
    """The parts are those of the literature: linear models leave 6.96, 14.4 and 6.58 mV."""
    p = real("silverbox")
    u, y = p.train[0]["u"], p.train[0]["y"]

    def run(theta: Any, drive: Any) -> Any:
        return lfilter(theta[:4], np.concatenate(([1.0], theta[4:])), drive)

    past = [np.concatenate((np.zeros(k), u[: u.size - k])) for k in range(4)]
    past += [-np.concatenate((np.zeros(k), y[: y.size - k])) for k in (1, 2)]
    start = np.linalg.lstsq(np.column_stack(past), y, rcond=None)[0]
    found = least_squares(lambda theta: (run(theta, u) - y)[p.init :], start, max_nfev=30).x
    error = {
        k: 1e3 * np.sqrt(np.mean((run(found, t["u"]) - t["y"])[p.init :] ** 2))
        for k, t in p.tests.items()
    }
    assert error["multisine"] == pytest.approx(6.96, abs=0.02)
    assert error["arrow_full"] == pytest.approx(14.4, abs=0.1)
    assert error["arrow_no_extrapolation"] == pytest.approx(6.58, abs=0.02)
