"""From numbers to words: what is fine, what is not, what to try."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from identification.experiments.frequency import DistortionLevel
from identification.report.numbers import quantity, short, times_noise
from identification.report.words import listed
from identification.statistics.whiteness import EITHER
from identification.validation.channel import ChannelJudgement
from identification.validation.distortion import Separated
from identification.validation.parameter_remarks import parameter_remarks
from identification.validation.remark import Remark, Weight, fault, fine, note
from identification.validation.validation_data import ValidationData

NOTICED = 0.05
# share of the residual power below which a significant pattern is too small to act on


NEAR = 1.5
# mean square over a floor that was itself estimated: white noise of that size is no misfit


def remarks(
    material: ValidationData,
    channels: tuple[ChannelJudgement, ...],
    separated: tuple[Separated, ...] = (),
) -> tuple[Remark, ...]:
    """Return all remarks, faults first, then notes, then what is fine."""
    found = [*_far(channels, material), *_ending(material), *map(note, material.notes)]
    for c in channels:
        where = material.label(c.channel, c.record)
        for said in (_level, _gap, _memory, _timing, _inputs):
            found += said(c, where)
    for s in separated:
        found += _distortion(s, material)
    found += parameter_remarks(material)
    order = (Weight.FAULT, Weight.NOTE, Weight.FINE)
    return tuple(sorted(found, key=lambda r: order.index(r.weight)))


FAR = 5.0
"""Times the noise from which nothing else that is said of a fit means much."""


def _far(channels: tuple[ChannelJudgement, ...], m: ValidationData) -> Iterator[Remark]:
    over = [
        (times_noise(c.judged.chi2), m.label(c.channel, c.record)) for c in channels if c.judged.n
    ]
    worst = sorted((o for o in over if o[0] >= FAR), reverse=True)
    if worst:
        told = listed([f"{short(times, 3)} times that of {name}" for times, name in worst[:3]])
        yield fault(
            f"the fit ended far above the noise, {told}: either the model lacks something, or the "
            "fit ended in a valley from which no small step leads down (dry friction, stops and "
            "plays make many)",
            "begin where a diagnosis ends (diagnose(study).study), from many_starts(study, 32) or "
            "from study.starting({NAME: VALUE}); where all end as far above, the model lacks "
            "something, which a diagnosis names",
            LEADS,
        )


LEADS = "far above the noise"
"""Such a fit in a few words."""


def _ending(m: ValidationData) -> Iterator[Remark]:
    if m.status and not m.status.startswith("converged"):
        yield fault(
            f"the fit did not converge: {m.status}",
            "judge nothing else before it has: raise the iterations, or give other starts",
        )


def _level(c: ChannelJudgement, where: str) -> Iterator[Remark]:
    e = c.judged
    if not e.n:
        yield fault(f"{where}: no sample is scored", "check the split")
        return
    rmse, floor = quantity(e.rmse, e.unit, 3), quantity(e.floor, e.unit, 3)
    part, times = "held-out" if c.test.n else "training", short(times_noise(e.chi2), 3)
    said = f"{where}: {part} error {rmse} rms, noise floor {floor}"
    if not c.test.n:
        yield note(
            f"{where}: nothing is held out, so nothing says how the model does elsewhere",
            "hold out a part of the record or a whole record",
        )
    if e.misread:
        yield note(
            f"{said}: {times} times the floor: it was read too high, as off a command with steps, "
            "and clears nothing",
            "state what is known: noise={SENSOR: VALUE}; repeated periods, or a stretch at rest, "
            "tell it too",
        )
    elif e.chi2 < 0.6:
        yield note(
            f"{said}: {times} times the floor: no fault of the model, its errors are below what "
            "was taken for noise",
            "the floor is stated too high; a stretch at rest or repeated periods tell the noise",
        )
    elif e.at_floor:
        yield fine(f"{said}: at the floor ({times} times)")
    elif e.chi2 <= NEAR and _nothing_left(c):
        yield note(
            f"{said}: {times} times the floor, yet white and independent of the "
            "inputs: noise a little above the floor as it was estimated",
            "a floor measured at rest would be surer",
        )
    elif c.order and c.inputs and _nothing_left(c):
        yield note(
            f"{said}: {times} times the floor, but coloured noise: the inputs do "
            "not show in it, and its noise model leaves it white",
            "a floor measured at rest would tell noise from slow physics",
        )
    else:
        yield fault(
            f"{said}: {times} times the floor, {e.fit:.4g} % fit",
            "something is missing in the model; the correlations below say where to look, "
            "and a diagnosis names it",
        )


def _near(c: ChannelJudgement) -> bool:
    """Whether what is left is so little, or so plainly noise, that it can clear an input."""
    e = c.judged
    if e.at_floor or e.chi2 <= NEAR:
        return True
    return times_noise(e.chi2) < FAR and c.order > 0 and _nothing_left(c)


def _nothing_left(c: ChannelJudgement) -> bool:
    """Whether the residual has no memory and no input shows in it."""
    white = c.white is not None and c.white.white
    return white and not any(x.causal or x.anticausal for x in c.inputs)


def _gap(c: ChannelJudgement, where: str) -> Iterator[Remark]:
    a, b = c.train, c.test
    if not (a.n and b.n) or not a.chi2 > 0:
        return
    low, high = b.chi2_ci[0], a.chi2_ci[1]
    sure = low > high if np.isfinite(low) and np.isfinite(high) else b.chi2 > 2 * a.chi2
    if sure and b.chi2 >= 1.5 * max(a.chi2, 1.0):
        times = short(times_noise(b.chi2 / a.chi2), 2)
        yield fault(
            f"{where}: the held-out error is {times} times that of training",
            "either the fit follows noise (fix or bound parameters, add data), or the held-out "
            "part goes where the training did not (other amplitudes, rates, temperature)",
        )


ALLOWED = (
    "widened intervals (robust) allow for such noise, but not for a law that is slightly wrong"
)
"""What intervals make of residuals with a memory; a diagnosis says the same."""


def _memory(c: ChannelJudgement, where: str) -> Iterator[Remark]:
    w = c.white
    part = "training" if c.train.n else "held-out"
    if w is None:
        yield note(f"{where}: too few {part} samples to judge the residual")
        return
    freed = f", freed of its noise model of order {c.order}," if c.order else ""
    what = f"{where}: the {part} residual{freed} is"
    if w.white:
        yield fine(f"{what} white: noise without a pattern in time (p = {w.p:.2g})")
    elif w.predictable < NOTICED:
        yield note(f"{what} {w.words}: too little to act on")
    elif c.train.misread:
        yield note(
            f"{what} {w.words}: {EITHER}; what follows an input below is no noise",
            f"noise='coloured', which fits the colour too; {ALLOWED}",
        )
    elif c.train.at_floor:
        yield note(
            f"{what} {w.words}, yet no larger than the floor: {EITHER}",
            f"noise='coloured', which fits the colour too ({w.effective:.0f} of {w.n} samples "
            f"count); {ALLOWED}",
        )
    else:
        yield fault(
            f"{what} {w.words}",
            "a diagnosis: dynamics or a drift are missing, and no interval allows for that "
            f"(noise of that colour would count as {w.effective:.0f} of {w.n} samples)",
        )


def _timing(c: ChannelJudgement, where: str) -> Iterator[Remark]:
    t = c.timing
    if t is not None and not t.words.startswith("delay, gain and offset"):
        yield fault(
            f"{where}: {t.words}",
            "free a delay, the gain of the sensor or its offset, or correct the channel's time "
            "and calibration",
        )


def _distorts(level: DistortionLevel) -> float:
    """Size of the distortion that noise does not explain, as `left`."""
    odd = level.odd if level.odd_certain else 0.0
    even = level.even if level.even_certain else 0.0
    return float(np.nan_to_num(max(odd, even)))


def _distortion(s: Separated, m: ValidationData) -> Iterator[Remark]:
    """Where the drive repeats: is the residual noise, and does the plant distort."""
    for name in s.reading.outputs:
        level, left = s.reading.level(name), s.left(name)
        if not (np.isfinite(left) and level.linear > 0 and level.noise > 0):
            continue
        said = f"{m.label(name, s.record)}: {s.words(name).removeprefix(f'{name}: ')}"
        if left <= 1.5 * level.noise:
            yield fine(said)
        elif _distorts(level) > 0.1 * left:
            yield fault(
                f"{said}: the plant distorts, and the residual repeats with the drive",
                "a nonlinear law: odd distortion is friction, hysteresis or hardening, even "
                "distortion something that tells the two directions apart",
            )
        else:
            yield fault(
                f"{said}: the residual repeats with the drive, without distortion",
                "linear dynamics are missing: a mode, a delay, a wrong order",
            )


def _inputs(c: ChannelJudgement, where: str) -> Iterator[Remark]:
    for x in c.inputs:
        if not (x.causal or x.anticausal):
            if _near(c):
                yield fine(f"{where}: the residual is {x.words}: no effect of {x.input} is missing")
            else:
                # the test is of straight lines: a large rest may still be a law of the input
                yield note(
                    f"{where}: not judged whether an effect of {x.input} is missing: what is left "
                    f"is {short(times_noise(c.judged.chi2), 3)} times the noise"
                )
            continue
        part = "held-out" if c.part == "test" else "training"
        said = f"{where}: the {part} residual {x.words}"
        if c.judged.at_floor and not c.judged.misread:
            yield note(f"{said}; all of it below the noise floor")
        else:
            advice = "free or add what links them (a mode, a law, a delay), or diagnose the model"
            if x.anticausal and not x.causal:
                advice = "check whether the input was controlled by this reading, and the time base"
            yield fault(said, advice)
