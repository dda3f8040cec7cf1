"""The live view: what is counted, how it reads, where it goes, what it costs."""

from __future__ import annotations

import io
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.image import imread

from bondgraph.support.errors import UnusableInput
from hardware.contracts import Chunk, Flag
from hardware.live import (
    ChannelState,
    Gathering,
    LiveState,
    LiveView,
    Snapshot,
    StreamState,
    Watching,
    one_line,
    render,
)
from hardware.live.snapshot import draw
from hardware.live.text import engineering, spark
from tests.counted import calls


class Hand:
    """A clock moved by hand."""

    def __init__(self) -> None:
        self.time = 100.0

    def now(self) -> float:
        return self.time

    def sleep(self, seconds: float) -> None:
        self.time += seconds


class Terminal(io.StringIO):
    encoding = "utf-8"

    def isatty(self) -> bool:
        return True


def samples(first: int, n: int, flag: Flag = Flag.GOOD, stream: str = "sensor") -> Chunk:
    numbers = np.arange(float(first), float(first + n))
    flags = np.zeros(n, np.uint16)
    flags[-1] = flag
    channels = {"x": 1e-6 * numbers, "instant": numbers}
    return Chunk(stream, first, channels, {"x": "m", "instant": "s"}, flags)


def gathered(clock: Hand, total: int = 4000) -> Gathering:
    return Gathering("run", clock, {"sensor": total}, rates={"sensor": 1000.0}, window=0.24)


def test_counts_extremes_rate_and_time_left() -> None:
    clock = Hand()
    g = gathered(clock)
    for k in range(20):
        g.take(samples(100 * k, 100))
        clock.sleep(0.1)
    state = g.state()
    (s,) = state.streams
    (x,) = s.channels
    assert (s.samples, s.total, s.lost, dict(s.flags)) == (2000, 4000, 0, {})
    assert s.rate == pytest.approx(1000.0)
    assert (x.last, x.low, x.high) == pytest.approx((1999e-6, 0.0, 1999e-6))
    assert np.allclose(x.recent, 1e-6 * np.arange(2000 - 240, 2000))
    assert state.elapsed == pytest.approx(2.0)
    assert state.left == pytest.approx(2.0)
    assert state.warnings == ()


def test_flags_and_losses_warn_once() -> None:
    g = gathered(Hand())
    g.take(samples(0, 10, Flag.LEVEL_LOW))
    assert bool(g.urgent)
    g.take(samples(15, 10, Flag.LEVEL_LOW | Flag.BEAM_LOST))
    g.take(samples(30, 10))
    state = g.state()
    assert not bool(g.urgent)
    (s,) = state.streams
    assert (s.lost, s.samples, dict(s.flags)) == (10, 30, {"BEAM_LOST": 1, "LEVEL_LOW": 2})
    assert state.warnings == (
        "sensor: LEVEL_LOW from sample 9 on",
        "sensor: samples are lost, the first of them 10",
        "sensor: BEAM_LOST from sample 24 on",
    )
    text = "\n".join(render(state, 100))
    assert "! 10 LOST, 1 BEAM_LOST, 2 LEVEL_LOW" in text
    assert text.startswith("! sensor: LEVEL_LOW")
    assert "10 LOST" in one_line(state)


def test_values_that_are_not_finite_do_not_spoil_the_extremes() -> None:
    g = gathered(Hand())
    g.take(Chunk("sensor", 0, {"x": np.array([np.nan, 2.0, np.inf])}, {"x": "m"}))
    g.take(Chunk("sensor", 3, {"x": np.array([np.nan])}, {"x": "m"}))
    g.take(Chunk("sensor", 4, {"x": np.zeros(0)}, {"x": "m"}))
    (x,) = g.state().streams[0].channels
    assert (x.low, x.high) == (2.0, 2.0)
    assert np.isnan(x.last)
    assert any("- m" in line for line in render(g.state(), 80))


