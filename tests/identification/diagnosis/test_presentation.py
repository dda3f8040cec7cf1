"""A diagnosis, a fit and a run show themselves; files and frames are recordings."""

from __future__ import annotations

import html
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from matplotlib.axes import Axes

from bondgraph.signals.recording import Recording, Split
from bondgraph.signals.split import stretches
from bondgraph.support.errors import UnusableInput
from identification.diagnosis.diagnose import Diagnosis, diagnose
from identification.diagnosis.search.asked import asked_of
from identification.diagnosis.verdict.lines import _value_row
from identification.estimation.estimate import estimate
from identification.report.readings import readings_drawn
from identification.study.study import Study
from tests.identification.diagnosis import rubbing_spring
from tests.identification.diagnosis.rubbing_spring import T, U
from tests.settled import simulate
from tests.spring import spring


@pytest.fixture
def frame() -> pd.DataFrame:
    return rubbing_spring.frame()


@pytest.fixture
def found() -> Diagnosis:
    return rubbing_spring.diagnosed()


def test_a_verdict_prints_on_a_screen(found: Diagnosis) -> None:
    lines = repr(found).splitlines()
    assert lines[0].startswith("Coulomb friction is missing at the resistor d")
    assert "explains all of the misfit" in lines[1]  # nothing but noise is left
    assert len(lines) < 40
    assert max(map(len, lines)) < 400
    assert str(found) == repr(found)
    shown = found._repr_html_()
    assert "<svg" in shown
    assert "Coulomb friction is missing" in shown
    (studio,) = re.findall('srcdoc="([^"]*)"', shown)
    assert "default-src 'none'" in html.unescape(studio)
    assert "Law plane" in studio
    assert len(studio) < 250_000


def test_the_table_of_a_clean_diagnosis_has_its_columns(found: Diagnosis) -> None:
    clean = replace(found, kind="explained").to_pandas()
    assert len(clean) == 0
    assert list(clean.columns) == list(found.to_pandas().columns)


def test_a_number_that_is_hardly_determined_says_so_on_a_screen(found: Diagnosis) -> None:
    assert found.repaired is not None
    e = found.repaired.estimates[0]
    assert "determined" not in _value_row(e, found)[2]
    weak = replace(e, ci95=(1e-4 * e.value, e.value))
    assert _value_row(weak, found)[2].endswith(", hardly determined")


def test_it_draws_what_is_left(found: Diagnosis) -> None:
    ((left, right),) = found.plot()
    assert [line.get_label() for line in left.lines] == ["measured", "as it is", "repaired"]
    assert left.get_legend() is None  # it would lie upon the readings
    (legend,) = left.figure.legends
    assert [t.get_text() for t in legend.get_texts()] == ["measured", "as it is", "repaired"]
    before, after = (np.abs(line.get_ydata()).max() for line in right.lines)
    assert after < 10.0 < before
    assert found.nominal is not None
    held_out = [
        len(range(*s.indices(T.size))) for s in stretches(found.nominal.problem.data.split.test)
    ]
    assert 0 < sum(held_out) < T.size
    assert len(right.patches) >= 5


def test_whatever_is_drawn_shows_itself_in_a_notebook(
    found: Diagnosis, frame: pd.DataFrame
) -> None:
    """The last line of a cell is its picture, not the addresses of axes in memory."""
    recording = Recording.from_pandas(frame, map={"F": "push[N]", "x": "x[m]"})
    for drawn in (found.plot(), recording.plot(), simulate(spring(), T, {"F": U}).plot()):
        assert drawn._repr_png_().startswith(b"\x89PNG")
        shape = " x ".join(map(str, drawn.shape))
        said = f"<Panels: {shape} axes; .figure.savefig(file) writes them>"
        assert repr(drawn) == str(drawn) == said
        assert all(ax.figure is drawn.figure for ax in drawn.flat)
        assert isinstance(drawn.flat[0], Axes)


def test_findings_are_a_table_and_a_page(found: Diagnosis, tmp_path: Path) -> None:
    (row,) = found.to_pandas().to_dict("records")
    assert (row["effect"], row["element"], row["answer"]) == ("coulomb_friction", "d", "exact")
    page = found.report(tmp_path / "out")
    assert page.name == "report.html"
    written = {f.name for f in page.parent.iterdir()}
    assert written == {"repaired.json", "report.html", "verdict.json"}


def test_a_file_is_a_recording(frame: pd.DataFrame, tmp_path: Path, found: Diagnosis) -> None:
    file = tmp_path / "run.csv"
    frame.to_csv(file, index=False)
    for given in (str(file), file, [file]):
        (read,) = asked_of(spring(), given, None, None, {}).recordings
        np.testing.assert_array_equal(read["F"], found.recording["F"])
        np.testing.assert_allclose(read["x"], found.recording["x"], rtol=1e-12)
    with pytest.raises(UnusableInput, match="no recording but int"):
        diagnose(spring(), 5)


def test_without_a_fit_there_is_nothing_to_draw() -> None:
    still = Recording("still", T[:50], {"F": U[:50], "x": 0 * U[:50]}, {"F": "N", "x": "m"})
    empty = diagnose(spring(), still)
    assert empty.kind == "insufficient_data"
    assert empty.to_pandas().empty
    with pytest.raises(UnusableInput, match="nothing to draw"):
        empty.plot()


def test_studies_fits_and_runs_show_themselves(frame: pd.DataFrame) -> None:
    recording = Recording.from_pandas(frame, map={"F": "push[N]", "x": "x[m]"})
    assert len(recording.plot()) == 2
    study = Study(spring(), recording)
    assert "1 recording," in repr(study)
    assert str(study.starting({"m": 0.25})).splitlines()[1] == "  m starts at 0.25 kg"
    assert all(f"<td>{n}</td>" in study._repr_html_() for n in study.free_names)
    fitted = estimate(study)
    ((left, right),) = fitted.plot()
    assert [line.get_label() for line in left.lines] == ["measured", "fitted"]
    assert np.abs(right.lines[0].get_ydata()).max() > 1.0
    run = simulate(spring(), T, {"F": U})
    (ax,) = run.plot()
    np.testing.assert_array_equal(ax.lines[0].get_ydata(), run["x"])
    assert ax.get_ylabel() == "x, m"
    assert "<td>x</td>" in run._repr_html_()


def test_no_model_is_drawn_in_a_rest_that_is_not_scored() -> None:
    time, y = np.arange(10.0), np.ones((10, 1))
    split = Split(slice(4, 8), slice(8, 10), "by hand", slice(0, 4))
    ((left, _),) = readings_drawn(time, y, {"x": "m"}, split, [("as it is", y, np.ones(1))])
    measured, model = (line.get_ydata() for line in left.get_lines())
    assert np.isfinite(measured).all()
    assert np.isnan(model[:4]).all()
    assert np.isfinite(model[4:]).all()
