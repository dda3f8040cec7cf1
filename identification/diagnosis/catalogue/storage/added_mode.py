"""A resonance that the model does not have."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from bondgraph.graph.elements import C, Element, I, One, R, Zero
from bondgraph.graph.parameter import Parameter, symbol
from bondgraph.support.arrays import Array
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion, Signature
from identification.diagnosis.catalogue.places import masses
from identification.diagnosis.screening.port_history import FittedModel, PortHistory

DAMPING = 0.03
CRITICAL = 1.0
"""Damping ratio from which nothing rings."""
PEAKS, GRID = 4, 8


class AddedMode(Effect):
    """A further mass on a spring hangs on an inertia."""

    name = "added_mode"
    family = "storage"
    kind = "mode"
    law = "attached_oscillator"
    sentence = "a resonance is missing: a further mass on a spring hangs on it"
    looks = "the misfit lives in a narrow band and rings on after every shock"
    confused_with = ("delay", "low_pass", "sensor_lag")
    separated_by = (
        "a sine swept slowly through the band: a pair of antiresonance and resonance appears at "
        "frequencies that do not depend on the amplitude"
    )
    source = "Den Hartog, Mechanical Vibrations, chapter 3 (attached oscillator)"
    meanings: ClassVar[Mapping[str, str]] = {
        "mu": "mass that hangs on it, over its own",
        "omega": "angular frequency of the mass on its spring",
        "zeta": "damping ratio of that mass",
    }
    where = staticmethod(masses)

    def signatures(self, scene: FittedModel, element: Element) -> tuple[Signature, ...]:
        """Force of a light oscillator on the mass over the mass ratio, for several frequencies."""
        past = scene.of(element)
        heavy = inertia(past)
        return tuple(
            Signature.of((heavy * pull(past.argument, omega, DAMPING, past.dt),), omega=omega)
            for omega in frequencies(scene, past)
        )

    def insert(self, scene: FittedModel, element: Element, hint: Hint | None = None) -> Insertion:
        """Attach a mass through a spring and a damper, scaled by the inertia it hangs on."""
        g, name, past = scene.graph, element.name, scene.of(element)
        body = g[g.neighbour(name)]
        if not isinstance(body, One):
            (bond,) = g.bonds_of(name)
            body = One(f"carrier_{name}")
            g = g.with_inserted(bond, body)
        tried = frequencies(scene, past)[:3]
        ratio = 0.1
        if hint is not None:
            tried = (float(hint.shape["omega"]),)
            ratio = float(np.clip(hint.weights[0], 0.01, 2.0))
        amount = Parameter(f"mu_{name}", 0.1, "1", lower=1e-5, upper=20.0, scale=0.1)
        omega = Parameter(
            f"omega_{name}", tried[0], "rad/s",
            lower=0.5 * np.pi / (past.n * past.dt), upper=np.pi / past.dt, scale=tried[0],
        )  # fmt: skip
        zeta = Parameter(f"zeta_{name}", DAMPING, "1", lower=1e-4, upper=2.0, scale=DAMPING)
        g = g.with_parameters([amount, omega, zeta])
        m, w, z = (symbol(p.name, positive=True) for p in (amount, omega, zeta))
        mass = m * g.coefficient(element)
        node, link = Zero(f"mode_{name}"), One(f"link_{name}")
        g = g.with_branch(body.name, [node, link])
        g = g.with_branch(node.name, [I(f"I_mode_{name}", mass)])
        g = g.with_branch(link.name, [C(f"C_mode_{name}", stiffness=mass * w**2)])
        g = g.with_branch(link.name, [R(f"R_mode_{name}", 2 * z * w * mass)])
        starts = [{amount.name: ratio, omega.name: at} for at in tried]
        if hint is not None:
            # in the coupled system the peak lies above the oscillator's own frequency
            starts += [{amount.name: max(ratio, 0.2), omega.name: 0.85 * tried[0]}]
        # damped beyond that it rings no more: it stands for something else then
        rings = ((zeta.name, 0.0, CRITICAL),)
        return self.inserted(element, g, tuple(starts), (amount.name,), rings)


def pull(flow: Array, omega: float, damping: float, dt: float) -> Array:
    """Force of an oscillator of unit mass on what moves with `flow`; see `ringing`.

    ``F = s (2 zeta omega s + omega^2) / (s^2 + 2 zeta omega s + omega^2) v``.
    """
    displacement, velocity = ringing(flow, omega, damping, dt)
    loss = 2 * damping * omega
    rest = flow - flow[0] - displacement
    return np.asarray(loss * rest + (omega - 2 * damping * loss) * velocity)


def ringing(flow: Array, omega: float, damping: float, dt: float) -> tuple[Array, Array]:
    """Displacement and velocity of an oscillator that a flow shakes, exact for straight lines.

    ``omega^2 / (s^2 + 2 zeta omega s + omega^2) v`` and ``omega s / (...) v``: any weights of the
    two are a residue of any size and phase.

    Parameters
    ----------
    flow : ndarray, shape (N,)
        From rest.
    omega, damping : float
        rad/s, 1.
    dt : float
        Time between samples, s.

    Returns
    -------
    tuple of ndarray, shape (N,)
    """
    from scipy.signal import cont2discrete, lfilter

    a = np.array([[0.0, 1.0], [-(omega**2), -2 * damping * omega]])
    b, c, d = np.array([[0.0], [1.0]]), np.diag([omega**2, omega]), np.zeros((2, 1))
    ad, bd, cd, dd, _ = cont2discrete((a, b, c, d), dt, method="foh")
    bottom = np.poly(ad)
    z = flow - flow[0]
    made = []
    for row, direct in zip(cd, dd, strict=True):
        # numerator of c (z - A)^-1 b + d
        top = np.poly(ad - bd @ row[None, :]) + (direct[0] - 1.0) * bottom
        made.append(np.asarray(lfilter(top, bottom, z)))
    return made[0], made[1]


def frequencies(scene: FittedModel, past: PortHistory) -> tuple[float, ...]:
    """Candidates, rad/s: peaks of the residual's spectrum, largest first, then an even grid."""
    low, high = 16 * np.pi / (scene.residual.shape[0] * scene.data.dt), 0.6 * np.pi / past.dt
    grid = np.geomspace(low, max(high, 2 * low), GRID)
    return (*peaks(scene), *(float(v) for v in grid))


def peaks(scene: FittedModel) -> tuple[float, ...]:
    """Return the peaks of the residual's spectrum, rad/s, the largest first.

    Several sensors are added after scaling by their floor.
    """
    n = scene.residual.shape[0]
    r = (scene.residual - scene.residual.mean(axis=0)) / scene.data.floor
    power = np.sum(np.abs(np.fft.rfft(r * np.hanning(n)[:, None], axis=0)) ** 2, axis=1)
    width = max(1, power.size // 400)
    smooth = np.convolve(power, np.ones(2 * width + 1), mode="same")[1:]
    inner = np.arange(1, smooth.size - 1)
    tops = inner[(smooth[inner] >= smooth[inner - 1]) & (smooth[inner] > smooth[inner + 1])]
    bin_width = 2 * np.pi / (n * scene.data.dt)
    found: list[float] = []
    for i in tops[np.argsort(smooth[tops])[::-1]]:
        at = float(bin_width * (i + 1))
        if len(found) < PEAKS and all(abs(np.log(at / other)) > 0.1 for other in found):
            found.append(at)
    return tuple(found)


def inertia(past: PortHistory) -> float:
    """Inertia from effort and rate of flow along the record."""
    square = float(past.rate @ past.rate)
    return abs(float(past.rate @ past.output)) / square if square else 1.0