@settings(max_examples=50, deadline=None)
@given(st.lists(st.integers(1, 700), min_size=1, max_size=20), st.floats(10.0, 1e6))
def test_the_picture_does_not_depend_on_the_chunks(sizes: list[int], rate: float) -> None:
    parts = Gathering("run", Hand(), {}, rates={"sensor": rate})
    whole = Gathering("run", Hand(), {}, rates={"sensor": rate})
    first = 0
    for n in sizes:
        parts.take(samples(first, n))
        first += n
    whole.take(samples(0, first))
    a, b = (g.state().streams[0].channels[0] for g in (parts, whole))
    assert np.array_equal(a.recent, b.recent)
    assert (a.low, a.high, a.last) == (b.low, b.high, b.last)


def test_the_text_as_a_whole() -> None:
    wave = np.sin(np.linspace(0.0, 2 * np.pi, 24))
    s = StreamState(
        "interferometer", 8000, 16000, 0, 16000.0,
        (ChannelState("x", "m", 2.2e-6, -1e-9, 4.4e-6, wave),), {},
    )  # fmt: skip
    state = LiveState("run", 65.0, 3600.0, (s,), "driving, 43.1 V", ("mind the laser",))
    assert render(state, 80, blocks=False) == (
        "! mind the laser",
        "run  1:05 elapsed, 1:00:00 left   output: driving, 43.1 V",
        "interferometer  [########        ] 50 %  8000/16000  16.00 kHz",
        "  x        2.200 um  (-1.000 nm .. 4.400 um)  " + spark(wave, 33, blocks=False),
    )
    assert "\u2588" in "".join(render(state, 80))


@settings(max_examples=60, deadline=None)
@given(
    st.integers(1, 200), st.text(max_size=30), st.lists(st.text(max_size=200), max_size=9),
    st.floats(), st.booleans(),
)  # fmt: skip
def test_no_line_is_too_long_nor_controls_the_terminal(
    width: int, name: str, warnings: list[str], value: float, blocks: bool
) -> None:
    c = ChannelState(name, "V", value, value, value, np.array([value, 0.0]))
    s = StreamState(name, 3, 0, 1, value, (c,), {name: 1})
    state = LiveState(name, value, value, (s,), name, tuple(warnings))
    for line in (*render(state, width, blocks=blocks), one_line(state)):
        assert line.isprintable()
        assert len(line) <= max(20, width) or line == one_line(state)


@given(st.floats(1e-14, 9.99e11), st.sampled_from([1.0, -1.0]))
def test_prefixes_keep_four_digits(size: float, sign: float) -> None:
    number, unit = engineering(sign * size, "m").split()
    scale = {"f": 1e-15, "p": 1e-12, "n": 1e-9, "u": 1e-6, "m": 1e-3, "k": 1e3, "M": 1e6, "G": 1e9}
    prefix = unit[:-1]
    assert float(number) * scale.get(prefix, 1.0) == pytest.approx(sign * size, rel=6e-4)
    assert abs(float(number)) <= 1000.0


def test_a_terminal_is_rewritten_in_place(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "70")
    monkeypatch.setenv("LINES", "10")
    out = Terminal()
    view = LiveView(out, every=0.0)
    state = LiveState("run", 1.0, None, (StreamState("a", 1), StreamState("b", 2)))
    view.show(state)
    view.show(replace(state, ended=True))
    text = out.getvalue()
    assert text.count("\x1b[3F") == 1
    assert text.count("\x1b[J") == 2
    assert all(len(line) < 70 + 10 for line in text.split("\n"))
    assert text.endswith("\n\x1b[J")


def test_a_pipe_gets_plain_lines_now_and_then() -> None:
    out = io.StringIO()
    view = LiveView(out)
    state = LiveState("run", 1.0, 2.0, (StreamState("a", 1, 4),))
    view.show(state)
    view.show(replace(state, elapsed=1.5))
    view.show(replace(state, warnings=("odd",)))
    view.show(replace(state, warnings=("odd",), ended=True))
    assert out.getvalue().splitlines() == [
        "run  0:01 elapsed, 0:02 left; a 1/4",
        "! odd",
        "run  0:01 elapsed, 0:02 left; a 1/4",
        "run  0:01, ended; a 1/4",
    ]
    assert not view.due


def test_quiet_is_silent_and_a_closed_terminal_ends_nothing() -> None:
    out = io.StringIO()
    view = LiveView(out, quiet=True)
    view.show(LiveState("run", 1.0, warnings=("odd",), ended=True))
    assert (out.getvalue(), view.due) == ("", False)
    gone = io.StringIO()
    view = LiveView(gone)
    gone.close()
    view.show(LiveState("run", 1.0))
    view.show(LiveState("run", 2.0, ended=True))


