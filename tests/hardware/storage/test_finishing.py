"""The end: archive, provenance, flags, and the raw journal beside them."""

from __future__ import annotations

import shlex
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from bondgraph.signals.recording import Recording
from bondgraph.support.errors import UnusableInput
from hardware.contracts import Air, Flag, Identity
from hardware.storage import (
    ClockAlignment,
    FlagRun,
    Journal,
    JournalFailed,
    Provenance,
    Scale,
    StreamOrigin,
    finish,
    flag_runs,
    flags_of,
    journal_header,
    new_files,
    open_journal,
    open_raw,
    recovery,
)
from hardware.storage.flag_runs import expanded
from tests.hardware.storage.samples import chunk

N = 4000
SENSOR = StreamOrigin(
    "interferometer", Identity("SIOS", "SP 2000", "123", "1.2"), 16000.0, 16000.6, 0.001, N, 3
)
OUTPUT = StreamOrigin("output", Identity("Humusoft", "MF634"), 16000.0)


def words() -> NDArray[np.uint16]:
    flags = np.zeros(N, np.uint16)
    flags[100:103] = Flag.LEVEL_LOW
    flags[102:] |= np.uint16(Flag.BEAM_LOST)
    return flags


def recording() -> Recording:
    t = np.arange(N) / 16000.0 + 0.5
    return Recording("run", t, {"x": np.sin(t), "V": np.cos(t)}, {"x": "m", "V": "V"})


def provenance(r: Recording) -> Provenance:
    output = np.zeros(N, np.uint16)
    output[7] = Flag.LATE
    return Provenance.for_recording(
        r,
        (SENSOR, OUTPUT),
        {"interferometer": words(), "output": output},
        output_end="parked",
        alignment=ClockAlignment("recorded copy", 1.0000375, 1e-8, 3.2e-4, 1.1e-6),
        scales=(Scale("V", 20.0, 0.001, "V", "2026-11-01"),),
        air=Air(293.15, 101325.0, 0.5, 1.000271),
        envelope={"v_max": 100.0, "limits": (0.0, 100.0), "i_max": None},
        warnings=("the beam was lost",),
    )


def finished(folder: Path) -> tuple[Recording, Path]:
    path, archive = new_files(folder / "run")
    journal = Journal.create(path, journal_header("run", (SENSOR, OUTPUT)), sync=None)
    journal.append(chunk(n=50))
    r = recording()
    return finish(journal, archive, r, provenance(r)), archive


def test_everything_about_a_recording_comes_back(tmp_path: Path) -> None:
    whole, archive = finished(tmp_path)
    back = Recording.open(archive)
    origin = Provenance.of(back)
    assert origin == Provenance.of(whole)
    assert origin.streams == (SENSOR, OUTPUT)
    assert origin.air == Air(293.15, 101325.0, 0.5, 1.000271)
    assert origin.alignment.delay == 3.2e-4
    assert origin.envelope == {"v_max": 100.0, "limits": (0.0, 100.0), "i_max": None}
    assert origin.scales[0].gain == 20.0
    assert (origin.samples, origin.origin, origin.output_end) == (N, 0.5, "parked")
    assert origin.journal == back.source == "run.journal"
    assert origin.started.startswith("20")
    assert origin.software.startswith("bondsight")
    assert np.array_equal(flags_of(back, "interferometer"), words())
    assert flags_of(back)[7] == Flag.LATE
    assert np.array_equal(back["x"], recording()["x"])
    raw = open_raw(archive)
    assert raw.closed
    assert raw.read("interferometer").n == 50
    with pytest.raises(UnusableInput, match="not overwritten"):
        new_files(archive)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["run.journal", "run.npz"]


def test_a_journal_that_was_exchanged_is_found_out(tmp_path: Path) -> None:
    _, archive = finished(tmp_path)
    raw = tmp_path / "run.journal"
    data = bytearray(raw.read_bytes())
    raw.unlink()
    with pytest.raises(UnusableInput, match="cannot be opened"):
        open_raw(archive)
    Journal.create(raw, {}).close()
    with pytest.raises(UnusableInput, match="not the journal"):
        open_raw(archive)
    raw.write_bytes(data)
    assert open_raw(archive).closed


