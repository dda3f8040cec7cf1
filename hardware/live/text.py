"""The live view as text: a pure function of the state."""

from __future__ import annotations

import math
import unicodedata

import numpy as np
from numpy.typing import NDArray

from hardware.live.state import ChannelState, LiveState, StreamState

_BLOCKS = " \u2581\u2582\u2583\u2584\u2585\u2586\u2587\u2588"
_PLAIN = " .:-=+*#@"
_PREFIXES = {-5: "f", -4: "p", -3: "n", -2: "u", -1: "m", 0: "", 1: "k", 2: "M", 3: "G"}
_WARNINGS = 6
_LABEL = 22


def render(state: LiveState, width: int = 80, *, blocks: bool = True) -> tuple[str, ...]:
    """Return the lines of the view, none longer than the width.

    Parameters
    ----------
    state : LiveState
        What to show.
    width : int
        Columns of the terminal, at least 20.
    blocks : bool
        Whether block characters can be shown; plain ones otherwise.

    Returns
    -------
    tuple of str
        Warnings first, then the output, then every stream with its channels.

    Examples
    --------
    >>> s = StreamState("interferometer", 500, 1000, rate=16000.0)
    >>> for line in render(LiveState("run", 1.0, 1.0, (s,), "parked"), 60, blocks=False):
    ...     print(line)
    run  0:01 elapsed, 0:01 left   output: parked
    interferometer  [########        ] 50 %  500/1000  16.00 kHz
    """
    width = max(20, width)
    lines = [f"! {w}" for w in state.warnings[-_WARNINGS:]]
    if len(state.warnings) > _WARNINGS:
        lines.insert(0, f"! {len(state.warnings) - _WARNINGS} warnings before")
    lines.append(_title(state))
    label = max([len(s.name) for s in state.streams], default=0)
    for s in state.streams:
        lines += _stream(s, min(label, _LABEL), width, blocks)
    return tuple(_cut(line, width) for line in lines)


def one_line(state: LiveState) -> str:
    """Return the state as one line, for files and pipes."""
    parts = [_title(state)]
    for s in state.streams:
        of = f"/{s.total}" if s.total is not None else ""
        against = [f"{s.lost} LOST"] if s.lost else []
        against += [f"{n} {f}" for f, n in s.flags.items()]
        parts.append(f"{s.name} {s.samples}{of}" + (f" ({', '.join(against)})" if against else ""))
    return printable("; ".join(parts))


def printable(line: str) -> str:
    """Return a line of characters that take one column each and control no terminal."""
    if line.isascii() and line.isprintable():
        return line
    return "".join(c if _one_column(c) else "?" for c in line)


def bar(share: float, width: int, *, blocks: bool = True) -> str:
    """Return a bar that is filled by a share, 0 to 1.

    Examples
    --------
    >>> bar(0.5, 4, blocks=False)
    '##  '
    """
    full = round(min(1.0, max(0.0, share)) * width)
    return (_BLOCKS[-1] if blocks else "#") * full + " " * (width - full)


def spark(values: NDArray[np.float64], width: int, *, blocks: bool = True) -> str:
    """Return values as characters of increasing height between their own extremes.

    Parameters
    ----------
    values : ndarray
        (k,), any number; values that are not finite leave a blank.
    width : int
        Characters at most.

    Examples
    --------
    >>> spark(np.array([0.0, 1.0, 2.0, 1.0, 0.0]), 5, blocks=False)
    '.+@+.'
    """
    signs = _BLOCKS if blocks else _PLAIN
    if values.size > width:
        values = values[np.linspace(0, values.size - 1, width).astype(int)]
    good = np.isfinite(values)
    if not np.any(good):
        return " " * int(values.size)
    low, high = float(values[good].min()), float(values[good].max())
    # halved: the span of the largest numbers is none
    span = 0.5 * high - 0.5 * low
    share = (0.5 * np.where(good, values, low) - 0.5 * low) / (span if span > 0.0 else 1.0)
    level = np.where(good, 1 + np.rint((len(signs) - 2) * share), 0)
    return "".join(signs[int(k)] for k in level)


def engineering(value: float, unit: str) -> str:
    """Return a value with four digits and a prefix.

    Examples
    --------
    >>> engineering(4.4231e-6, "m"), engineering(-0.0431, "V"), engineering(0.0, "V")
    ('4.423 um', '-43.10 mV', '0.000 V')
    """
    if not math.isfinite(value):
        return f"- {unit}"
    power = math.floor(math.log10(abs(value)) / 3.0) if value else 0
    if power in _PREFIXES and round(abs(value) / 1000.0**power, 1) >= 1000.0:
        power += 1
    if power not in _PREFIXES or (len(unit) > 1 and not unit.isalpha()):
        return f"{value:.4g} {unit}"
    number = value / 1000.0**power
    digits = 3 if abs(number) < 9.9995 else 2 if abs(number) < 99.995 else 1
    return f"{number:.{digits}f} {_PREFIXES[power]}{unit}"


def _one_column(c: str) -> bool:
    wide = unicodedata.east_asian_width(c) in "WF" or unicodedata.combining(c)
    return c.isprintable() and not wide


def _title(state: LiveState) -> str:
    left = "" if state.left is None else f", {_time(state.left)} left"
    when = f"{_time(state.elapsed)}, ended" if state.ended else f"{_time(state.elapsed)} elapsed"
    output = f"   output: {state.output}" if state.output else ""
    phase = f" ({state.phase})" if state.phase and not state.ended else ""
    return f"{state.name}{phase}  {when}{'' if state.ended else left}{output}"


def _stream(s: StreamState, label: int, width: int, blocks: bool) -> list[str]:
    count, share = f"{s.samples}", ""
    if s.total:
        done = (s.samples + s.lost) / s.total
        room = 16 if width >= 60 else 8
        share = f"[{bar(done, room, blocks=blocks)}] {math.floor(100 * min(1.0, done))} %  "
        count = f"{s.samples}/{s.total}"
    rate = f"  {engineering(s.rate, 'Hz')}" if s.rate > 0.0 else ""
    lines = [f"{_cut(s.name, label):<{label}}  {share}{count}{rate}"]
    against = [f"{s.lost} LOST"] if s.lost else []
    against += [f"{n} {f}" for f, n in s.flags.items()]
    if against:
        lines.append(f"  ! {', '.join(against)}")
    return lines + [_channel(c, width, blocks) for c in s.channels]


def _channel(c: ChannelState, width: int, blocks: bool) -> str:
    span = f"{engineering(c.low, c.unit)} .. {engineering(c.high, c.unit)}"
    text = f"  {c.name:<6} {engineering(c.last, c.unit):>10}  ({span})"
    room = width - max(len(text), 44) - 2
    return f"{text:<44}  {spark(c.recent, min(room, 80), blocks=blocks)}" if room >= 8 else text


def _time(seconds: float) -> str:
    if not math.isfinite(seconds):
        return "?"
    whole = max(0, math.floor(seconds + 0.5))
    minutes, rest = divmod(whole, 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02}" if hours else f"{minutes}:{rest:02}"


def _cut(line: str, width: int) -> str:
    line = printable(line)
    return line if len(line) <= width else line[: width - 1] + "~"
