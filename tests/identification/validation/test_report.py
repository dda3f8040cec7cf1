"""From an estimation to one page: true numbers in it, everything escaped, nothing fetched."""

from __future__ import annotations

import re
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from bondgraph.signals.recording import Recording
from bondgraph.support.errors import UnusableInput
from identification.estimation import Estimation, Study, estimate
from identification.estimation.single_record import fit
from identification.estimation.starts import many_starts
from identification.validation import compare, judge
from identification.validation.figures import waterfall_figure
from identification.validation.report import page, write_report
from tests.settled import simulate
from tests.spring import spring

N, DT, NOISE = 1500, 0.01, 2e-4
SHA = "0123456789abcdef" * 4
EVIL = "<img src=x onerror=alert(1)>"


def recording(name: str, seed: int) -> Recording:
    rng = np.random.default_rng(seed)
    t = np.asarray(DT * np.arange(N), np.float64)
    u = np.repeat(rng.uniform(-5, 5, N // 5), 5)
    x = np.asarray(simulate(spring(), t, {"F": u})["x"]) + NOISE * rng.standard_normal(N)
    return Recording(name, t, {"F": u, "x": x}, {"F": "N", "x": "m"}, "a.csv", SHA)


@pytest.fixture(scope="module")
def fitted() -> Estimation:
    study = Study(
        spring(0.7), [recording("one", 1), recording(EVIL, 2)], validation=[recording("three", 3)]
    )
    return estimate(study)


class Reader(HTMLParser):
    """Collect tags and attributes; balance is checked."""

    VOID = frozenset(("meta", "br", "img", "link", "input"))

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.tags: list[str] = []
        self.ids: list[str] = []
        self.links: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        for key, value in attrs:
            assert not key.startswith("on"), (tag, key)
            if key == "id":
                self.ids.append(str(value))
            if key in ("src", "href", "xlink:href"):
                self.links.append(str(value))
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.handle_starttag(tag, attrs)
        if tag not in self.VOID:
            self.open.pop()

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


def test_material_of_an_estimation_is_what_it_found(fitted: Estimation) -> None:
    j = judge(fitted)
    m = j.material
    assert [r.name for r in m.records] == ["one", EVIL, "three"]
    assert m.records[0].sha256 == SHA
    assert not m.records[2].train.any()
    for r, record in enumerate(m.records):
        assert np.array_equal(record.simulated, fitted.simulated[r])
        assert np.array_equal(record.floor, fitted.floors[r])
    for c in j.channels:
        r = [x.name for x in m.records].index(c.record)
        assert c.test.rmse == pytest.approx(fitted.rmse("test", r)["x"], rel=1e-12)
    # three parameters, a lag and an offset and two initial states in each of two recordings
    assert m.n_free == 3 + 2 * (2 + 2)
    assert {n.name: n.nominal for n in m.numbers} == {"m": 0.7, "d": 2.0, "k": 200.0}
    assert np.diag(m.correlation) == pytest.approx(1.0)
    assert j.acceptable, str(j)
    assert "judged start from rest" in m.run


def test_material_of_a_single_record_fit(fitted: Estimation) -> None:
    made = fit(fitted.problem(0))
    j = judge(made)
    assert j.channels[0].test.chi2 == pytest.approx(made.chi2("test"), rel=1e-12)
    assert j.acceptable, str(j)


@pytest.fixture(scope="module")
def text(fitted: Estimation) -> str:
    other = estimate(fitted.study.fixing({"m": 0.55}))
    return page(
        judge(fitted, kinds={"m": EVIL}, starts=(1.0, 1.0, 9.0)),
        findings=("F: excited up to 20 Hz", EVIL),
        comparison=compare({"all free": fitted, EVIL: other}),
        command=f"bondsight fit {EVIL}",
    )


def test_the_page_is_whole_and_fetches_nothing(text: str) -> None:
    reader = Reader()
    reader.feed(text)
    assert not reader.open
    assert "script" not in reader.tags
    assert "img" not in reader.tags
    assert all(link.startswith("#") for link in reader.links)
    assert len(reader.ids) == len(set(reader.ids))
    assert {link[1:] for link in reader.links} <= set(reader.ids)
    assert re.findall(r"url\((?!#)", text) == []
    assert "http" not in re.sub(r'xmlns(:\w+)?="[^"]*"', "", text)


def test_foreign_text_is_escaped_everywhere(text: str) -> None:
    assert EVIL not in text
    assert "&lt;img src=x onerror=alert(1)&gt;" in text


def test_the_page_says_what_was_found(fitted: Estimation, text: str) -> None:
    assert "Many starts" in text
    assert "2 of 3 starts end in the best valley" in text
    assert "F: excited up to 20 Hz" in text
    assert "0123456789abcdef 0123456789abcdef" in text
    assert "single shooting" in text
    assert "Beside other fits" in text
    assert "best on held-out samples" in text
    rmse = 1e6 * fitted.rmse("test", 0)["x"]
    assert f"{rmse:.3g} µm" in text


@pytest.mark.long
def test_the_same_fit_is_written_as_the_same_page(fitted: Estimation, tmp_path: Path) -> None:
    file = write_report(fitted, tmp_path / "fit.html")
    assert file.read_text(encoding="utf-8") == page(fitted)
    assert [f.name for f in tmp_path.iterdir()] == ["fit.html"]
    with pytest.raises(UnusableInput, match=r"name it \.html"):
        write_report(fitted, tmp_path / "fit.pdf")


def test_many_starts_bring_their_waterfall(fitted: Estimation) -> None:
    found = many_starts(fitted.study, 4, jobs=1)
    j = judge(found)
    assert j.estimation is found.best
    assert j.material.starts == tuple(found.costs)
    assert waterfall_figure(j).caption.endswith("of 4 starts end in the best valley.")
