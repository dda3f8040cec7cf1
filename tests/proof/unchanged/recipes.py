"""Recordings of a positioner with concealed physics, from NumPy alone: equal for all checkouts."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
MASS, DAMPING, STIFFNESS = 0.5, 4.0, 2000.0
INNER = 40
"""Steps of the integrator in a sample."""


@dataclass(frozen=True)
class Recipe:
    """A positioner, what is concealed in it, how it is driven and read; SI.

    Attributes
    ----------
    friction : float
        Dry friction, N.
    gap : float
        Half of the free play of the spring, m.
    slips : tuple of (stiffness N/m, slip m)
        Elements that stick and slip, beside the spring.
    cubic : float
        N/m^3.
    delay : float
        s, of the force.
    jump, drift : float
        Of the reading: m at half time; m over the record.
    """

    seed: int
    samples: int = 2400
    dt: float = 1e-3
    level: float = 8.0
    drive: str = "sweep"
    noise: float = 2e-6
    mass: float = MASS
    friction: float = 0.0
    gap: float = 0.0
    slips: tuple[tuple[float, float], ...] = ()
    cubic: float = 0.0
    delay: float = 0.0
    jump: float = 0.0
    drift: float = 0.0


RECIPES = {
    "none": Recipe(11),
    "none_other": Recipe(12, level=5.0, drive="steps"),
    "none_periodic": Recipe(13, samples=3000, drive="periodic"),
    "none_heavier": Recipe(14, mass=0.62, level=6.0),
    "coulomb": Recipe(21, friction=0.8),
    "coulomb_other": Recipe(22, friction=0.8, level=5.0, drive="steps"),
    "backlash": Recipe(23, gap=5e-4),
    "hysteresis": Recipe(24, slips=((500.0, 5e-4), (350.0, 1.5e-3), (250.0, 3e-3))),
    "delay": Recipe(25, delay=5.3e-3),
    "stiffening": Recipe(26, cubic=2e7),
    "sensor_jump": Recipe(27, jump=2e-4),
    "sensor_drift": Recipe(28, drift=6e-4),
    "two_effects": Recipe(29, friction=0.5, cubic=2e7),
}
"""Recordings by name; each is written as NAME.csv."""


def make(name: str, folder: Path) -> Path:
    """Write the recording `name` into `folder`; returns the file."""
    recipe = RECIPES[name]
    rng = np.random.default_rng(recipe.seed)
    t: Array = recipe.dt * np.arange(recipe.samples, dtype=np.float64)
    force = _force(recipe, t, rng)
    x = _positions(recipe, t, force)
    reading = x + recipe.noise * rng.standard_normal(t.size)
    reading += recipe.jump * (t > 0.5 * t[-1]) + recipe.drift * (t / t[-1]) ** 2
    path = folder / f"{name}.csv"
    with path.open("w", encoding="ascii", newline="\n") as file:
        file.write("t_s,F[N],x_um\n")
        for row in zip(t, force, 1e6 * reading, strict=True):
            file.write("{:.6f},{:.10g},{:.10g}\n".format(*row))
    return path


def _force(recipe: Recipe, t: Array, rng: np.random.Generator) -> Array:
    """Return the command: at rest for 0.25 s, except where it repeats."""
    if recipe.drive == "periodic":
        lines = np.arange(1, 40, 2)
        phases = rng.uniform(0.0, 2 * np.pi, lines.size)
        angle = 2 * np.pi * np.arange(500)[:, None] * lines / 500
        period = np.cos(angle + phases).sum(axis=1)
        period *= recipe.level / np.abs(period).max()
        return np.tile(period, t.size // 500)
    late = np.maximum(t - 0.25, 0.0)
    if recipe.drive == "steps":
        heights = rng.uniform(-1.0, 1.0, 40)
        return np.asarray(recipe.level * heights[(late / 0.12).astype(int)] * (late > 0.0))
    return np.asarray(recipe.level * np.sin(2 * np.pi * (1.0 + 3.5 * late) * late))


def _positions(recipe: Recipe, t: Array, force: Array) -> Array:
    """Drift, kick, drift; the friction of a kick is solved in closed form."""
    h = recipe.dt / INNER
    x = v = 0.0
    bent = [0.0] * len(recipe.slips)
    fine = t[0] + h * (np.arange((t.size - 1) * INNER) + 0.5)
    pushed = np.interp(fine - recipe.delay, t, force).tolist()
    found = [x]
    for k, f in enumerate(pushed):
        half = x + 0.5 * h * v
        spring = STIFFNESS * (half - min(max(half, -recipe.gap), recipe.gap))
        spring += recipe.cubic * half**3
        for i, (stiffness, slip) in enumerate(recipe.slips):
            bent[i] = min(max(bent[i] + h * v, -slip), slip)
            spring += stiffness * bent[i]
        free = v + h / recipe.mass * (f - spring)
        kept = max(abs(free) - h * recipe.friction / recipe.mass, 0.0)
        v = (kept if free > 0.0 else -kept) / (1.0 + h * DAMPING / recipe.mass)
        x = half + 0.5 * h * v
        if (k + 1) % INNER == 0:
            found.append(x)
    return np.array(found)
