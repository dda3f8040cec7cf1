"""From numbers to words: what is fine, what is not, what to try."""

from __future__ import annotations

import numpy as np

from identification.diagnosis.report.numbers import quantity, short
from identification.experiments.frequency import DistortionLevel
from identification.validation.channel import ChannelJudgement
from identification.validation.distortion import Separated
from identification.validation.parameter_remarks import parameter_remarks
from identification.validation.remark import Remark, Weight
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
    found = _ending(material) + [Remark(Weight.NOTE, n) for n in material.notes]
    several = len(material.records) > 1
    for c in channels:
        where = f"{c.channel} of {c.record}" if several else c.channel
        found += _level(c, where) + _gap(c, where) + _memory(c, where)
        found += _timing(c, where) + _inputs(c, where)
    for s in separated:
        found += _distortion(s, several)
    found += parameter_remarks(material)
    order = (Weight.FAULT, Weight.NOTE, Weight.FINE)
    return tuple(sorted(found, key=lambda r: order.index(r.weight)))


def _ending(m: ValidationData) -> list[Remark]:
    if not m.status or m.status.startswith("converged"):
        return []
    return [
        Remark(
            Weight.FAULT,
            f"the fit did not converge: {m.status}",
            "judge nothing else before it has: raise the iterations, or give other starts",
        )
    ]


def _level(c: ChannelJudgement, where: str) -> list[Remark]:
    e = c.judged
    if not e.n:
        return [Remark(Weight.FAULT, f"{where}: no sample is scored", "check the split")]
    rmse, floor = quantity(e.rmse, e.unit, 3), quantity(e.floor, e.unit, 3)
    part, times = "held-out" if c.test.n else "training", short(float(np.sqrt(e.chi2)), 3)
    said = f"{where}: {part} error {rmse} rms, noise floor {floor}"
    found = []
    if not c.test.n:
        found.append(
            Remark(
                Weight.NOTE,
                f"{where}: nothing is held out, so nothing says how the model does elsewhere",
                "hold out a part of the record or a whole record",
            )
        )
    if e.chi2 < 0.6:
        found.append(
            Remark(
                Weight.NOTE,
                f"{said}: below the floor (mean square {e.chi2:.2g} of it)",
                "the floor is stated too high; measure it from a rest or from repeated periods",
            )
        )
    elif e.at_floor:
        found.append(Remark(Weight.FINE, f"{said}: at the floor (mean square {e.chi2:.3g} of it)"))
    elif e.chi2 <= NEAR and _nothing_left(c):
        found.append(
            Remark(
                Weight.NOTE,
                f"{said}: {times} times the floor, yet white and independent of the "
                "inputs: noise a little above the floor as it was estimated",
                "a floor measured at rest would be surer",
            )
        )
    elif _only_noise(c):
        found.append(
            Remark(
                Weight.NOTE,
                f"{said}: {times} times the floor, but coloured noise: the inputs do "
                "not show in it, and its noise model leaves it white",
                "a floor measured at rest would tell noise from slow physics",
            )
        )
    else:
        found.append(
            Remark(
                Weight.FAULT,
                f"{said}: {times} times the floor, {e.fit:.4g} % fit",
                "something is missing in the model; the correlations below say where to look, "
                "and a diagnosis names it",
            )
        )
    return found


def _nothing_left(c: ChannelJudgement) -> bool:
    """Whether the residual has no memory and no input shows in it."""
    white = c.white is not None and c.white.white
    return white and not any(x.causal or x.anticausal for x in c.inputs)


def _only_noise(c: ChannelJudgement) -> bool:
    """Whether a noise model was fitted, whitens the residual, and no input shows in it."""
    return bool(c.order and c.inputs and _nothing_left(c))


