"""Expected 95 % intervals of parameters, beside those of a reference input, in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from bondgraph.signals.files.checks import optional
from bondgraph.simulation.dynamics import Dynamics
from bondgraph.support.arrays import FloatArray
from bondgraph.support.errors import UnusableInput, require_known, unknown_name


@dataclass(frozen=True, slots=True)
class Expected:
    """Expected standard deviation of one parameter.

    Parameters
    ----------
    name : str
    value : float
        Nominal, SI.
    unit : str
    sd : float
        With the proposed input, SI.
    reference : float
        With the reference input, SI.
    """

    name: str
    value: float
    unit: str
    sd: float
    reference: float

    @property
    def ci95(self) -> tuple[float, float]:
        """Interval around the nominal value, SI."""
        return self.value - 1.96 * self.sd, self.value + 1.96 * self.sd

    @property
    def narrower(self) -> float:
        """Reference interval over the proposed one."""
        return self.reference / self.sd

    def __str__(self) -> str:
        """One line in words."""
        share = f" ({196 * self.sd / abs(self.value):.2g} %)" if self.value else ""
        unit = "" if self.unit == "1" else f" {self.unit}"
        return (
            f"{self.name}: {self.value:.5g} +- {1.96 * self.sd:.3g}{unit}{share} instead of "
            f"+- {1.96 * self.reference:.3g}, {_times(self.narrower)}"
        )


def _times(narrower: float) -> str:
    if not 0.0 < narrower < np.inf:
        return "which does not determine it"
    return (
        f"{narrower:.3g} times narrower" if narrower >= 1.0 else f"{1 / narrower:.3g} times wider"
    )


@dataclass(frozen=True, slots=True)
class ExpectedTable:
    """What to expect of the chosen parameters.

    Parameters
    ----------
    rows : tuple of Expected
    reference : str
        The input compared with, in words.
    """

    rows: tuple[Expected, ...]
    reference: str

    def __getitem__(self, name: str) -> Expected:
        """Return the row of a parameter."""
        for r in self.rows:
            if r.name == name:
                return r
        raise unknown_name("parameter", name, "the design", [r.name for r in self.rows])

    def to_pandas(self) -> Any:
        """Return a DataFrame, one row a parameter."""
        pandas = optional("pandas", "to_pandas", "tables")
        return pandas.DataFrame(
            [
                {"value": r.value, "unit": r.unit, "sd": r.sd, "reference_sd": r.reference}
                for r in self.rows
            ],
            index=pandas.Index([r.name for r in self.rows], name="parameter"),
        )

    def __str__(self) -> str:
        """One line a parameter."""
        head = f"expected 95 % intervals; instead of: {self.reference}"
        return "\n".join([head, *(f"  {r}" for r in self.rows)])


def wanted(
    dynamics: Dynamics, chosen: Sequence[str] | None, nuisances: Sequence[str] | None
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return chosen parameters and nuisances: by default all that are not fixed, and the rest.

    Raises
    ------
    UnknownName
        If the model has no such parameter.
    UnusableInput
        If nothing is chosen, or something is both.
    """
    known = dynamics.parameters
    free = [n for n, p in known.items() if not p.fixed]
    first = tuple(free) if chosen is None else tuple(chosen)
    rest = tuple(n for n in free if n not in first) if nuisances is None else tuple(nuisances)
    require_known("parameter", dynamics.name, known, *first, *rest)
    if not first or set(first) & set(rest) or len({*first, *rest}) != len(first) + len(rest):
        raise UnusableInput(
            f"{dynamics.name}: choose at least one parameter, and none twice or also as a nuisance"
        )
    return first, rest


def prior_samples(
    dynamics: Dynamics,
    names: Sequence[str],
    values: Mapping[str, float] | None,
    prior: Mapping[str, float] | None,
    samples: int,
    seed: int,
) -> tuple[FloatArray, FloatArray]:
    """Return parameter vectors to average over, the nominal first, and the scales of `names`.

    Parameters
    ----------
    values : mapping, optional
        Nominal values that differ from the declared ones.
    prior : mapping of str to float, optional
        Relative standard deviation of what is not known yet: logarithmic, so that signs stay.
    samples : int
        How many, the nominal included; 1 without a prior.

    Returns
    -------
    vectors : ndarray, shape (S, n_p)
    scale : ndarray, shape (len(names),)
        Size of each nominal value, 1 where it is zero: information is per relative change.
    """
    nominal = dynamics.vector(values or {})
    at = [dynamics.parameter_names.index(n) for n in names]
    scale = np.where(nominal[at] != 0.0, np.abs(nominal[at]), 1.0)
    if not prior:
        return nominal[None], scale
    for n, s in prior.items():
        require_known("parameter", dynamics.name, dynamics.parameter_names, n)
        if not 0.0 <= s < 5.0:
            raise UnusableInput(f"prior of {n}: {s} is no relative standard deviation")
    rng = np.random.default_rng(seed)
    vectors = np.tile(nominal, (max(2, samples), 1))
    for n, s in prior.items():
        column = dynamics.parameter_names.index(n)
        vectors[1:, column] *= np.exp(s * rng.standard_normal(vectors.shape[0] - 1))
    return vectors, scale


def table(
    dynamics: Dynamics,
    nominal: FloatArray,
    chosen: Sequence[str],
    scale: FloatArray,
    proposed: FloatArray,
    reference: FloatArray,
    words: str,
) -> ExpectedTable:
    """Return the rows from two information matrices (n, n) per relative change, chosen first."""
    rows = []
    sd, other = (standard_deviations(m, len(chosen)) for m in (proposed, reference))
    for i, n in enumerate(chosen):
        value = float(nominal[dynamics.parameter_names.index(n)])
        unit = dynamics.parameters[n].unit
        rows.append(Expected(n, value, unit, float(sd[i] * scale[i]), float(other[i] * scale[i])))
    return ExpectedTable(tuple(rows), words)


def beside_seen(information: FloatArray, chosen: int) -> FloatArray:
    """Leave out the nuisances that show nowhere: they take nothing from the chosen parameters.

    Parameters
    ----------
    information : ndarray, shape (..., n, n)
        The first `chosen` rows and columns stay.

    Examples
    --------
    >>> beside_seen(np.diag([100.0, 0.0, 4.0]), 1).tolist()
    [[100.0, 0.0], [0.0, 4.0]]
    """
    size = np.abs(np.diagonal(information, axis1=-2, axis2=-1))
    shown = size.reshape(-1, size.shape[-1]).sum(axis=0) != 0.0
    shown[:chosen] = True
    return np.asarray(information[..., shown, :][..., shown])


def standard_deviations(information: FloatArray, chosen: int) -> FloatArray:
    """Square roots of the diagonal of the inverse; infinite where nothing is determined."""
    information = beside_seen(information, chosen)
    size = np.sqrt(np.maximum(np.diag(information), 0.0))
    if not (size > 0.0).all():
        return np.full(chosen, np.inf)
    values, vectors = np.linalg.eigh(information / np.outer(size, size))
    if not values[0] > 1e-13:
        return np.full(chosen, np.inf)
    return np.asarray(np.sqrt(np.sum(vectors**2 / values, axis=1))[:chosen] / size[:chosen])
