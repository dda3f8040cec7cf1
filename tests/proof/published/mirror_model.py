"""Settled response of the steering mirror to a periodic command, and its derivatives.

Modes ``K_m (s^2/w^2 + 2 z s/w + 1) q_m + damping between modes = theta_m (u + h)``; stiffness and
damping, of modes and between them, follow the drive level;
the actuators move by ``x = theta' q``, the sensors read ``phi' q`` and a static part. The voltage
``h`` that memory adds at an actuator is a law of the voltage plus one of `x` (see
`mirror_terms`); the loop through `x` is closed by iteration on the lines.

Sizes: K lines, M modes, D parameters, 3 actuators, 3 sensors.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from bondgraph.support.errors import UnusableInput
from tests.proof.published.mirror_layout import DELAY, OMEGA, Layout, Parts
from tests.proof.published.mirror_lines import ComplexArray, FloatArray, Lines, Spectra
from tests.proof.published.mirror_terms import Terms

ACCURACY = 1e-5
MOST = 40


class Modes(NamedTuple):
    """The linear part at one drive level.

    Attributes
    ----------
    inverse : ndarray, shape (K, M, M)
        Modes from modal forces over modal stiffness.
    ratio : ndarray, shape (M, K)
        ``s / omega``.
    shape : ndarray, shape (K, M, 3)
        Modes from actuators.
    loop : ndarray, shape (K, 3, 3)
        Displacements of the actuators from actuators.
    """

    inverse: ComplexArray
    ratio: ComplexArray
    shape: ComplexArray
    loop: ComplexArray


class Settled(NamedTuple):
    """Steady state under a periodic command.

    Attributes
    ----------
    y, v, x : ndarray, shape (3, K)
        Readings, um; voltages with memory's part, V; displacements of the actuators.
    gain : ndarray, shape (3,)
        Mean gain of the laws of the displacement.
    voltage_terms, motion_terms : ndarray, shape (3, terms, K)
    """

    y: ComplexArray
    v: ComplexArray
    x: ComplexArray
    gain: FloatArray
    voltage_terms: ComplexArray
    motion_terms: ComplexArray


@dataclass(frozen=True)
class MirrorModel:
    """Layout of the parameters, terms of the laws, lines of the data.

    Parameters
    ----------
    layout : Layout
    terms : Terms
    lines : Lines
    reference : float
        Drive level at which all that follows it counts as zero, V.
    """

    layout: Layout
    terms: Terms
    lines: Lines
    reference: float

    def drive(self, data: Spectra) -> float:
        """Return how far the drive level is from the reference, on the scale of its square root.

        Resonances fall less between the two upper levels than between the lower ones, but more
        than with the logarithm (a lower training cost; test errors first suggested it).
        """
        return round(2.0 * (math.sqrt(data.level / self.reference) - 1.0), 2)

    def modes(self, p: FloatArray, drive: float) -> Modes:
        """Return the linear part at a drive level."""
        a, m = self.layout.split(p), self.layout.modes
        ratio = self.lines.s / a.omega[:, None]
        z = np.zeros((self.lines.count, m, m), complex)
        k = np.arange(m)
        on = of_drive(drive)
        loss = 2.0 * a.zeta * (1.0 + a.slackening @ on)
        z[:, k, k] = (1.0 + loss[:, None] * ratio + ratio**2).T - a.softening @ on
        losses, lost = a.coupling + a.dragging @ on, a.bending @ on
        for (i, j), c, b in zip(self.layout.pairs, losses, lost, strict=True):
            mutual = c * self.lines.s / OMEGA - b
            z[:, i, j] += mutual / a.stiffness[i]
            z[:, j, i] += mutual / a.stiffness[j]
        if self.layout.dampers:
            shared = a.dampers @ a.dampers.T / a.stiffness[:, None]
            z += shared * (self.lines.s / OMEGA)[:, None, None]
        inverse: ComplexArray = np.asarray(np.linalg.inv(z), complex)
        shape: ComplexArray = np.asarray(inverse @ a.psi, complex)
        return Modes(inverse, ratio, shape, np.asarray(a.theta.T @ shape, complex))

    def settled(self, p: FloatArray, data: Spectra, modes: Modes | None = None) -> Settled:
        """Return the steady state under the commands of a realisation.

        Raises
        ------
        UnusableInput
            If the loop through the displacements does not settle.
        """
        a = self.layout.split(p)
        modes = self.modes(p, self.drive(data)) if modes is None else modes
        n, s = self.terms.voltage_count, self.lines.s
        late = np.exp(-s * a.late_in[:, None])
        made = self.terms.voltage_terms(self.lines, data.u) * late[:, None]
        command = data.u * late + np.einsum("ib,ibk->ik", a.memory[:, :n], made)
        weights = a.memory[:, n:]
        rest, gain = np.zeros_like(command), np.zeros(3)
        if not weights.any():
            x = _apply(modes.loop, command)
            empty = np.zeros((3, weights.shape[1], s.size), complex)
            return Settled(self._read(a, modes, command), command, x, gain, made, empty)
        for _ in range(MOST):
            x = _apply(np.linalg.solve(np.eye(3) - modes.loop * gain, modes.loop), command + rest)
            motion = self.terms.motion_terms(self.lines, x)
            added = np.einsum("ib,ibk->ik", weights, motion)
            gain = (added * x.conj()).real.sum(1) / (np.abs(x) ** 2).sum(1)
            before, rest = rest, added - gain[:, None] * x
            change = np.sqrt((np.abs(rest - before) ** 2).sum() / (np.abs(command) ** 2).sum())
            if change < ACCURACY:
                v = command + added
                return Settled(self._read(a, modes, v), v, x, gain, made, motion)
            if not np.isfinite(change):
                break
        raise UnusableInput(
            f"{data.name}: the steady state of the mirror was not found; the laws of the "
            "displacement are too strong for these modes: start from smaller weights"
        )

    def _read(self, a: Parts, modes: Modes, v: ComplexArray) -> ComplexArray:
        late = np.exp(-self.lines.s * a.late_out[:, None])
        made: ComplexArray = late * _apply(a.phi.T @ modes.shape + a.static, v)
        return made

    def sensitivities(
        self, p: FloatArray, data: Spectra, modes: Modes
    ) -> tuple[ComplexArray, ComplexArray]:
        """Return the readings, (3, K), and their derivatives, (D, 3, K).

        The laws are differentiated along the settled motion; the loop through the displacements
        is closed with their mean gain and corrected once by what they really do.
        """
        lay, a, s = self.layout, self.layout.split(p), self.lines.s
        now = self.settled(p, data, modes)
        direct = self._direct(p, now, modes, self.drive(data))
        d_y, d_x = direct[:, :3], direct[:, 3:]
        own = np.zeros_like(d_x)
        n = self.terms.voltage_count
        for i in range(3):
            own[lay.at["memory"][i, :n], i] = now.voltage_terms[i]
            own[lay.at["memory"][i, n:], i] = now.motion_terms[i]
        # the dead time acts on what the law of the voltage made, the other law comes after it
        command = now.v - np.einsum("ib,ibk->ik", a.memory[:, n:], now.motion_terms)
        for i in range(3):
            own[lay.at["late_in"][i], i] = -DELAY * s * command[i]
        closed = np.linalg.inv(np.eye(3) - now.gain[:, None] * modes.loop)
        d_v = _apply(closed, own + now.gain[:, None] * d_x)
        if a.memory[:, n:].any():
            touched = self.terms.touched(self.lines, now.x)
            moved = d_x + _apply(modes.loop, d_v)
            true = own + self.terms.followed(self.lines, moved, touched, a.memory)
            d_v += _apply(closed, true - d_v)
        late = np.exp(-s * a.late_out[:, None])
        d_y = late * (d_y + _apply(a.phi.T @ modes.shape + a.static, d_v))
        for o in range(3):
            d_y[lay.at["late_out"][o], o] -= DELAY * s * now.y[o]
        return now.y, d_y

    def _direct(self, p: FloatArray, now: Settled, modes: Modes, drive: float) -> ComplexArray:
        """Return derivatives of readings and displacements at fixed voltages, (D, 6, K)."""
        lay, a, at = self.layout, self.layout.split(p), self.layout.at
        out = np.concatenate((a.phi, a.theta), 1)
        force = np.einsum("mo,kmb->obk", out, modes.inverse)  # outputs from modal forces
        q = _apply(modes.shape, now.v)
        ratio, on = modes.ratio, of_drive(drive)
        made = np.zeros((lay.size, 6, self.lines.count), complex)
        for m in range(lay.modes):
            f, k = force[:, m], a.stiffness[m]
            own = 2.0 * a.zeta[m] * ratio[m] * q[m]
            loss = (1.0 + a.slackening[m] @ on) * own
            made[at["slackening"][m]] = -on[:, None, None] * (f * own)
            made[at["log_omega"][m]] = f * (2.0 * ratio[m] ** 2 * q[m] + loss)
            made[at["log_zeta"][m]] = -f * loss
            made[at["softening"][m]] = on[:, None, None] * (f * q[m])
            made[at["log_stiffness"][m], 3:] = a.theta[m][:, None] * q[m]
            for i in range(3):
                made[at["psi"][m, i]] = f * now.v[i]
                made[at["psi"][m, i], 3 + i] += k * q[m]
                made[at["phi"][m, i], i] = q[m]
        losses, lost = a.coupling + a.dragging @ on, a.bending @ on
        for place, (i, j) in enumerate(lay.pairs):
            first, second = force[:, i] * q[j] / a.stiffness[i], force[:, j] * q[i] / a.stiffness[j]
            mutual = losses[place] * self.lines.s / OMEGA - lost[place]
            made[at["coupling"][place]] = -(first + second) * self.lines.s / OMEGA
            made[at["dragging"][place]] = on[:, None, None] * made[at["coupling"][place]]
            made[at["bending"][place]] = on[:, None, None] * (first + second)
            made[at["log_stiffness"][i]] += mutual * first
            made[at["log_stiffness"][j]] += mutual * second
        if lay.dampers:
            rate = self.lines.s / OMEGA
            pulled = a.dampers.T @ q  # motion of each damper, (Q, K)
            lever = np.einsum("mq,omk->oqk", a.dampers / a.stiffness[:, None], force)
            for m in range(lay.modes):
                f = force[:, m] / a.stiffness[m]
                for d in range(lay.dampers):
                    made[at["dampers"][m, d]] = -rate * (f * pulled[d] + lever[:, d] * q[m])
                made[at["log_stiffness"][m]] += f * rate * (a.dampers[m] @ pulled)
        for o in range(3):
            for i in range(3):
                made[at["static"][o, i], o] = now.v[i]
        return made


def of_drive(drive: float) -> FloatArray:
    """What the two parts of all that follows the drive level count there."""
    return np.array((drive, drive**2))


def _apply(matrix: ComplexArray, vector: ComplexArray) -> ComplexArray:
    """Product line by line: (K, a, b) with (..., b, K) gives (..., a, K)."""
    rows, columns = matrix.shape[1:]
    made = np.zeros((*vector.shape[:-2], rows, vector.shape[-1]), complex)
    for i in range(rows):
        for j in range(columns):
            made[..., i, :] += matrix[:, i, j] * vector[..., j, :]
    return made
