"""The studio: one page that holds all it needs, and answers clicks and brushes in a browser."""

from __future__ import annotations

import base64
import html
import json
import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any
from urllib.error import HTTPError
from urllib.request import Request, urlopen

import numpy as np
import pytest

from bondgraph.signals.recording import Recording
from bondgraph.signals.split import stretches
from bondgraph.support.errors import UnusableInput
from bondsight.cli.studio import MOST, recordings_of, stoppable
from identification.diagnosis.diagnose import Diagnosis, diagnose
from identification.diagnosis.explanation.next_experiment import Experiment
from identification.diagnosis.explanation.recovered import characterised
from identification.diagnosis.report.found import confidence_of, warmth_of
from identification.diagnosis.studio import law_plane, page, write_report
from identification.diagnosis.studio.beside_repair import beside_repair
from identification.diagnosis.studio.content import content
from identification.diagnosis.studio.law_plane import planes
from identification.diagnosis.studio.live import LiveStudio
from identification.diagnosis.studio.packing import embedded, kept, packed, rolling_level
from identification.diagnosis.studio.page import policy
from identification.diagnosis.verdict import verdict as as_data
from identification.diagnosis.verdict import write_verdict
from tests.identification.diagnosis.rubbing_spring import FORCE, T, U, diagnosed
from tests.patience import HANGS
from tests.spring import spring

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
QUIET = (
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
    "--disable-background-networking", "--disable-component-update", "--disable-sync",
    "--window-size=1400,1000",
)  # fmt: skip
browser = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium here")


@pytest.fixture(scope="module")
def found() -> Diagnosis:
    return characterised(diagnosed())


@pytest.fixture(scope="module")
def shown(found: Diagnosis) -> dict[str, Any]:
    return content(found)


def numbers(text: str, kind: str = "<f4") -> Any:
    return np.frombuffer(base64.b64decode(text), kind)


def test_the_recovered_law_is_the_one_that_is_missing(shown: dict[str, Any]) -> None:
    plane = shown["planes"]["of"]["d"]
    assert (plane["xLabel"], plane["yLabel"]) == ("velocity of d (mm/s)", "force (N)")
    v, force = numbers(plane["x"]) / 1e3, numbers(plane["y"])
    fast = np.abs(v) > 0.1
    off = force[fast] - (2.0 * v[fast] + FORCE * np.sign(v[fast]))
    assert np.sqrt(np.mean(off**2)) < 0.25 * FORCE
    nominal = numbers(plane["nominal"]["y"]) / (numbers(plane["nominal"]["x"]) / 1e3)
    assert np.ptp(nominal) < 1e-3 * np.abs(nominal).max()
    on = {law["label"]: law["on"] for law in plane["laws"]}
    assert on["coulomb friction"]
    assert not on["quadratic drag"]
    assert "those of the repaired model" in plane["open"]
    (line,) = (law for law in plane["laws"] if law["label"] == "coulomb friction")
    there, order = numbers(line["x"]) / 1e3, np.argsort(v)
    mean = np.ones(21) / 21
    inner = np.convolve(v[order], mean, "valid"), np.convolve(force[order], mean, "valid")
    along = np.interp(there, *inner) - numbers(line["y"])
    sure = (np.abs(there) > 0.1) & (there > inner[0][0]) & (there < inner[0][-1])
    assert np.sqrt(np.mean(along[sure] ** 2)) < 0.1 * FORCE


def test_planes_of_a_search_on_fewer_samples_than_are_shown(found: Diagnosis) -> None:
    assert found.data is not None
    shown = planes(replace(found, data=found.data.begun(600)))["of"]["d"]
    assert numbers(shown["x"]).size > 600
    assert {law["label"] for law in shown["laws"]} >= {"coulomb friction"}


def test_readings_and_what_is_left_are_the_fits(found: Diagnosis, shown: dict[str, Any]) -> None:
    (reading,) = shown["readings"]
    assert shown["labels"] == ["the model as it is, fitted", "repaired"]
    assert found.data is not None
    assert found.repaired is not None
    left = numbers(reading["left"][1])
    expected = (found.data.readings - found.repaired.simulated)[:, 0] / found.data.floor[0]
    np.testing.assert_allclose(left, expected, rtol=1e-5, atol=1e-5)
    np.testing.assert_allclose(numbers(reading["measured"]), 1e3 * found.data.readings[:, 0], 1e-6)
    before, after = (numbers(c["y"]) for c in reading["correlations"])
    band = reading["correlations"][1]["band"]
    assert np.abs(before).max() > 10 * band
    assert np.mean(np.abs(after) < band) > 0.8


