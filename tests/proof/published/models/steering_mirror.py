"""A mirror on three piezo actuators, seen by three displacement sensors, as modes of a structure.

Sizes: M modes, 3 actuators, 3 sensors.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bondgraph import TF, BondGraph, C, Dq, I, One, R, Se, Zero
from bondgraph.graph.drives import Drive
from bondgraph.support.arrays import FloatArray
from bondgraph.support.errors import UnusableInput
from tests.proof.published.models.plays_and_powers import PlaysAndPowers

FAR = 1e-3
"""Share of an actuator's force that the modes far above the band take: its square is what they
give back to the actuator's motion, which is neglected."""

ROUNDING = 1e-12
"""Springs and dampers smaller than this, of scaled matrices, count as none."""

QUICK = 1e-6
"""Time constant of those modes, s."""


@dataclass(frozen=True, eq=False)
class MirrorValues:
    """Numbers of the model; the force of an actuator is counted in volts (a gauge).

    Parameters
    ----------
    mass : ndarray, shape (M,)
    stiffness, damping : ndarray, shape (M, M)
        Symmetric: springs and dampers between modes as well.
    actuators : ndarray, shape (M, 3)
        Modal force for a volt, and displacement of the actuator for a unit of the mode.
    sensors : ndarray, shape (M, 3)
        Reading, m, for a unit of the mode.
    static : ndarray, shape (3, 3)
        Reading by modes far above the band, m/V, sensor by actuator.
    drives, rates : tuple of PlaysAndPowers
        Laws of each voltage and of its rate.
    springs : tuple of PlaysAndPowers
        Voltage lost over displacement, for each actuator.
    """

    mass: FloatArray
    stiffness: FloatArray
    damping: FloatArray
    actuators: FloatArray
    sensors: FloatArray
    static: FloatArray
    drives: tuple[PlaysAndPowers, ...]
    rates: tuple[PlaysAndPowers, ...]
    springs: tuple[PlaysAndPowers, ...]


def steering_mirror(values: MirrorValues) -> BondGraph:
    """Return the mirror: commands ``u1..u3`` (V), readings ``y1..y3`` (m).

    The rate of a command is a second input ``v1..v3`` (see `rates`), because a law of it is not a
    law of the command; loads ``F1..F3`` on the points that the sensors see are inputs too.

    Each actuator is a voltage that passes a law with memory, in series with a spring that has a
    law with memory too; the sum pushes every mode through a transformer, and the same transformer
    gives the actuator its motion (reciprocity). Modes have masses, and springs and dampers between
    them: each acts along an eigenvector of the scaled matrix.
    Sensors add the modes through transformers of their own, as they do not sit on the actuators;
    nothing loads them.

    Raises
    ------
    UnusableInput
        If a matrix is not symmetric, or not positive: the structure would feed itself.
    """
    springs, dampers = _along(values.stiffness, "spring"), _along(values.damping, "damper")
    modes = range(values.mass.size)
    with BondGraph("steering_mirror") as g:
        body = [One(f"mode_{m + 1}") for m in modes]
        for m in modes:
            body[m] >> I(f"m_{m + 1}", float(values.mass[m]), unit="kg")
            for kind, (sizes, shares) in (("spring", springs), ("damper", dampers)):
                if not sizes[m]:
                    continue
                element = Zero(f"of_{kind}_{m + 1}")
                if kind == "spring":
                    element >> C(f"k_{m + 1}", stiffness=float(sizes[m]), unit="N/m")
                else:
                    element >> R(f"d_{m + 1}", float(sizes[m]), unit="N*s/m")
                for j, share in enumerate(shares[:, m]):
                    if share:
                        body[j] >> _shape(g, f"{kind}_{m + 1}_{j + 1}", share) >> element
        far = [One(f"far_{i + 1}") for i in range(3)]
        for i, node in enumerate(far):
            node >> C(f"k_far_{i + 1}", stiffness=1.0, unit="N/m")
            node >> R(f"d_far_{i + 1}", QUICK, unit="N*s/m")
        for i in range(3):
            drive = Drive(law=values.drives[i])
            rod, pull = One(f"actuator_{i + 1}"), Zero(f"pull_{i + 1}")
            Se(f"u{i + 1}", unit="V", drive=drive) >> rod
            Se(f"v{i + 1}", unit="V", drive=Drive(law=values.rates[i])) >> rod
            rod >> C(f"h_{i + 1}", law=values.springs[i])
            rod >> pull
            for m in modes:
                body[m] >> _shape(g, f"b_{i + 1}_{m + 1}", -values.actuators[m, i]) >> pull
            far[i] >> _shape(g, f"b_far_{i + 1}", -FAR) >> pull
        for o in range(3):
            tip, seen = One(f"sensor_{o + 1}"), Zero(f"seen_{o + 1}")
            Se(f"F{o + 1}", unit="N") >> tip
            seen >> tip
            for m in modes:
                body[m] >> _shape(g, f"c_{o + 1}_{m + 1}", values.sensors[m, o]) >> seen
            for i in range(3):
                share = values.static[o, i] / FAR
                far[i] >> _shape(g, f"c_far_{o + 1}_{i + 1}", share) >> seen
            tip >> Dq(f"y{o + 1}", unit="m")
    return g


def elements_that_feed(matrix: FloatArray) -> int:
    """Return how many springs or dampers of a matrix are negative: 0 if they are passive."""
    return int((_scaled(matrix)[1] < -ROUNDING).sum())


def _scaled(matrix: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the size of each mode, shape (M,), and eigenvalues and vectors without it."""
    own = np.sqrt(np.abs(np.diag(matrix)))
    own[own == 0.0] = 1.0
    return own, *np.linalg.eigh(matrix / np.outer(own, own))


def _along(matrix: FloatArray, kind: str) -> tuple[FloatArray, FloatArray]:
    """Return springs or dampers that make a matrix, and the share of each mode in each, (M, M)."""
    if not np.allclose(matrix, matrix.T, atol=1e-12 * float(np.abs(matrix).max())):
        raise UnusableInput(
            f"steering mirror: the matrix of the {kind}s is not symmetric, so no {kind}s make it; "
            "give the mean of the matrix and its transpose"
        )
    if feed := elements_that_feed(matrix):
        raise UnusableInput(
            f"steering mirror: {feed} of the {kind}s of and between modes would create power; fit "
            f"passive {kind}s instead of free ones between pairs"
        )
    own, sizes, directions = _scaled(matrix)
    return np.where(sizes > ROUNDING, sizes, 0.0), own[:, None] * directions


def _shape(g: BondGraph, name: str, value: float) -> TF:
    """Return a transformer whose ratio may have either sign."""
    ratio = g.parameter(f"n_{name}", float(value), positive=False, fixed=True)
    return TF(name, ratio=ratio)