def _gap(c: ChannelJudgement, where: str) -> list[Remark]:
    a, b = c.train, c.test
    if not (a.n and b.n) or not a.chi2 > 0:
        return []
    low, high = b.chi2_ci[0], a.chi2_ci[1]
    sure = low > high if np.isfinite(low) and np.isfinite(high) else b.chi2 > 2 * a.chi2
    if not sure or b.chi2 < 1.5 * max(a.chi2, 1.0):
        return []
    times = short(b.chi2 / a.chi2, 2)
    return [
        Remark(
            Weight.FAULT,
            f"{where}: the held-out mean square is {times} times that of training",
            "either the fit follows noise (fix or bound parameters, add data), or the held-out "
            "part goes where the training did not (other amplitudes, rates, temperature)",
        )
    ]


def _memory(c: ChannelJudgement, where: str) -> list[Remark]:
    w = c.white
    part = "training" if c.train.n else "held-out"
    if w is None:
        return [Remark(Weight.NOTE, f"{where}: too few {part} samples to judge the residual")]
    what = f"the {part} residual"
    if c.order:
        what = f"the {part} residual, freed of its noise model of order {c.order},"
    if w.white:
        return [Remark(Weight.FINE, f"{where}: {what} is white (p = {w.p:.2g})")]
    said = f"{where}: {what} is {w.words}"
    if w.predictable < NOTICED:
        return [Remark(Weight.NOTE, f"{said}: too little to act on")]
    if c.train.at_floor:
        return [
            Remark(
                Weight.NOTE,
                f"{said}, yet no larger than the floor: the noise itself has memory",
                f"count {w.effective:.0f} of {w.n} samples; intervals must be made for coloured "
                "noise (noise='coloured')",
            )
        ]
    return [
        Remark(
            Weight.FAULT,
            said,
            f"dynamics or a drift are missing; meanwhile intervals hold for {w.effective:.0f} of "
            f"{w.n} samples (noise='coloured')",
        )
    ]


def _timing(c: ChannelJudgement, where: str) -> list[Remark]:
    t = c.timing
    if t is None or t.words.startswith("delay, gain and offset"):
        return []
    return [
        Remark(
            Weight.FAULT,
            f"{where}: {t.words}",
            "free a delay, the gain of the sensor or its offset, or correct the channel's time "
            "and calibration",
        )
    ]


def _distorts(level: DistortionLevel) -> float:
    """Size of the distortion that noise does not explain, as `left`."""
    odd = level.odd if level.odd_certain else 0.0
    even = level.even if level.even_certain else 0.0
    return float(np.nan_to_num(max(odd, even)))


def _distortion(s: Separated, several: bool) -> list[Remark]:
    """Where the drive repeats: is the residual noise, and does the plant distort."""
    found = []
    for name in s.reading.outputs:
        level, left = s.reading.level(name), s.left(name)
        if not (np.isfinite(left) and level.linear > 0 and level.noise > 0):
            continue
        said = f"{name} of {s.record}: {s.words(name).removeprefix(f'{name}: ')}"
        said = said if several else s.words(name)
        if left <= 1.5 * level.noise:
            found.append(Remark(Weight.FINE, said))
        elif _distorts(level) > 0.1 * left:
            found.append(
                Remark(
                    Weight.FAULT,
                    f"{said}: the plant distorts, and the residual repeats with the drive",
                    "a nonlinear law: odd distortion is friction, hysteresis or hardening, even "
                    "distortion something that tells the two directions apart",
                )
            )
        else:
            found.append(
                Remark(
                    Weight.FAULT,
                    f"{said}: the residual repeats with the drive, without distortion",
                    "linear dynamics are missing: a mode, a delay, a wrong order",
                )
            )
    return found


def _inputs(c: ChannelJudgement, where: str) -> list[Remark]:
    found = []
    for x in c.inputs:
        if not (x.causal or x.anticausal):
            found.append(Remark(Weight.FINE, f"{where}: the residual is {x.words}"))
            continue
        part = "held-out" if c.part == "test" else "training"
        said = f"{where}: the {part} residual {x.words}"
        if c.judged.at_floor:
            found.append(Remark(Weight.NOTE, f"{said}; all of it below the noise floor"))
        else:
            advice = "free or add what links them (a mode, a law, a delay), or diagnose the model"
            if x.anticausal and not x.causal:
                advice = "check whether the input was controlled by this reading, and the time base"
            found.append(Remark(Weight.FAULT, said, advice))
    return found
