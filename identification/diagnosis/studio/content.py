"""What the studio shows of a diagnosis, as plain data: readings, parts, planes, ports."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from bondgraph.signals.split import stretches
from bondgraph.support.arrays import Array
from bondgraph.support.errors import BondsightError
from identification.diagnosis.diagnose import Diagnosis
from identification.diagnosis.evidence.remaining import level_of
from identification.diagnosis.explanation.next_experiment import Experiment
from identification.diagnosis.localisation.recording.bands import spectrum
from identification.diagnosis.report.found import places_of, regions_of, warmth_of
from identification.diagnosis.report.places import region_words
from identification.diagnosis.report.views import Curve, curves, level_unit_of, residual, scored
from identification.diagnosis.studio.law_plane import planes
from identification.diagnosis.studio.packing import kept, packed, rolling_level
from identification.diagnosis.studio.port_misfit import port_misfits
from identification.diagnosis.verdict import sentence
from identification.diagnosis.verdict.document import parts_of
from identification.report.numbers import axis_scale
from identification.report.traces import thin_log
from identification.statistics.correlation import autocorrelation, pieces_of
from identification.study.data import Data

SAMPLES = 50_000
"""Samples of a reading in the page at most; of longer records smallest and largest are kept."""
STRIP = 800
"""Points of the strip of the mismatch at most: four in each of its windows."""
LAGS = 60
DRAWN = 2
"""Experiments whose inputs are in the page."""


def content(d: Diagnosis, share: float = 1.0) -> dict[str, Any]:
    """Return the page's data; without a fit only the words.

    Parameters
    ----------
    share : float
        Of the points that a whole page has at most.
    """
    marked, also = places_of(d)
    said = {
        "verdict": sentence(d),
        "missing": list(marked) if d.kind == "missing_physics" else [],
        "places": [*marked, *also],
        "warmth": {n: float(p) for n, p in warmth_of(d).items()},
        "experiments": [_experiment(d, e, drawn=k < DRAWN) for k, e in enumerate(d.experiments)],
    }
    if d.nominal is None or d.data is None:
        return said | {"readings": []}
    data, shown = d.data, curves(d)
    left = [[_left(c, k, data) for c in shown] for k in range(len(data.names))]
    keep = kept(data.n, round(share * SAMPLES), *(r[0] for r in left))
    strip = np.unique(np.linspace(0, data.n - 1, min(data.n, STRIP)).round().astype(int))
    return said | {
        "time": packed(data.time[keep], "<f8"),
        "stripTime": packed(data.time[strip], "<f8"),
        "samples": int(data.n),
        "labels": [c.label for c in shown],
        "parts": _parts(data),
        "files": _files(d, data),
        "regions": [
            {
                "number": k, "kind": r.kind, "from": r.low, "to": r.high, "of": r.channel,
                "words": region_words(r),
            }
            for k, r in enumerate(regions_of(d), start=1)
        ],
        "readings": [
            _reading(d, data, k, shown, left[k], keep, strip) for k in range(len(data.names))
        ],
        "planes": planes(d, share),
        "ports": port_misfits(d),
    }  # fmt: skip


def _experiment(d: Diagnosis, e: Experiment, *, drawn: bool) -> dict[str, Any]:
    """Return an experiment in words and numbers, and what its sources do."""
    moving = {n: u for n, u in e.commands.items() if np.ptp(u) > 0} if drawn else {}
    return {
        "words": e.words,
        "now": float(e.now_z),
        "then": float(e.expected_z),
        "rivals": list(e.rivals),
        "dt": float(d.data.dt) if d.data is not None else 0.0,
        "commands": [
            {"name": n, "unit": level_unit_of(d, n), "y": packed(u)} for n, u in moving.items()
        ],
    }


def _left(c: Curve, column: int, data: Data) -> Array:
    """Residual over the noise on the samples of the record; a thinned fit is drawn out.

    In a rest that is not scored a model's state may be any: nothing is known there.
    """
    own = c.fit.problem.data
    y = c.fit.simulated[:, column]
    if own.n != data.n:
        y = np.interp(data.time, own.time, y)
    left = np.asarray((data.readings[:, column] - y) / data.floor[column])
    for part in stretches(data.split.rest or ()):
        left[part] = np.nan
    return left


def _parts(data: Data) -> list[dict[str, Any]]:
    """Every stretch that took no part in a fit, and why."""
    found = []
    for part, word in (
        (data.split.test, "held out, seen by no choice"),
        (data.split.looked_at, "held out, choices looked at it"),
        (data.split.rest or (), "not scored: no command moves"),
    ):
        for s in stretches(part):
            a, b, _ = s.indices(data.n)
            if b > a:
                ends = {"from": float(data.time[a]), "to": float(data.time[b - 1])}
                found.append({"words": word, **ends})
    return sorted(found, key=lambda p: p["from"])


def _files(d: Diagnosis, data: Data) -> list[dict[str, Any]]:
    """Return where each of several recordings lies on the page, and its name."""
    parts = parts_of(d.recording)
    stops = np.cumsum([part["samples"] for part in parts])
    if not parts or stops[-1] != data.n:
        return []
    begins = (0, *stops[:-1])
    return [
        {"name": part["name"], "from": float(data.time[a]), "to": float(data.time[b - 1])}
        for part, a, b in zip(parts, begins, stops, strict=True)
    ]


def _reading(
    d: Diagnosis, data: Data, k: int, shown: tuple[Curve, ...], left: list[Array], keep: Array,
    strip: Array,
) -> dict[str, Any]:  # fmt: skip
    """Return the traces at `keep`; what is said of their size is of all samples."""
    name, y = data.names[k], data.readings[:, k]
    levels = [_levels(d, c) for c in shown]
    factor, unit = axis_scale(level_unit_of(d, name), float(np.nanmax(np.abs(y), initial=0.0)))
    return {
        "name": name,
        "label": f"{name} ({unit})" if unit else name,
        "unit": unit,
        "noise": float(factor * data.floor[k]),
        "measured": packed(factor * y[keep]),
        "left": [packed(r[keep]) for r in left],
        "levels": [own.get(name) for own in levels],
        "strips": [packed(rolling_level(r, strip)) for r in left],
        "spectra": [_spectrum(c, k) for c in shown],
        "correlations": [_correlation(c, k) for c in shown],
    }


def _levels(d: Diagnosis, c: Curve) -> Mapping[str, float | None]:
    """Return what is left of each reading over its noise on all held-out samples, as texts say."""
    if d.left is not None and c.fit is (d.repaired or d.nominal):
        found = d.left.over_noise
    else:
        level = level_of(c.fit, "held-out")
        found = dict(zip(c.fit.problem.data.names, map(float, level), strict=True))
    return {n: v if np.isfinite(v) else None for n, v in found.items()}


def _spectrum(c: Curve, column: int) -> dict[str, str]:
    """Amplitude of what is left over the noise's, by frequency."""
    own = c.fit.problem.data
    r = residual(c.fit, column)[scored(own)]
    r = r[np.isfinite(r)]
    if r.size < 64:
        return {"x": "", "y": ""}
    f, power = spectrum(r, float(own.floor[column]), own.dt)
    f, a = thin_log(f, np.sqrt(power), 200)
    return {"x": packed(f), "y": packed(np.maximum(a, 1e-3))}


def _correlation(c: Curve, column: int) -> dict[str, Any]:
    """Autocorrelation on all scored samples and the band that white noise keeps to 95 %."""
    own = c.fit.problem.data
    usable = own.mask("train") | own.mask("held-out")
    try:
        pieces = pieces_of(residual(c.fit, column), usable)
    except BondsightError:
        return {"y": "", "band": 0.0}
    n = sum(p.size for p in pieces)
    return {"y": packed(autocorrelation(pieces, LAGS)[1:]), "band": 1.96 / float(np.sqrt(n))}
