"""The linear model from a latent signal at a port to the weighted readings, at any parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import expm, matrix_balance

from bondgraph.graph.elements import TwoPort
from bondgraph.simulation.first_order_hold import blocks
from bondgraph.simulation.lure import Compiled
from bondgraph.support.arrays import Array
from bondgraph.support.errors import UnusableInput
from identification.diagnosis.screening.port_response import Probes
from identification.study.factors import drives
from identification.study.residual import parameters_at


@dataclass(frozen=True)
class Sampled:
    """Discrete model ``x+ = phi x + gamma w``, ``y = c x + d w`` of latent signals `w`.

    A latent signal runs linearly between the samples; the state is shifted so that only its
    present sample enters. Readings are in units of their floor, whitened where the floor is
    coloured; states are scaled.

    Attributes
    ----------
    phi : ndarray, shape (n, n)
    gamma : ndarray, shape (n, k)
    c : ndarray, shape (n_y, n)
    d : ndarray, shape (n_y, k)
    """

    phi: Array
    gamma: Array
    c: Array
    d: Array

    def response(self, angles: Array) -> Array:
        """Frequency response at `angles` (rad a sample), shape (n_f, n_y, k)."""
        n = self.phi.shape[0]
        z = np.exp(1j * angles)[:, None, None]
        if n == 0:
            return np.broadcast_to(self.d, (angles.size, *self.d.shape)).astype(complex)
        # an angle on an eigenvalue itself must not stop the rest
        shifted = z * np.eye(n) * (1 + 1e-12) - self.phi
        return np.asarray(self.c @ np.linalg.solve(shifted, self.gamma[None] + 0j) + self.d)


@dataclass(frozen=True, eq=False)
class LatentModel:
    """Every port of the fitted model as a latent input.

    Attributes
    ----------
    probes : Probes
        The fitted model with a source at every port; its dynamics must be the exact one.
    """

    probes: Probes

    @cached_property
    def compiled(self) -> Compiled:
        """Linear rest and laws of the probed graph."""
        compiled = self.probes.dynamics.lure
        if compiled is None:
            raise UnusableInput(
                f"{self.probes.problem.graph.name} is not linear up to scalar laws: relations blind"
                " to a port need its transfer functions; compare fits of effects instead"
            )
        return compiled

    @cached_property
    def _inputs(self) -> dict[str, int]:
        return {n: j for j, n in enumerate(self.compiled.inputs)}

    @cached_property
    def ports(self) -> dict[str, tuple[str, ...]]:
        """Sources that stand for a latent signal at each element; sensors have none."""
        found: dict[str, tuple[str, ...]] = {}
        graph = self.probes.problem.graph
        for name, (source, _) in self.probes.ports.items():
            both = isinstance(graph.elements.get(name), TwoPort) and name in self.probes.flows
            flow = (self.probes.flows[name][0],) if both else ()
            found[name] = (source, *flow)
        found |= {s.name: (s.name,) for s in drives(graph)}
        found = {n: s for n, s in found.items() if all(one in self._inputs for one in s)}
        return found | dict.fromkeys(self.probes.problem.data.names, ())

    def sampled(self, element: str, theta: Array) -> Sampled:
        """Discrete model of a latent signal at `element`, at the unknowns `theta` of the fit."""
        problem = self.probes.problem
        n_y = len(problem.data.names)
        names = problem.dynamics.parameter_names
        values = dict(zip(names, map(float, parameters_at(problem, theta)), strict=True))
        known = self.probes.dynamics.parameters
        p = self.probes.dynamics.vector({n: v for n, v in values.items() if n in known})
        compiled = self.compiled
        parts = blocks(compiled, compiled.block(p))
        at = [self._inputs[s] for s in self.ports[element]]
        floor = problem.data.floor[:, None]
        plain = _held(
            parts.a, parts.b[:, at], parts.cy / floor, parts.dy[:, at] / floor, problem.data.dt
        )
        if not at:  # a sensor: its own reading, and the plant for the state at the start
            d = np.eye(n_y)[:, [problem.data.names.index(element)]]
            plain = Sampled(plain.phi, np.zeros((plain.phi.shape[0], 1)), plain.c, d)
        return _whitened(plain, problem.whitening)


def latent_model(probes: Probes) -> LatentModel:
    """Ports of the fitted model as latent inputs."""
    return LatentModel(probes)


def _held(a: Array, b: Array, c: Array, d: Array, h: float) -> Sampled:
    """First-order hold, the state shifted by the part of the newest sample."""
    n, m = b.shape
    if n == 0:
        return Sampled(a, b, c, d)
    _, (scale, _) = matrix_balance(a, permute=False, separate=True)
    a, b, c = a * scale[None, :] / scale[:, None], b / scale[:, None], c * scale[None, :]
    size = np.abs(b).max(axis=0) * h
    size = np.where(size > 0, size, 1.0)
    z = np.zeros((n + 2 * m, n + 2 * m))
    z[:n, :n], z[:n, n : n + m] = a * h, b * h / size
    z[n : n + m, n + m :] = np.eye(m)
    e = expm(z)
    phi, late = e[:n, :n], e[:n, n + m :] * size
    early = e[:n, n : n + m] * size - late
    return Sampled(phi, early + phi @ late, c, d + c @ late)


def _whitened(model: Sampled, polynomials: Sequence[Array]) -> Sampled:
    """Pass the readings through the autoregressive polynomial of each channel's noise."""
    for channel, polynomial in enumerate(polynomials):
        order = polynomial.size - 1
        if not order:
            continue
        n, k = model.phi.shape[0], model.d.shape[1]
        phi = np.zeros((n + order, n + order))
        phi[:n, :n] = model.phi
        phi[n, :n] = model.c[channel]
        phi[n + 1 :, n:-1] = np.eye(order - 1)
        # the newest reading enters the shift register; its direct part goes with the latent input
        gamma = np.vstack([model.gamma, model.d[channel][None], np.zeros((order - 1, k))])
        c = np.hstack([model.c, np.zeros((model.c.shape[0], order))])
        c[channel, n:] = polynomial[1:]
        model = Sampled(phi, gamma, c, model.d)
    return model
