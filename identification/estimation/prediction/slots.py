"""What is unknown in a study with process noise, and where it stands in theta.

First the unknowns of the joint problem, then the logarithms of the diffusions and of the readings'
noise, then where each record starts.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bondgraph.support.arrays import Array


@dataclass(frozen=True, slots=True)
class FilterSlots:
    """Where each kind of unknown stands in theta; `n_states` has an entry for each record."""

    n_joint: int
    n_sigma: int
    n_noise: int
    n_states: tuple[int, ...]

    @property
    def joint(self) -> slice:
        """Unknowns of the joint problem."""
        return slice(0, self.n_joint)

    @property
    def sigma(self) -> slice:
        """Logarithms of the diffusions."""
        return slice(self.n_joint, self.n_joint + self.n_sigma)

    @property
    def noise(self) -> slice:
        """Logarithms of the readings' noise."""
        return slice(self.sigma.stop, self.sigma.stop + self.n_noise)

    def states(self, record: int) -> slice:
        """Return where a record starts, less its rest, over the states' scale."""
        start = self.noise.stop + sum(self.n_states[:record])
        return slice(start, start + self.n_states[record])

    def of_record(self, columns: Array, record: int) -> Array:
        """Return what a record depends on: its `columns` of the joint unknowns and all others."""
        own = self.states(record)
        return np.concatenate(
            [columns, np.arange(self.n_joint, self.noise.stop), np.arange(own.start, own.stop)]
        )

    @property
    def size(self) -> int:
        """Length of theta."""
        return int(self.noise.stop) + sum(self.n_states)
