"""What a filter needs of a model: the functions of its step and their numbers, in scaled units."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from functools import lru_cache

import casadi as ca

from bondgraph.laws.law import Law
from bondgraph.simulation.dynamics import Dynamics
from bondgraph.support.arrays import Array
from identification.study.process_noise import Diffusion


@dataclass(frozen=True)
class FilterSteps:
    """Functions of the filter; those ending in ``_t`` carry one direction of differentiation.

    ``roots(z, u0, u1, m, elapsed) -> w``, ``predict(z, w, u0, u1, m, elapsed) -> z``,
    ``update(z, y, mask, u, m) -> (z, out, gain)`` with ``out = (reading, innovation, variance)``;
    of linear models ``drift(x, u0, u1, m) -> x`` and ``correct(x, gain, y, u, m) -> (x, out)`` for
    a settled gain, and no roots.

    Carried numbers ``z``: mean, covariance (lower triangle by columns), unknowns of the step,
    memory. Numbers that depend on parameters stand in ``m``: the model's, its step among them, then
    the variance of each reading's noise, then its offset.

    Attributes
    ----------
    n_x, n_u, n_y, n_roots, n_z, n_m : int
        Lengths of states, inputs, readings, roots, z and m.
    step_at : int
        Where the length of a sub-step (s) stands in m.
    """

    n_x: int
    n_u: int
    n_y: int
    n_roots: int
    n_z: int
    n_m: int
    step_at: int
    functions: dict[str, ca.Function]

    @property
    def linear(self) -> bool:
        """Whether nothing is to be solved for, and the gain settles."""
        return not self.n_roots

    @property
    def n_p(self) -> int:
        """Entries of a packed covariance."""
        return packed_size(self.n_x)

    @property
    def tail(self) -> slice:
        """Unknowns of the step and memory in z."""
        return slice(self.n_x + self.n_p, self.n_z)

    @property
    def body(self) -> slice:
        """The model's own numbers in m."""
        return slice(0, self.n_m - 2 * self.n_y)


def packed_size(n: int) -> int:
    """Entries of a symmetric matrix."""
    return n * (n + 1) // 2


@dataclass(frozen=True)
class Operating:
    """Where the numbers of a model are wanted.

    Attributes
    ----------
    p : ndarray, shape (n_p,), SI
    wanted : ndarray of int
        Parameters to differentiate by; `slopes` are their derivatives by theta.
    sigma : ndarray
        Diffusions, SI, at the places of `diffusions`.
    x, y : ndarray
        Sizes of states and readings.
    derivatives : bool
        By the parameters wanted and the logarithms of the diffusions.
    """

    p: Array
    wanted: Array
    slopes: Array
    sigma: Array
    diffusions: Sequence[Diffusion | None]
    x: Array
    y: Array
    derivatives: bool

    @property
    def n_d(self) -> int:
        """Directions: parameters, then diffusions."""
        return self.wanted.size + self.sigma.size if self.derivatives else 0


class FilterPlant(ABC):
    """A model behind a filter; abstract. Those of equal structure are equal and share functions."""

    @property
    @abstractmethod
    def structure(self) -> Hashable:
        """All that the functions depend on."""

    @property
    @abstractmethod
    def laws(self) -> tuple[tuple[str, Law], ...]:
        """Elements with a law, and it."""

    @abstractmethod
    def build(self) -> FilterSteps:
        """Build the functions of the filter."""

    @property
    def steps(self) -> FilterSteps:
        """Functions of the filter."""
        return _steps(self)

    def __hash__(self) -> int:
        """By structure."""
        return hash(self.structure)

    def __eq__(self, other: object) -> bool:
        """By structure."""
        return isinstance(other, FilterPlant) and self.structure == other.structure

    @abstractmethod
    def fine(self, u: Array, n_sub: int, step: float, hold: str) -> Array:
        """Return the inputs at both ends of each of ``(N - 1) n_sub`` sub-steps, (.., 2, n_u)."""

    @abstractmethod
    def body(self, at: Operating, h: float) -> tuple[Array, Array]:
        """Return the model's numbers for a sub-step `h` (s) and their derivatives, (n, n_d)."""

    @abstractmethod
    def tail(
        self, at: Operating, u: Array, x: Array, dx: Array, numbers: tuple[Array, Array]
    ) -> tuple[Array, Array]:
        """Return the unknowns of the step and the memory to begin with, and their tangents.

        The memory is that at rest at a state `x` (scaled, with tangents) under inputs `u`;
        `numbers` are the body for a step of no length and its tangents, in the columns of `dx`.
        """


@lru_cache(maxsize=64)
def _steps(plant: FilterPlant) -> FilterSteps:
    return plant.build()


def plant_of(dynamics: Dynamics) -> FilterPlant:
    """Return what a filter needs of a model."""
    if dynamics.lure is not None:
        from identification.estimation.prediction.exact_plant import ExactPlant

        return ExactPlant(dynamics.lure)
    from identification.estimation.prediction.general_plant import GeneralPlant

    assert dynamics.implicit is not None
    return GeneralPlant(dynamics.implicit)
