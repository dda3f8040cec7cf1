"""Which columns a model's names are given: what is left, what is turned round, for a shell."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bondgraph import BondGraph, C, De, Df, Dq, I, One, R, Se, Zero
from bondgraph.signals.recording import Recording, Split
from bondgraph.support.errors import BondsightError, UnknownName, UnusableInput
from bondsight.cli.spoken import as_options
from identification.datasets.opening import open_recording
from identification.study.data import data_for
from identification.study.study import Study


def coil() -> BondGraph:
    with BondGraph("coil") as g:
        loop, node = One("loop"), Zero("node")
        Se("V", unit="V") >> loop >> I("L", 1e-3, unit="H")
        loop >> R("R_1", 1.0, unit="ohm")
        loop >> node >> C("cap", 1e-3, unit="F")
        node >> De("vc", unit="V")
        loop >> Df("i", unit="A")
    return g


def carriage() -> BondGraph:
    with BondGraph("carriage") as g:
        body = One("body")
        Se("F", unit="N") >> body >> I("m", 1.0, unit="kg")
        body >> C("k", stiffness=10.0, unit="N/m")
        body >> Dq("x", unit="m")
    return g


def table(folder: Path, header: str) -> str:
    file = folder / "run.csv"
    rows = [",".join([f"{0.1 * k:.1f}"] + ["1.0"] * header.count(",")) for k in range(20)]
    file.write_text("\n".join([header, *rows]))
    return str(file)


def refused(file: str, graph: BondGraph, **mapping: str) -> str:
    with pytest.raises(BondsightError) as stop:
        open_recording(file, graph, mapping)
    return str(stop.value)


def recorded(units: dict[str, str]) -> Recording:
    t = np.arange(20) * 0.1
    return Recording.from_arrays("run", {"t[s]": t, **{f"{n}[{u}]": t for n, u in units.items()}})


def no_data(graph: BondGraph, recording: Recording) -> str:
    with pytest.raises(UnusableInput) as stop:
        data_for(graph, recording, Split(slice(0, 10), slice(10, 20), "half"), {})
    return str(stop.value)


def test_only_what_no_unit_matches_is_left_for_a_column_without_one(tmp_path: Path) -> None:
    said = refused(table(tmp_path, "t [s],drive [N],stroke"), carriage())
    assert "such as 'stroke[m]'" in said
    assert said.endswith("map={'x': 'stroke[m]'}")


def test_a_shell_takes_what_is_suggested(tmp_path: Path) -> None:
    said = refused(table(tmp_path, "t [s],F [N],two words"), carriage())
    assert said.endswith("map={'x': 'two words[m]'}")
    assert as_options(said).endswith("--map 'x=two words[m]'")
    both = recorded({"Source voltage": "V", "Cap voltage": "V", "i": "A"})
    assert no_data(coil(), both).endswith("choose one with map={'V': 'Source voltage'}")


def test_the_units_of_what_is_left_are_told() -> None:
    said = no_data(carriage(), recorded({"F": "N", "Coil current": "kA"}))
    assert "it is in m, but of the columns that are left Coil current is in A" in said


def test_a_map_that_is_turned_round_is_told(tmp_path: Path) -> None:
    file = table(tmp_path, "t [s],F [N],Position [mm]")
    assert refused(file, carriage(), Position="x").endswith("turn it round, map={'x': 'Position'}")
    with pytest.raises(UnknownName, match=r"turn it round, map=\{'x': 'Position'\}"):
        Recording.read(file, map={"Position": "x"})


def test_a_map_is_not_turned_onto_a_name_that_the_model_lacks(tmp_path: Path) -> None:
    file = table(tmp_path, "t [s],F [N],x [mm]")
    assert refused(file, carriage(), x="pos").endswith("Known: t [s], F [N], x [mm]")


def test_a_word_of_a_header_is_near_enough(tmp_path: Path) -> None:
    file = table(tmp_path, "t [s],F [N],Coil current [A]")
    with pytest.raises(UnknownName, match=r"Did you mean 'Coil current \[A\]'"):
        Recording.read(file, map={"i": "Coil"})


def test_the_graph_comes_first_and_is_made() -> None:
    recording = recorded({"F": "N", "x": "m"})
    with pytest.raises(UnusableInput, match=r"not a Recording; the graph comes first: Study\(g"):
        Study(recording, carriage())  # type: ignore[arg-type]
    with pytest.raises(UnusableInput, match=r"not a function; call it, carriage\(\)"):
        Study(carriage, recording)  # type: ignore[arg-type]


def test_a_folder_hides_no_known_recording(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "emps").mkdir()
    (tmp_path / "mine").mkdir()
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("BONDSIGHT_RECORDINGS", raising=False)
    monkeypatch.setenv("BONDSIGHT_CACHE", str(tmp_path / "cache"))
    assert "BONDSIGHT_RECORDINGS is not set" in refused("emps", carriage())
    assert "this is not a file" in refused("mine", carriage())


def test_a_tail_that_is_no_unit_is_told_with_what_it_may_mean(tmp_path: Path) -> None:
    said = refused(table(tmp_path, "t [s],F [N],x_Um"), carriage())
    assert "column 'x_Um': no unit that is known (Um is none; um" in said
    assert "such as 'x[um]'" in said
    assert said.endswith("map={'x': 'x_Um[um]'}")
    said = refused(table(tmp_path, "t [s],V [V],vc [V],current_mQ"), coil())
    assert "(mQ is none; mA or mV or mN meant?)" in said
    assert said.endswith("map={'i': 'current_mQ[mA]'}")
    # in the unit of the model, where what may be meant is another quantity
    said = refused(table(tmp_path, "t [s],F [N],x_volts"), carriage())
    assert said.endswith("map={'x': 'x_volts[m]'}")


def test_farads_are_no_temperature(tmp_path: Path) -> None:
    with pytest.raises(UnusableInput, match="F means farad; write degC or K"):
        Recording.read(table(tmp_path, "t [s],temp_F"))