def test_flags_follow_slices_and_decimation(tmp_path: Path) -> None:
    whole, _ = finished(tmp_path)
    assert np.array_equal(flags_of(whole.slice(90, 200), "interferometer"), words()[90:200])
    thin = flags_of(whole.decimate(10), "interferometer")
    assert thin.size == N // 10
    # nothing flagged is without a flag afterwards
    for k in np.flatnonzero(words()):
        assert int(words()[k]) & ~int(thin[int(k) // 10]) == 0
    short = replace(whole.slice(0, 101), channels=dict(whole.slice(0, 101).channels))
    assert not np.any(flags_of(short.slice(0, 100), "interferometer"))
    shifted = replace(whole, time=whole.time + 0.3 / 16000.0)
    with pytest.raises(UnusableInput, match="before resampling"):
        flags_of(shifted)
    with pytest.raises(UnusableInput, match="no provenance"):
        flags_of(recording())


@settings(max_examples=60, deadline=None)
@given(st.lists(st.integers(0, 1023), min_size=1, max_size=60))
def test_runs_are_the_flags(flags: list[int]) -> None:
    given_words = np.array(flags, np.uint16)
    runs = flag_runs({"a": given_words})
    assert np.array_equal(expanded(runs, given_words.size), given_words)
    # runs of one flag neither touch nor overlap
    assert not any(
        a.flag == b.flag and b.first in (a.last, a.last + 1) for a in runs for b in runs if a != b
    )


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"schema": "bondsight-acquisition/9"}, "acquisition/9"),
        ({"samples": "4000"}, "provenance.samples"),
        ({"samples": True}, "provenance.samples"),
        ({"rate": 0.0}, "at 0.0 Hz"),
        (
            {"streams": [{"stream": "a"}]},
            r"provenance.streams\[0\]: StreamOrigin needs its field 'device'",
        ),
        ({"output_end": "perhaps"}, "perhaps"),
        ({"strange": 1}, "no field of Provenance 'strange'"),
        ({"air": {"temperature": None}}, "provenance.air"),
        ({"flags": [{"stream": "a", "flag": "ODD", "first": 0, "last": 1}]}, "ODD"),
        ({"flags": [{"stream": "a", "flag": "LATE", "first": 0, "last": N}]}, "samples 0 to 4000"),
        ({"warnings": "no list"}, "provenance.warnings"),
    ],
)
def test_provenance_that_was_changed_is_refused(change: dict[str, Any], said: str) -> None:
    plain = {**provenance(recording()).to_plain(), **change}
    with pytest.raises(UnusableInput, match=said):
        Provenance.from_plain(plain)


def test_plain_values_come_back() -> None:
    origin = provenance(recording())
    assert Provenance.from_plain(origin.to_plain()) == origin
    with pytest.raises(UnusableInput):
        Provenance.from_plain(None)
    with pytest.raises(UnusableInput, match="8 flags of a for 4000"):
        Provenance.for_recording(recording(), (SENSOR,), {"a": np.zeros(8, np.uint16)})
    with pytest.raises(UnusableInput, match="array"):
        replace(origin, envelope={"a": np.zeros(2)})
    with pytest.raises(UnusableInput, match="no known flag"):
        flag_runs({"a": np.array([1 << 15], np.uint16)})
    assert FlagRun("a", "LATE", 0, 1) < FlagRun("b", "LATE", 0, 1)


def test_an_end_that_fails_says_where_the_data_are(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    journal = Journal.create(tmp_path / "run.journal", {}, sync=None)
    journal.append(chunk(n=50))
    r = recording()
    other = tmp_path / "other"
    other.mkdir()
    with pytest.raises(UnusableInput, match="beside"):
        finish(journal, other / "run.npz", r, provenance(r))
    with pytest.raises(UnusableInput, match="provenance of 4000 samples for 10"):
        finish(journal, tmp_path / "run.npz", r.slice(0, 10), provenance(r))

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.replace", full)
    with pytest.raises(UnusableInput, match=r"No space left.*--recover run.journal"):
        finish(journal, tmp_path / "run.npz", r, provenance(r))
    assert [p.name for p in tmp_path.iterdir() if p.is_file()] == ["run.journal"]
    assert open_journal(tmp_path / "run.journal").closed
    with pytest.raises(JournalFailed):
        journal.append(chunk())
    monkeypatch.undo()
    finish(journal, tmp_path / "run.npz", r, provenance(r))
    assert open_raw(tmp_path / "run.npz").closed


def test_places_are_checked_before_anything_is_driven(tmp_path: Path) -> None:
    with pytest.raises(UnusableInput, match="no such folder"):
        new_files(tmp_path / "no" / "run")
    Journal.create(tmp_path / "run.journal", {}).close()
    with pytest.raises(UnusableInput, match="--recover"):
        new_files(tmp_path / "run")


def test_the_command_that_recovers_is_typed_as_it_is_printed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("bondsight out").mkdir()
    journal, _ = new_files(Path("bondsight out") / "run")
    journal.touch()
    assert Path(shlex.split(recovery(journal))[-1]).exists()
    assert recovery(Path("out/run.journal")) == "bondsight acquire --recover out/run.journal"
    with pytest.raises(UnusableInput, match=r"--recover 'bondsight out/run\.journal', or rename"):
        new_files(Path("bondsight out") / "run")
