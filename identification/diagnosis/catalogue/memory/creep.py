"""Creep: a storage that keeps yielding after its load has settled."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from itertools import combinations
from typing import ClassVar

import numpy as np

from bondgraph.graph.elements import C, Element, One, R, Zero
from bondgraph.graph.parameter import Parameter, symbol
from bondgraph.support.arrays import Array
from identification.diagnosis.catalogue.effect import Effect, Hint, Insertion, Signature
from identification.diagnosis.catalogue.memory.diffusion_form import (
    DIFFUSION_FORMS,
    diffusion_forms,
)
from identification.diagnosis.catalogue.places import lump_at, storages
from identification.diagnosis.screening.port_history import FittedModel, PortHistory

SHARES = (0.003, 0.012, 0.05, 0.2, 0.7)
"""Time constants tried, over the duration of the record."""
FEWEST_SAMPLES = 10
"""A shorter time constant is a lag, not creep."""


class Creep(Effect):
    """Slow after-effect: two Kelvin-Voigt branches in series with a storage."""

    name = "creep"
    family = "memory"
    kind = "slow"
    law = "kelvin_voigt"
    sentence = "it keeps yielding for a while after a step, over several time scales"
    looks = (
        "after a step the output goes on in the same direction, ever slower; the loops open at "
        "low frequencies and close at high ones"
    )
    confused_with = ("hysteresis", "sensor_drift", "low_pass", "leakage", "linear_capacity")
    separated_by = (
        "a step up, a long rest, a step down and a long rest: creep comes back by itself after "
        "the step down, hysteresis stays where it is, drift goes on as before"
    )
    simpler = ("leakage", "linear_capacity")
    source = "Kuhnen and Janocha, Creep and hysteresis compensation, 1998; Kelvin-Voigt chain"
    meanings: ClassVar[Mapping[str, str]] = {
        "creep_i": "what each branch yields later, over what yields at once",
        "tau_i": "time constant of each branch",
        "W": "size of the after-effect that grows with the root of time",
    }
    where = staticmethod(storages)
    richer = DIFFUSION_FORMS
    forms = staticmethod(diffusion_forms)

    def signatures(self, scene: FittedModel, element: Element) -> tuple[Signature, ...]:
        """Effort lost to two lagged parts of the displacement, for pairs of time constants."""
        past = scene.of(element)
        taus = _time_constants(past)
        lost = {tau: -past.slope * lagged(past.argument, tau, past.dt) for tau in taus}
        return tuple(
            Signature(np.stack([lost[a], lost[b]], axis=1), shape={"tau_1": a, "tau_2": b})
            for a, b in combinations(taus, 2)
        )

    def insert(self, scene: FittedModel, element: Element, hint: Hint | None = None) -> Insertion:
        """Insert a 0-junction before the storage, with two branches of resistor and storage."""
        past, g, name = scene.of(element), scene.graph, element.name
        taus = _time_constants(past)
        chosen = (taus[1], taus[-2]) if len(taus) > 3 else (taus[0], taus[-1])
        weights = np.full(2, 0.02)
        if hint is not None:
            chosen = (float(hint.shape["tau_1"]), float(hint.shape["tau_2"]))
            weights = np.clip(hint.weights, 1e-3, 2.0)
        (bond,) = g.bonds_of(name)
        node = Zero(f"creep_{name}")
        g = g.with_inserted(bond, node)
        slope = scene.graph.coefficient(element)
        strengths, starts = [], {}
        for j, (start, weight) in enumerate(zip(chosen, weights, strict=True), start=1):
            amount = Parameter(f"creep_{j}_{name}", 0.01, "1", lower=1e-5, upper=3.0, scale=0.02)
            tau = Parameter(
                f"tau_{j}_{name}", start, "s", lower=start / 5, upper=5 * start, scale=start
            )
            g = g.with_parameters([amount, tau])
            a, t = symbol(amount.name, positive=True), symbol(tau.name, positive=True)
            branch = One(f"branch_{j}_{name}")
            g = g.with_branch(node.name, [branch])
            g = g.with_branch(branch.name, [C(f"C_{j}_{name}", stiffness=slope / a)])
            g = g.with_branch(branch.name, [R(f"R_{j}_{name}", slope * t / a)])
            strengths.append(amount.name)
            starts[amount.name] = float(weight)
        within = tuple((n, 0.0, FLOWS) for n in strengths)
        made = self.inserted(element, g, (starts,), tuple(strengths), within)
        lump = lump_at(scene.graph, element)
        if not lump:
            return made
        return replace(
            made, sentence=f"{self.sentence}, as each further {lump} behind a resistance does"
        )


FLOWS = 2.5
"""Part of what a spring gives at once from which what it gives later is a flow, or a drift."""


def lagged(x: Array, tau: float, dt: float) -> Array:
    """Return `x` after a first-order lag that rests at the first value, exact for straight lines.

    Parameters
    ----------
    x : ndarray, shape (N,)
    tau, dt : float
        Time constant and time between samples, s.

    Examples
    --------
    >>> lagged(np.array([2.0, 2.0]), 1.0, 0.1).tolist()
    [2.0, 2.0]
    """
    from scipy.signal import lfilter

    keep, gone = np.exp(-dt / tau), -np.expm1(-dt / tau)
    now = 1.0 - gone * tau / dt
    return np.asarray(lfilter([now, gone - now], [1.0, -keep], x - x[0]) + x[0])


def _time_constants(past: PortHistory) -> tuple[float, ...]:
    duration = past.dt * past.n
    found = [s * duration for s in SHARES if s * past.n >= FEWEST_SAMPLES]
    return tuple(found) if len(found) > 1 else (0.1 * duration, 0.7 * duration)