@dataclass(frozen=True)
class Told:
    phase: str
    late: int = 0
    chunks: tuple[Chunk, ...] = ()


def test_reports_are_counted_and_shown() -> None:
    out = io.StringIO()
    clock = Hand()
    watch = Watching(gathered(clock), LiveView(out, plain_every=1e9))
    watch(Told("prepare"))
    watch(Told("play", 0, (samples(0, 100), samples(100, 50))))
    watch(Told("play", 3, (samples(150, 50, Flag.BEAM_LOST),)))
    watch.gathering.output = "parked"
    watch(Told("end"))
    watch.close("the cable is gone")
    lines = out.getvalue().splitlines()
    assert lines[0] == "run (prepare)  0:00 elapsed, 0:04 left; sensor 0/4000"
    assert lines[1:3] == [
        "! sensor: BEAM_LOST from sample 199 on",
        "! output: samples came late, see the flag LATE",
    ]
    assert "output: parked" in lines[4]
    assert lines[-2] == "! the cable is gone"
    assert "sensor 200/4000 (1 BEAM_LOST)" in lines[-1]
    nothing = Watching(gathered(clock))
    nothing(Told("play", 0, (samples(0, 10),)))
    assert nothing.gathering.state().streams[0].samples == 0


def test_pictures_are_whole_and_faults_do_not_come_out(tmp_path: Path) -> None:
    path = tmp_path / "live.png"
    g = gathered(Hand())
    g.take(samples(0, 500, Flag.LEVEL_LOW))
    g.warn("a price of $3 and $4")
    picture = Snapshot(path)
    watch = Watching(g, None, picture)
    watch.close()
    assert picture.error == ""
    data = path.read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    assert data[-8:-4] == b"IEND"
    assert list(tmp_path.iterdir()) == [path]
    folder = tmp_path / "gone"
    folder.mkdir()
    picture = Snapshot(folder / "live.png")
    folder.rmdir()
    picture.show(g.state())
    picture.close()
    assert "cannot be written" in picture.error
    for bad in ("live.jpg", "no/live.png"):
        with pytest.raises(UnusableInput):
            Snapshot(tmp_path / bad)


def test_quadrature_is_drawn_as_a_figure_of_its_own(tmp_path: Path) -> None:
    turn = np.linspace(0.0, 2.0 * np.pi, 240)

    def shown(*names: str) -> tuple[int, int]:
        """Return coloured pixels in the right third, and how high they stand."""
        values = {"x": 1e-6 * turn, "cos": np.cos(turn), "sin": 0.8 * np.sin(turn)}
        channels = tuple(ChannelState(n, "1", 0.0, -1.0, 1.0, values[n]) for n in names)
        state = LiveState("run", 1.0, 1.0, (StreamState("i", 240, 240, channels=channels),))
        draw(state, tmp_path / "live.png")
        picture = imread(tmp_path / "live.png")[:, :, :3]
        blue = (picture[:, :, 2] - picture[:, :, 0])[:, 2 * picture.shape[1] // 3 :] > 0.3
        rows = np.flatnonzero(blue.any(axis=1))
        return int(blue.sum()), int(np.ptp(rows)) if rows.size else 0

    assert shown("x", "cos")[1] < shown("x", "cos", "sin")[1]
    dots, high = shown("cos", "sin")
    assert dots > 100
    assert high > 50


def test_a_refresh_costs_as_much_late_as_early_and_for_many_samples_as_for_few() -> None:
    clock = Hand()
    g = Gathering("run", clock, {"sensor": 10**6, "output": 10**6}, rates={"sensor": 16000.0})
    view = LiveView(Terminal(), every=0.0)
    costs, first = [], 0
    for k in range(60):
        n = 320 if k % 2 else 3200
        chunks = [samples(first, n), samples(first, n, stream="output")]
        first += n
        clock.sleep(n / 16000.0)

        def work(chunks: list[Chunk] = chunks) -> None:
            for c in chunks:
                g.take(c)
            view.show(g.state())

        costs.append(calls(work))
    assert max(costs) < 3000
    assert max(costs[-20:]) < 1.1 * max(costs[20:40])
