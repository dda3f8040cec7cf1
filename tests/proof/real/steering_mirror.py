"""Fine steering mirror below its resonances: three springs with a force source each."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bondgraph import TF, BondGraph, C, Dq, I, One, R, Se, Zero
from bondgraph.signals.recording import Recording, Split
from identification.datasets import LoadedRecording
from tests.proof.real.case import RealCase, Truth
from tests.proof.real.preparing import apart, noted

__all__ = ["CASES", "below_resonance", "three_linear_axes"]

FloatArray = NDArray[np.float64]

PERIOD = 8192
FACTOR = 8
BAND = 160.0
"""Hz; a quarter of the first resonance, and a fifth of the new rate: commands are near straight
between samples."""
AXES = ("1", "2", "3")
LEVELS = ("100mV", "200mV", "300mV")


def three_linear_axes() -> BondGraph:
    """Return three actuators and three sensors: commands ``u1..u3`` (V), readings ``y1..y3`` (m).

    Each actuator is a force source, counted in volts, on a spring with a mass and a damper; as
    the sensors do not sit on the actuators, each reads all three through ratios of its own. Start
    values put a resonance at 800 Hz and 3 um to a volt.
    """
    with BondGraph("three_linear_axes") as g:
        actuators = [One(f"actuator_{a}") for a in AXES]
        for a, actuator in zip(AXES, actuators, strict=True):
            Se(f"u{a}", unit="V") >> actuator
            actuator >> I(f"m_{a}", 4e-8)
            actuator >> R(f"d_{a}", 1e-4)
            actuator >> C(f"k_{a}", stiffness=1.0, fixed=True)
        for s in AXES:
            tip, seen = One(f"tip_{s}"), Zero(f"seen_{s}")
            for a, actuator in zip(AXES, actuators, strict=True):
                start = 3e-6 if s == a else 1e-6
                # metres for a unit of the actuator, whose effort is counted in volts
                share = g.parameter(f"n_{s}_{a}", start, positive=False, scale=1e-6)
                actuator >> TF(f"s_{s}_{a}", ratio=share) >> seen
            seen >> tip >> Dq(f"y{s}", unit="m")
    return g


def below_resonance(recording: Recording) -> Recording:
    """Return a settled record of whole periods without what resonates, at an eighth of the rate.

    Periodic signals are cut in frequency without any edge. Lines of the excitation above `BAND`
    are taken out of every channel; what lies between the lines is noise and stays, so that the
    top of the new spectrum still shows the noise floor.
    """
    kept = recording.n // FACTOR
    lines = np.arange(kept // 2 + 1)
    excited = lines % (recording.n // PERIOD) == 0
    high = lines * recording.fs / recording.n > BAND
    stay = ~(excited & high)
    stay[-1] = False  # half of this line belongs to the frequencies above

    def cut(values: FloatArray) -> FloatArray:
        return np.asarray(np.fft.irfft(np.fft.rfft(values)[: lines.size] * stay / FACTOR, kept))

    channels = {k: cut(v) for k, v in recording.channels.items()}
    made = replace(recording, time=recording.time[::FACTOR], channels=channels)
    return noted(
        made,
        f"excited lines above {BAND:g} Hz are taken out of commands and readings, then "
        f"{made.fs:g} Hz; the noise between lines stays",
    )


_joined = apart(
    "steering_mirror", 1, "two levels train, the third one judges; of each the settled period"
)


def _prepared(*levels: Recording) -> LoadedRecording:
    """Join settled periods, each from a state of its own; what settles is not scored."""
    period = PERIOD // FACTOR
    recording, split = _joined(*(below_resonance(level) for level in levels))
    recording = replace(recording, meta={**recording.meta, "period": period})
    begins = (0, *recording.meta["breaks"])
    *train, test = (slice(first + period, first + 2 * period) for first in begins)
    return LoadedRecording(recording, Split(tuple(train), (test,), split.rule, score_from=period))


_PLACES = tuple(f"{kind}{a}" for kind in ("k_", "u", "d_", "m_") for a in AXES)
_WHY = "gain and distortion grow with level; the owners state hysteresis of the actuators"


def _case(level: str) -> RealCase:
    return RealCase(
        name=f"steering_mirror_{level}",
        dataset="steering_mirror",
        parts=(*(f"train/{other}_1" for other in LEVELS if other != level), f"test/{level}"),
        prepare=_prepared,
        model=three_linear_axes,
        truth=(
            Truth("hysteresis", _PLACES, _WHY),
            Truth("creep", _PLACES, "piezo ceramics creep with their hysteresis; same family"),
            Truth(
                "added_mode", (*_PLACES, *(f"y{a}" for a in AXES)),
                "the linear reference has order 28: modes above the band show in it as well",
            ),
        ),
        kinds=("memory", "slow", "mode"),
        comment=(
            "lines below 160 Hz, a quarter of the first resonance; the floor read off 320 to 400 "
            "Hz agrees with the difference between periods within a factor of three"
        ),
    )  # fmt: skip


CASES = (_case("300mV"), _case("100mV"), _case("200mV"))
