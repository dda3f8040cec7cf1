"""What is unknown in a model with process noise, and where it stands in theta."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bondgraph.support.arrays import Array


@dataclass(frozen=True, slots=True)
class Diffusion:
    """White noise of unknown intensity that enters the rate of a state.

    Attributes
    ----------
    place : str
        As it was named: a state, an element with a state, or a source.
    index : int
        Position among the states, or among the inputs.
    at_source : bool
        The noise is added to a command and acts where the command acts.
    unit : str
        Of the intensity: the state's (or the command's, times seconds) by square root of time.
    """

    place: str
    index: int
    at_source: bool
    unit: str


@dataclass(frozen=True, slots=True)
class FilterSlots:
    """Where each kind of unknown stands in theta."""

    n_free: int
    n_sigma: int
    n_noise: int
    n_offset: int
    n_state: int
    n_records: int

    @property
    def free(self) -> slice:
        """Model parameters."""
        return slice(0, self.n_free)

    @property
    def sigma(self) -> slice:
        """Logarithms of the diffusions."""
        return slice(self.n_free, self.n_free + self.n_sigma)

    @property
    def noise(self) -> slice:
        """Logarithms of the readings' noise."""
        return slice(self.sigma.stop, self.sigma.stop + self.n_noise)

    def offsets(self, record: int) -> slice:
        """Offsets of a record's readings, over the readings' scale."""
        start = self.noise.stop + record * (self.n_offset + self.n_state)
        return slice(start, start + self.n_offset)

    def states(self, record: int) -> slice:
        """Return where a record starts, less its rest, over the states' scale."""
        start = self.offsets(record).stop
        return slice(start, start + self.n_state)

    def of_record(self, record: int) -> Array:
        """Positions of everything a record depends on."""
        own = slice(self.offsets(record).start, self.states(record).stop)
        return np.concatenate([np.arange(self.noise.stop), np.arange(own.start, own.stop)])

    @property
    def size(self) -> int:
        """Length of theta."""
        return int(self.noise.stop) + self.n_records * (self.n_offset + self.n_state)
