"""The fitted steering mirror as a bond graph, and its free run over a settled record."""

from __future__ import annotations

import numpy as np

from bondgraph import BondGraph, simulate
from tests.proof.published.mirror_layout import OMEGA
from tests.proof.published.mirror_lines import (
    INPUTS,
    MICRO,
    OUTPUTS,
    ComplexArray,
    FloatArray,
    Lines,
    Spectra,
)
from tests.proof.published.mirror_model import MirrorModel, of_drive
from tests.proof.published.mirror_terms import RATE
from tests.proof.published.models.plays_and_powers import PlaysAndPowers
from tests.proof.published.models.steering_mirror import MirrorValues, steering_mirror


def values_of(model: MirrorModel, p: FloatArray, drive: float) -> MirrorValues:
    """Return the numbers of the bond graph at a relative drive level (see `MirrorModel.drive`).

    A mode counts in units of its static displacement; with forces counted in volts its stiffness
    is that of `Parts`, its mass the stiffness over the squared frequency.
    """
    a, terms, on = model.layout.split(p), model.terms, of_drive(drive)
    damping = np.diag(2.0 * a.zeta * (1.0 + a.slackening @ on) * a.stiffness / a.omega)
    damping += a.dampers @ a.dampers.T / OMEGA
    stiffness = np.diag(a.stiffness * (1.0 - a.softening @ on))
    losses, lost = a.coupling + a.dragging @ on, a.bending @ on
    for (i, j), c, b in zip(model.layout.pairs, losses, lost, strict=True):
        damping[[i, j], [j, i]] += c / OMEGA
        stiffness[[i, j], [j, i]] -= b
    n, v = terms.voltage_count, len(terms.of_voltage)
    drives, rates, springs = [], [], []
    for w in a.memory:
        plays, square, swift = w[:v], w[v], w[v + 1 : n]
        gain = 1.0 - plays @ terms.voltage_gains
        drives.append(
            PlaysAndPowers(
                float(gain), terms.of_voltage, _numbers(plays), (float(square),), apart=1.0
            )
        )
        rates.append(
            PlaysAndPowers(
                -float(swift @ terms.rate_gains), terms.of_rate, _numbers(swift[:-1]),
                signed_square=float(swift[-1]), apart=1.0,
            )
        )  # fmt: skip
        plays, (second, third) = w[n:-2], w[-2:]
        gains = terms.motion_gains
        gain = plays @ gains[:-1] + third * gains[-1]
        powers = (-float(second), -float(third))
        springs.append(PlaysAndPowers(float(gain), terms.of_motion, _numbers(-plays), powers))
    return MirrorValues(
        a.stiffness / a.omega**2, stiffness, damping, a.theta,
        a.phi / MICRO, a.static / MICRO, tuple(drives), tuple(rates), tuple(springs),
    )  # fmt: skip


def graph_of(model: MirrorModel, p: FloatArray, drive: float) -> BondGraph:
    """Return the bond graph at a relative drive level; dead times are left to `free_run`."""
    return steering_mirror(values_of(model, p, drive))


def free_run(
    model: MirrorModel, p: FloatArray, data: Spectra, *, oversampling: int = 8, accuracy: float
) -> ComplexArray:
    """Simulate the bond graph over two periods and return the lines of the last, (3, K), um.

    The commands are periodic and known between samples, so they are given `oversampling` times as
    finely as recorded; the dead times, exact on a periodic signal, are taken on its lines.
    """
    lines = model.lines
    fine = Lines(lines.samples, lines.rate, lines.first, lines.last, oversampling)
    a = model.layout.split(p)
    late = data.u * np.exp(-lines.s * a.late_in[:, None])
    once = np.asarray(fine.in_time(np.concatenate((late, late * lines.s / RATE))), float)
    twice = np.concatenate((once, once), axis=1)
    time = np.arange(twice.shape[1]) / (lines.rate * oversampling)
    commands = dict(zip((*INPUTS, "v1", "v2", "v3"), twice, strict=True))
    commands |= {f"F{o + 1}": np.zeros(time.size) for o in range(3)}
    made = simulate(
        graph_of(model, p, model.drive(data)),
        time,
        commands,
        accuracy=accuracy,
        x0="rest",
        hold="linear",
    )
    y = MICRO * np.stack([made[n][fine.instants :] for n in OUTPUTS])
    made_lines: ComplexArray = fine.on_lines(y) * np.exp(-lines.s * a.late_out[:, None])
    return made_lines


def _numbers(values: FloatArray) -> tuple[float, ...]:
    return tuple(float(v) for v in values)
