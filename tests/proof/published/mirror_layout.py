"""Parameters of the steering mirror's model as one vector.

Sizes: M modes, 3 actuators i, 3 sensors o, P pairs of modes, B memory terms an actuator.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bondgraph.support.arrays import FloatArray

OMEGA = 2e3 * np.pi
"""Reference angular frequency, rad/s: frequencies are logarithms over it."""

DELAY = 1e-4
"""Unit of dead times, s."""


class Parts(NamedTuple):
    """The vector taken apart.

    Attributes
    ----------
    omega, zeta : ndarray, shape (M,)
        Natural frequency, rad/s, and damping ratio of each mode alone.
    psi : ndarray, shape (M, 3)
        Static displacement of a mode by a volt at an actuator.
    phi : ndarray, shape (M, 3)
        Reading of a sensor, um, for a unit of a mode.
    stiffness : ndarray, shape (M,)
        Of a mode: force and displacement of an actuator share the shape ``stiffness psi``.
    softening : ndarray, shape (M, 2)
        Relative loss of modal stiffness for a unit of `MirrorModel.drive`, and of its square.
    slackening : ndarray, shape (M, 2)
        Relative rise of modal damping for a unit of `MirrorModel.drive`, and of its square.
    bending, dragging : ndarray, shape (P, 2)
        Stiffness lost and damping, over `OMEGA`, gained between two modes for a unit of
        `MirrorModel.drive`, and of its square: they turn the mode shapes.
    static : ndarray, shape (3, 3)
        Reading by modes far above the band, um/V, sensor by actuator.
    late_in, late_out : ndarray, shape (3,)
        Dead times, s.
    coupling : ndarray, shape (P,)
        Damping between two modes, over `OMEGA`; of either sign, so not always passive.
    dampers : ndarray, shape (M, Q)
        Share of each mode in dampers of their own, over the root of `OMEGA`; always passive.
    memory : ndarray, shape (3, B)
        Weights of the terms of the actuators' laws.
    """

    omega: FloatArray
    zeta: FloatArray
    psi: FloatArray
    phi: FloatArray
    stiffness: FloatArray
    softening: FloatArray
    slackening: FloatArray
    bending: FloatArray
    dragging: FloatArray
    static: FloatArray
    late_in: FloatArray
    late_out: FloatArray
    coupling: FloatArray
    dampers: FloatArray
    memory: FloatArray

    @property
    def theta(self) -> FloatArray:
        """Displacement of an actuator for a unit of a mode, shape (M, 3)."""
        return self.stiffness[:, None] * self.psi


@dataclass(frozen=True)
class Layout:
    """Where each parameter stands.

    Parameters
    ----------
    modes : int
    pairs : tuple of (int, int)
        Modes with mutual damping and stiffness.
    terms : int
        B.
    dampers : int
        Q.
    """

    modes: int
    pairs: tuple[tuple[int, int], ...]
    terms: int
    dampers: int = 0

    @cached_property
    def at(self) -> dict[str, NDArray[np.intp]]:
        """Places of each part in the vector, in the shape of the part."""
        m, found, start = self.modes, {}, 0
        shapes: dict[str, tuple[int, ...]] = {
            "log_omega": (m,), "log_zeta": (m,), "psi": (m, 3), "phi": (m, 3),
            "log_stiffness": (m,), "softening": (m, 2), "slackening": (m, 2),
            "bending": (len(self.pairs), 2), "dragging": (len(self.pairs), 2), "static": (3, 3),
            "late_in": (3,), "late_out": (3,), "coupling": (len(self.pairs),),
            "dampers": (m, self.dampers),
            "memory": (3, self.terms),
        }  # fmt: skip
        for name, shape in shapes.items():
            size = int(np.prod(shape))
            found[name] = np.arange(start, start + size).reshape(shape)
            start += size
        return found

    @property
    def size(self) -> int:
        """Length of the vector."""
        return int(sum(v.size for v in self.at.values()))

    def places(self, *names: str) -> NDArray[np.intp]:
        """Return the places of these parts in a row."""
        return np.concatenate([self.at[n].ravel() for n in names])

    def split(self, p: FloatArray) -> Parts:
        """Take a vector apart."""
        v = {n: p[k] for n, k in self.at.items()}
        return Parts(
            OMEGA * np.exp(v["log_omega"]), np.exp(v["log_zeta"]), v["psi"], v["phi"],
            np.exp(v["log_stiffness"]), v["softening"], v["slackening"],
            v["bending"], v["dragging"], v["static"],
            DELAY * v["late_in"], DELAY * v["late_out"], v["coupling"],
            v["dampers"], v["memory"],
        )  # fmt: skip

    def moved(self, p: FloatArray, other: Layout) -> FloatArray:
        """Return the vector of another layout with the values of this one, zero where new.

        Modes of `other` beyond those here are left for the caller to fill.
        """
        made, keep = np.zeros(other.size), min(self.modes, other.modes)
        for name in self.at:
            if name in ("coupling", "bending", "dragging"):
                for pair, place in zip(self.pairs, self.at[name], strict=True):
                    if pair in other.pairs:
                        made[other.at[name][other.pairs.index(pair)]] = p[place]
            elif name in (
                "log_omega",
                "log_zeta",
                "psi",
                "phi",
                "log_stiffness",
                "softening",
                "slackening",
            ):
                made[other.at[name][:keep]] = p[self.at[name][:keep]]
            elif self.at[name].shape == other.at[name].shape:
                made[other.at[name]] = p[self.at[name]]
        return made
