"""Streams cut where samples are missing."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hardware.storage.flag_runs import FlagRun, flag_runs
from hardware.storage.stream import StreamData


@dataclass(frozen=True, slots=True, eq=False)
class Piece:
    """Consecutive samples without a gap.

    Parameters
    ----------
    streams : tuple of str
        Where they come from.
    first : int
        Number of the first sample in its stream.
    channels : mapping of str to ndarray
        (n,) each, finite.
    units : mapping of str to str
        As stored.
    flags : tuple of FlagRun
        In sample numbers of the piece.
    remarks : tuple of str
        What is missing around it.
    """

    streams: tuple[str, ...]
    first: int
    channels: Mapping[str, NDArray[np.float64]]
    units: Mapping[str, str]
    flags: tuple[FlagRun, ...]
    remarks: tuple[str, ...]

    @property
    def n(self) -> int:
        """Number of samples."""
        return int(next(iter(self.channels.values())).size)


def joined(data: Mapping[str, StreamData]) -> dict[str, StreamData]:
    """Return streams of one clock with the sample numbers that all of them have."""
    first, *others = data.values()
    common = first.numbers
    for s in others:
        common = np.intersect1d(common, s.numbers)
    out = {}
    for name, s in data.items():
        at = np.isin(s.numbers, common)
        channels = {k: v[at] for k, v in s.channels.items()}
        out[name] = StreamData(s.layout, s.numbers[at], channels, s.flags[at], s.repeated)
    return out


def pieces(data: Mapping[str, StreamData]) -> tuple[Piece, ...]:
    """Cut streams with equal sample numbers at gaps and at samples that are not finite.

    A channel without any finite value is left out.
    """
    columns: dict[str, NDArray[np.float64]] = {}
    units: dict[str, str] = {}
    remarks: list[str] = []
    taken = [k for s in data.values() for k in s.channels]
    for stream, s in data.items():
        for k, v in s.channels.items():
            if s.n and not np.any(np.isfinite(v)):
                remarks.append(f"stream {stream}: channel {k} left out, it has no finite value")
                continue
            name = k if taken.count(k) == 1 else f"{k}_{stream}"
            columns[name], units[name] = v, s.layout.units[k]
        if s.lost:
            gaps = s.gaps
            remarks.append(
                f"stream {stream}: {s.lost} samples are missing in {len(gaps)} gaps, the first "
                f"from sample {gaps[0].first} to {gaps[0].last}"
            )
        if s.repeated:
            remarks.append(f"stream {stream}: {s.repeated} samples that came twice were left out")
    if not columns:
        return ()
    numbers = next(iter(data.values())).numbers
    good = np.all([np.isfinite(v) for v in columns.values()], axis=0)
    if not np.all(good):
        remarks.append(f"{int(np.sum(~good))} samples left out, a value is not finite")
    kept = np.flatnonzero(good)
    bounds = np.concatenate(([0], np.flatnonzero(np.diff(numbers[kept]) != 1) + 1, [kept.size]))
    return tuple(
        Piece(
            tuple(data),
            int(numbers[kept[a]]),
            {k: v[kept[a:b]] for k, v in columns.items()},
            units,
            flag_runs({n: s.flags[kept[a:b]] for n, s in data.items()}),
            tuple(remarks),
        )
        for a, b in itertools.pairwise(bounds)
        if b > a
    )