def test_several_recordings_stand_with_their_names(found: Diagnosis) -> None:
    assert found.data is not None
    assert content(found)["files"] == []
    parts = [
        {"name": n, "sha256": "", "samples": k}
        for n, k in (("slow", 200), ("fast", found.data.n - 200))
    ]
    joined = replace(found.recording, meta={**found.recording.meta, "parts": parts})
    slow, fast = content(replace(found, recording=joined))["files"]
    time = found.data.time
    assert (slow["name"], slow["from"], slow["to"]) == ("slow", time[0], time[199])
    assert (fast["name"], fast["from"], fast["to"]) == ("fast", time[200], time[-1])


def test_a_law_is_not_drawn_with_an_offset_that_it_took_over(
    found: Diagnosis, monkeypatch: pytest.MonkeyPatch
) -> None:
    def shifted(*given: Any) -> Any:
        own = beside_repair(*given)
        return own if own is None else replace(own, output=own.output + 40 * FORCE)

    monkeypatch.setattr(law_plane, "_imitated", lambda *_: (0,))
    monkeypatch.setattr(law_plane, "beside_repair", shifted)
    plane = planes(found)["of"]["d"]
    points, line = numbers(plane["y"]), numbers(plane["nominal"]["y"])
    assert points.min() < line.mean() < points.max()
    assert "drawn at the level of the points" in plane["open"]
    monkeypatch.setattr(law_plane, "_imitated", lambda *_: ())
    plane = planes(found)["of"]["d"]
    assert numbers(plane["nominal"]["y"]).max() < numbers(plane["y"]).min()


def test_the_misfit_by_the_state_of_a_port_is_high_before_and_noise_after(
    shown: dict[str, Any],
) -> None:
    port = shown["ports"]["d"]
    assert (port["of"], port["xLabel"]) == ("x", "position of d (mm)")
    before, after = (numbers(m["mean"]) for m in port["maps"])
    assert before.size == after.size == 20 * 14
    known = np.isfinite(before)
    np.testing.assert_array_equal(known, np.isfinite(after))
    assert np.median(before[known]) > 10
    assert np.sqrt(0.5) < np.median(after[known]) < np.sqrt(2)
    for p in port["profiles"]:
        worse, well = (numbers(c["y"]) for c in p["curves"])
        assert (worse**2 > 10 * well**2).all()


def test_regions_keep_the_numbers_of_the_list(found: Diagnosis, shown: dict[str, Any]) -> None:
    assert [r["number"] for r in shown["regions"]] == list(range(1, len(shown["regions"]) + 1))
    listed = re.search(
        "Where in the recording the model fails</h2>(.*?)</section>", page(found), re.S
    )
    assert listed is not None
    for r in shown["regions"]:
        assert html.escape(r["words"]) in listed.group(1)


def test_every_held_out_stretch_is_there(found: Diagnosis, shown: dict[str, Any]) -> None:
    assert found.data is not None
    split = found.data.split
    wanted = {float(T[s.start]) for p in (split.test, split.looked_at) for s in stretches(p)}
    assert {p["from"] for p in shown["parts"]} == wanted
    assert len({p["words"] for p in shown["parts"]}) == 2


def test_it_is_equally_warm_where_the_data_cannot_tell(found: Diagnosis) -> None:
    assert warmth_of(found) == pytest.approx(confidence_of(found))
    (step,) = found.findings
    assert step.chosen is not None
    other = replace(step.chosen, insertion=replace(step.chosen.insertion, element="k"))
    both = replace(found, steps=(replace(step, same_place=(other,)), *found.steps[1:]))
    warm = warmth_of(both)
    assert warm["d"] == warm["k"]
    assert 0.9 < warm["d"] + warm["k"] <= 1.0


def test_the_next_experiment_is_drawn(found: Diagnosis) -> None:
    ramp = np.linspace(0.0, 2.0, 50)
    slow = Experiment("sweep slowly", "sweep", 6.2, 1.0, 50, 1.0, ("a", "b"), {"F": ramp})
    (made, *_) = content(replace(found, experiments=(slow, slow, slow)))["experiments"]
    (command,) = made["commands"]
    assert (command["name"], command["unit"]) == ("F", "N")
    np.testing.assert_allclose(numbers(command["y"]), ramp, rtol=1e-6)
    assert made["dt"] == pytest.approx(0.01)


def test_a_long_trace_keeps_its_peaks() -> None:
    y = np.zeros(100_000)
    y[[777, 50_001]] = 5.0, -7.0
    at = kept(y.size, 1000, y)
    assert at.size <= 1010
    assert {777, 50_001, 0, y.size - 1} <= set(at.tolist())
    assert kept(10, 100, y[:10]).size == 10
    np.testing.assert_array_equal(numbers(packed([1.5, np.nan])), [1.5, np.nan])


