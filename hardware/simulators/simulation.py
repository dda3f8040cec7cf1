"""From command to undisturbed readings: drive, plant, channels.

The converter interpolates linearly between samples (first-order hold).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hardware.simulators.arrays import Array
from hardware.simulators.effects import HiddenEffect
from hardware.simulators.excitation import SAMPLE_RATE
from hardware.simulators.integrator import MarchedPath, SteppedSystem, march
from hardware.simulators.nonsmooth import DryFrictionPlant, MaxwellSlipPlant
from hardware.simulators.plant import (
    BIAS,
    CreepingPlant,
    LaggedPlant,
    LinearPlant,
    PlantParameters,
    PolynomialPlant,
)

SUBSTEPS = 20
"""Steps of the integrator per sample, besides those at the kinks of the drive."""


@dataclass(frozen=True, slots=True)
class Readings:
    """Channels before noise and offset.

    Parameters
    ----------
    x, i
        Displacement from the first sample (m) and current (A), ``(N,)``.
    path
        Everything at the nodes of the integrator.
    """

    x: Array
    i: Array
    path: MarchedPath


def simulate(
    plant: PlantParameters,
    effect: HiddenEffect,
    command: Array,
    *,
    substeps: int = SUBSTEPS,
    energy: bool = False,
) -> Readings:
    """Give the readings of the bench for a command, without noise.

    Parameters
    ----------
    plant
        True parameters.
    effect
        Concealed effect.
    command
        Voltage at the samples (V), ``(N,)``.
    substeps
        Steps per sample.
    energy
        Whether to keep the energy ledger.
    """
    n = command.size
    at_x = _reading_instants(n, effect, "x")
    at_i = _reading_instants(n, effect, "i")
    nodes = _nodes(command, effect, substeps, at_x, at_i)
    drive = _drive(command, effect, nodes)
    path = march(
        make_system(plant, effect, float(drive[0])),
        np.diff(nodes) / SAMPLE_RATE,
        drive,
        energy=energy,
    )
    x = path.x[np.searchsorted(nodes, at_x)]
    i = path.i[np.searchsorted(nodes, at_i)]
    return Readings(
        x=sense(x - x[0], effect, "x"),
        i=sense(i, effect, "i"),
        path=path,
    )


def sense(reading: Array, effect: HiddenEffect, channel: str) -> Array:
    """Apply static curve and drift of a channel, if the effect sits there."""
    if effect.place != channel:
        return reading
    if effect.name == "sensor_nonlinearity":
        s2, s3 = effect.value("s2"), effect.value("s3")
        return reading + reading**2 * (s2 + s3 * reading)
    if effect.name == "sensor_drift":
        s = np.arange(reading.size) / max(reading.size - 1, 1)
        return reading + effect.value("linear") * s + effect.value("bow") * np.sin(np.pi * s)
    return reading


def _reading_instants(n: int, effect: HiddenEffect, channel: str) -> Array:
    """Instants (samples) whose state a channel reports."""
    late = effect.value("samples") if (effect.name, effect.place) == ("delay", channel) else 0.0
    return np.asarray(np.maximum(np.arange(n) - late, 0.0), dtype=np.float64)


def _nodes(command: Array, effect: HiddenEffect, substeps: int, *extra: Array) -> Array:
    """Nodes of the integrator in samples: even steps, kinks of the drive, reading instants."""
    n = command.size
    base = (np.arange(n - 1)[:, None] + np.arange(substeps) / substeps).ravel()
    parts = [base, np.array([n - 1.0]), *extra]
    if effect.place == "V_in":
        if effect.name == "delay":
            parts.append(np.arange(n) + effect.value("samples"))
        parts += [_crossings(command, level) for level in _knees(effect)]
    nodes = np.unique(np.concatenate(parts))
    return np.asarray(nodes[nodes <= n - 1.0])


def _knees(effect: HiddenEffect) -> tuple[float, ...]:
    """Command voltages at which the amplifier's static curve has a corner."""
    if effect.name == "saturation":
        return (effect.value("bottom"), effect.value("top"))
    if effect.name == "dead_zone":
        return (BIAS - effect.value("width"), BIAS + effect.value("width"))
    return ()


def _crossings(command: Array, level: float) -> Array:
    """Instants (samples) at which the interpolated command crosses a level."""
    a, b = command[:-1] - level, command[1:] - level
    k = np.flatnonzero(a * b < 0.0)
    return np.asarray(k + a[k] / (a[k] - b[k]))


def _drive(command: Array, effect: HiddenEffect, nodes: Array) -> Array:
    """Voltage behind the amplifier's static curve and dead time at the nodes (V)."""
    instants = np.arange(command.size, dtype=float)
    if (effect.name, effect.place) == ("delay", "V_in"):
        return np.asarray(np.interp(nodes - effect.value("samples"), instants, command))
    return static_drive(np.interp(nodes, instants, command), effect)


def static_drive(u: Array, effect: HiddenEffect) -> Array:
    """Apply the static curve of the amplifier (V), if the effect is one."""
    if effect.name == "saturation":
        held = np.clip(u, effect.value("bottom"), effect.value("top"))
        return np.asarray(held + effect.value("slope") * (u - held))
    if effect.name == "dead_zone":
        width = effect.value("width")
        return np.asarray(u - np.clip(u - BIAS, -width, width))
    return np.asarray(u)


def make_system(plant: PlantParameters, effect: HiddenEffect, u: float) -> SteppedSystem:
    """Give the equations of the plant with the effect in its place, at rest at `u` (V)."""
    match effect.name:
        case "hysteresis":
            return MaxwellSlipPlant(
                plant, effect.place, effect.series("radius"), effect.series("gain"), u
            )
        case "creep":
            return CreepingPlant(
                plant, effect.place, effect.series("ratio"), effect.series("tau"), u
            )
        case "coulomb_friction":
            return DryFrictionPlant(plant, effect.value("F_c"), effect.value("F_c"), u_start=u)
        case "stribeck_friction":
            return DryFrictionPlant(
                plant, effect.value("F_c"), effect.value("F_s"), effect.value("v_s"), u
            )
        case "quadratic_drag":
            return PolynomialPlant(plant, drag=effect.value("b2"), u_start=u)
        case "nonlinear_stiffness" if effect.place == "k":
            return PolynomialPlant(
                plant, spring=(effect.value("k2"), effect.value("k3")), u_start=u
            )
        case "nonlinear_stiffness":
            return PolynomialPlant(
                plant, dielectric=(effect.value("c2"), effect.value("c3")), u_start=u
            )
        case "low_pass":
            return LaggedPlant(plant, effect.value("tau"), u)
    return LinearPlant(plant, u)
