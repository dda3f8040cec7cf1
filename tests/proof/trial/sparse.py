"""Baseline: sparse regression of the state equations with all states given.

Sequentially thresholded least squares (Brunton, Proctor and Kutz, PNAS 113 (2016) 3932) in the form
for discrepancies (the linear model's terms are always kept; Kaheman and others 2019): the strongest
nonlinear term that survives names effect and element.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from bondgraph.graph.elements import Sensor
from bondgraph.support.arrays import FloatArray as Array
from tests.proof.trial.models import MODELS
from tests.proof.trial.state_equations import EQUATIONS, Equation, Port

THRESHOLD = 0.05
"""Least contribution of a term, over the root mean square of the rate."""
ROUNDS = 10

TERMS: Mapping[str, tuple[tuple[str, Callable[[Array], Array]], ...]] = MappingProxyType(
    {
        "spring": (
            ("nonlinear_stiffness", lambda q: q**2),
            ("nonlinear_stiffness", lambda q: q**3),
            ("bilinear_stiffness", np.abs),
        ),
        "friction": (
            ("coulomb_friction", np.sign),
            ("quadratic_drag", lambda f: f * np.abs(f)),
            ("asymmetric_damping", np.abs),
        ),
        "flow": (
            ("square_root_flow", lambda f: np.sign(f) * np.sqrt(np.abs(f))),
            ("nonlinear_resistance", lambda f: f**3),
        ),
        "resistor": (
            ("nonlinear_resistance", lambda f: f**2),
            ("nonlinear_resistance", lambda f: f**3),
        ),
        "source": (("saturation", lambda u: u**3), ("saturation", lambda u: u**2)),
        "ratio": (("nonlinear_ratio", lambda q: q), ("nonlinear_ratio", lambda q: q**2)),
    }
)
"""Candidate functions of a port's variable, with the effect that each stands for."""


def sparse_regression(
    plant: str, command: Array, readings: Mapping[str, Array], dt: float, train: NDArray[np.bool_]
) -> tuple[str, str] | None:
    """Return effect and element of the strongest surviving term.

    Both are empty if no term survives; None if the recording lacks a sensor and the states do not
    follow from the others.
    """
    needed = {s.name for s in MODELS[plant](None).of_type(Sensor)}
    if needed - readings.keys():
        return None
    best, found = 0.0, ("", "")
    for equation in EQUATIONS[plant](command, readings, dt):
        size, term = strongest(equation, train)
        if size > best:
            best, found = size, term
    return found


def strongest(equation: Equation, train: NDArray[np.bool_]) -> tuple[float, tuple[str, str]]:
    """Return the largest surviving contribution, relative to the rate, and what it names."""
    names, columns = candidates(equation.ports)
    known = len(equation.linear) + 1
    matrix = np.column_stack([np.ones(equation.rate.size), *equation.linear, *columns])[train]
    target = equation.rate[train]
    scale = np.sqrt(np.mean(matrix**2, axis=0)) + 1e-300
    size = float(target.std()) or 1.0
    matrix, target = matrix / scale, target / size
    active = np.ones(matrix.shape[1], bool)
    weights = np.zeros(matrix.shape[1])
    for _ in range(ROUNDS):
        weights[:] = 0.0
        weights[active] = np.linalg.lstsq(matrix[:, active], target, rcond=None)[0]
        keep = np.abs(weights) >= THRESHOLD
        keep[:known] = True
        if (keep == active).all():
            break
        active &= keep
    left = np.abs(weights[known:])
    if not left.size or left.max() < THRESHOLD:
        return 0.0, ("", "")
    return float(left.max()), names[int(left.argmax())]


def candidates(ports: tuple[Port, ...]) -> tuple[list[tuple[str, str]], list[Array]]:
    """Return what each candidate names, and its column."""
    names, columns = [], []
    for p in ports:
        q = p.value / (np.abs(p.value).max() + 1e-300)
        for effect, function in TERMS[p.kind]:
            value = function(q)
            names.append((effect, p.element))
            columns.append(np.asarray(value if p.with_signal is None else value * p.with_signal))
    return names, columns