def test_a_level_is_the_one_that_texts_tell(found: Diagnosis) -> None:
    assert found.data is not None
    assert found.left is not None
    (reading,) = content(found)["readings"]
    before, after = reading["levels"]
    assert after == found.left.over_noise["x"]
    worse = numbers(reading["left"][0])[found.data.mask("held-out")]
    assert before == pytest.approx(np.sqrt(np.mean(worse**2)), rel=1e-5)
    size = f"what is left is {after:.3g} times the noise"
    assert size in str(found)
    assert as_data(found)["remaining"]["x"]["over_noise"] == pytest.approx(after, abs=1e-4)
    assert f"{size} {found.data.floor[0]:.3g} m" in str(found)


def test_sizes_are_of_all_samples_not_of_the_drawn_extremes(found: Diagnosis) -> None:
    assert found.data is not None
    whole, thin = content(found)["readings"][0], content(found, 0.01)["readings"][0]
    assert numbers(thin["measured"]).size < 0.5 * found.data.n == 600
    assert thin["levels"] == whole["levels"]
    for strip, left in zip(thin["strips"], whole["left"], strict=True):
        every = numbers(left)
        assert numbers(strip).size == 800
        ends = [np.sqrt(np.mean(every[:4] ** 2)), np.sqrt(np.mean(every[-4:] ** 2))]
        np.testing.assert_allclose(numbers(strip)[[0, -1]], ends, rtol=1e-4)


def test_noise_of_one_is_one_in_the_strip() -> None:
    r = np.random.default_rng(0).standard_normal(100_000)
    r[500:502] = np.nan, 1e9
    r[50_000] = np.inf
    at = np.array([0, 20_000, 50_000, 99_999])
    np.testing.assert_allclose(rolling_level(r, at)[1:], 1.0, atol=0.1)
    assert np.isnan(rolling_level(np.full(20, np.nan), at[:1])[0])


def test_names_of_a_user_stay_text(found: Diagnosis) -> None:
    bad = "</script><script>alert(1)</script><img src=http://x.example/y>"
    made = page(replace(found, model=bad, recording=replace(found.recording, name=bad)))
    assert bad not in made
    assert "<img" not in made
    assert len(re.findall("<script", made)) == 2
    assert json.loads(embedded(bad)) == bad


def test_nothing_is_known_of_a_model_in_a_rest(found: Diagnosis) -> None:
    assert found.data is not None
    split = replace(found.data.split, rest=slice(0, 40))
    rested = replace(found, data=replace(found.data, split=split))
    (reading,) = content(rested)["readings"]
    for left in reading["left"]:
        known = np.isfinite(numbers(left))
        assert not known[:40].any()
        assert known[40:].all()
    assert np.isfinite(numbers(reading["measured"])).all()


def test_nothing_in_the_page_points_out_of_it(found: Diagnosis, tmp_path: Path) -> None:
    made = write_report(found, tmp_path).read_text("utf-8")
    assert "default-src 'none'" in made
    assert "the same diagnosis gives the same page" in made
    places = re.findall(r"""(?:src|href|action)\s*=\s*["']([^"']*)|url\(([^)]*)\)""", made)
    assert all(a.startswith("#") or b.startswith("#") or not (a or b) for a, b in places)
    data = made.split('id="data">')[1].split("</script>")[0]
    assert len(made) - len(data) < 250_000


def test_without_a_fit_only_the_words_are_there() -> None:
    still = Recording("still", T[:50], {"F": U[:50], "x": 0 * U[:50]}, {"F": "N", "x": "m"})
    empty = diagnose(spring(), still)
    assert content(empty)["readings"] == []
    assert "What was recorded" in page(empty)


def test_the_recording_of_a_verdict_is_found_by_its_hash(found: Diagnosis, tmp_path: Path) -> None:
    assert found.data is not None
    x = found.data.readings[:, 0]
    lines = [f"{t:.2f},{u!r},{v!r}" for t, u, v in zip(T, U.tolist(), x.tolist(), strict=True)]
    file = tmp_path / "under_another_name.csv"
    file.write_text("\n".join(["t[s],F[N],x[m]", *lines]), "utf-8")
    (tmp_path / "other.csv").write_text("t[s],F[N],x[m]\n", "utf-8")
    out = tmp_path / "out"
    write_verdict(replace(found, recording=Recording.read(file), seed=3), out)
    assert recordings_of(out) == ([str(file)], 3)
    for k in range(MOST):
        (out / f"a_{k}.csv").write_text("")  # many files in one folder hide none in another
    other = file.rename(tmp_path / "under_another_name.TXT")
    assert recordings_of(out) == ([str(other)], 3)
    other.unlink()
    with pytest.raises(UnusableInput, match="give the recording itself"):
        recordings_of(out)


def test_it_tells_steps_while_they_are_made_and_then_the_page() -> None:
    with LiveStudio() as live:
        waiting = urlopen(live.address, timeout=HANGS).read().decode()
        assert "connect-src 'self'" in waiting
        live("fitting </b>", 0.25)
        with urlopen(f"{live.address}events", timeout=HANGS) as stream:
            assert stream.readline() == b"event: step\n"
            assert json.loads(stream.readline().removeprefix(b"data: ")) == ["fitting </b>", 0.25]
            live.finish("<p>made</p>")
            assert b"event: made" in stream.read()
        assert urlopen(live.address, timeout=HANGS).read() == b"<p>made</p>"
        stop = f"{live.address}stop"
        with pytest.raises(HTTPError):
            urlopen(Request(stop, b"", {"Origin": "http://evil.example"}), timeout=HANGS)
        told = stoppable(live)
        told("fitting a at b", 0.3)
        urlopen(Request(stop, b"", {"Origin": live.address.rstrip("/")}), timeout=HANGS)
        told("writing up", 0.95)  # what is found is kept
        with pytest.raises(KeyboardInterrupt):
            told("fitting a at b", 0.3)
        for path, headers in (("", {"Host": "evil.example"}), ("etc/passwd", {})):
            with pytest.raises(HTTPError):
                urlopen(Request(live.address + path, headers=headers), timeout=HANGS)


@pytest.fixture(scope="module")
def tried(found: Diagnosis, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    folder = tmp_path_factory.mktemp("studio")
    file, made = folder / "tried.html", page(found)
    own = re.findall("<script>(.*?)</script>", made, re.DOTALL)[-1]
    more = own + (Path(__file__).parent / "studio_tried.js").read_text("utf-8")
    # the same policy holds: only the hash of the one script is another
    file.write_text(made.replace(own, more).replace(policy(own), policy(more)), "utf-8")
    assert CHROMIUM is not None
    done = subprocess.run(
        [CHROMIUM, *QUIET, f"--user-data-dir={folder / 'profile'}", "--dump-dom",
         file.as_uri()],
        capture_output=True, text=True, timeout=HANGS, check=True,
    )  # fmt: skip
    said = re.search('<pre id="selftest">(.*?)</pre>', done.stdout, re.DOTALL)
    assert said is not None
    answer: dict[str, Any] = json.loads(html.unescape(said.group(1)))
    assert "error" not in answer, answer
    return answer


@browser
def test_each_element_that_is_clicked_shows_a_curve_with_points(tried: dict[str, Any]) -> None:
    assert set(tried["elements"]) == {"F", "m", "d", "k", "x"}
    for name, e in tried["elements"].items():
        assert e["chosen"] == name
        assert e["points"] > 500
        assert e["lines"] >= 1
        assert e["drawn"] > 1000
    assert tried["hatched"] == 1


@browser
def test_brushing_joins_recording_and_plane(tried: dict[str, Any]) -> None:
    begin, end = tried["view"][:2]
    quarter = 0.25 * (end - begin)
    runs = tried["brushedTime"]["runs"]
    assert runs[0][0] == pytest.approx(begin + quarter, abs=0.05)
    assert runs[-1][1] == pytest.approx(begin + 2 * quarter, abs=0.05)
    assert tried["brushedTime"]["count"] == pytest.approx(300, abs=5)
    # half of a plane that is crossed to and fro is many stretches of time
    assert len(tried["brushedPlane"]["runs"]) > 8
    assert 300 < tried["brushedPlane"]["count"] < 900
    assert tried["cleared"] == 0


@browser
def test_keys_walk_and_zoom_and_a_law_is_switched(tried: dict[str, Any]) -> None:
    assert tried["walked"] > 0
    assert tried["zoomed"][1] - tried["zoomed"][0] < 0.9 * (tried["view"][1] - tried["view"][0])
    assert tried["switched"]
    assert 0 < tried["lower"] < 0.7
    assert tried["slightly"] == [True, False]  # a slight bend is shown less its line
    (usual, none), (beside, one), (two_levels, no) = tried["edges"]
    assert (none, one, no) == (0, 1, 0)  # one spike does not flatten the rest; half of all is none
    assert beside == pytest.approx(usual, rel=0.05)
    assert two_levels > 500
    assert max(tried["widths"]) > min(tried["widths"])
    assert "Coulomb friction is missing" in tried["said"]
    assert min(tried["ports"]) > 1000
    model = r"the model as it is, fitted: \S+ mm"
    assert re.match(rf"x at \S+ s – measured: \S+ mm; {model}; repaired: \S+ mm$", tried["at"])


@browser
def test_no_request_leaves_the_page(tried: dict[str, Any]) -> None:
    assert tried["fetched"] == []
    assert tried["refused"] == []
    assert tried["wide"] <= 0
