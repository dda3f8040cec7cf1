"""What a published protocol gives: errors beside targets, parameters beside published ones."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from bondgraph.support.arrays import Array


@dataclass(frozen=True, slots=True)
class Reached:
    """An error of a simulation, and what it should not exceed.

    Attributes
    ----------
    name : str
        What was simulated.
    value : float
        Root mean square error, in `unit`.
    unit : str
    target : float or None
        Largest error that counts as reached; None where nothing comparable is published.
    """

    name: str
    value: float
    unit: str
    target: float | None = None

    @property
    def reached(self) -> bool | None:
        """Whether the target is met; None without one."""
        return None if self.target is None else bool(self.value <= self.target)


@dataclass(frozen=True, slots=True)
class Compared:
    """A fitted parameter beside its published value.

    Attributes
    ----------
    name, unit : str
    value, published : float
        SI.
    tolerance : float or None
        Relative distance that counts as reached; None if it is only shown.
    """

    name: str
    value: float
    unit: str
    published: float
    tolerance: float | None = None

    @property
    def distance(self) -> float:
        """Relative distance from the published value, with sign."""
        return self.value / self.published - 1.0

    @property
    def reached(self) -> bool | None:
        """Whether the value lies within the tolerance; None without one."""
        return None if self.tolerance is None else bool(abs(self.distance) <= self.tolerance)


@dataclass(frozen=True)
class Outcome:
    """Result of one protocol.

    Attributes
    ----------
    name, title : str
    official : bool
        Whether split and initial samples are those of the benchmark; otherwise they are ours and
        no figure of the literature may be set beside them.
    protocol : str
        Training and scored samples, in words.
    split : str
        Hash of the samples that train and that are scored, see `split_hash`.
    init : int
        Samples at the start of each scored record that are not scored.
    errors : tuple of Reached
        Of free-run simulations.
    parameters : tuple of Compared
    values : dict of str to float
        All fitted parameters of the model, SI.
    seconds : float
    notes : tuple of str
        What the reader should know.
    """

    name: str
    title: str
    official: bool
    protocol: str
    split: str
    init: int
    errors: tuple[Reached, ...]
    parameters: tuple[Compared, ...] = ()
    values: Mapping[str, float] = field(default_factory=dict)
    seconds: float = 0.0
    notes: tuple[str, ...] = ()

    @property
    def reached(self) -> bool:
        """Whether every target is met."""
        near = all(p.reached is not False for p in self.parameters)
        return near and all(e.reached is not False for e in self.errors)

    def error(self, name: str) -> Reached:
        """Return the error of this name."""
        from bondgraph.support.errors import unknown_name

        known = {e.name: e for e in self.errors}
        if name not in known:
            raise unknown_name("error", name, self.name, known)
        return known[name]

    def to_dict(self) -> dict[str, Any]:
        """Return plain JSON data."""
        return {
            "name": self.name,
            "title": self.title,
            "official": self.official,
            "protocol": self.protocol,
            "split": self.split,
            "init": self.init,
            "kind": "free-run simulation",
            "reached": self.reached,
            "errors": [
                {"name": e.name, "rmse": e.value, "unit": e.unit, "target": e.target,
                 "reached": e.reached}
                for e in self.errors
            ],
            "parameters": [
                {"name": p.name, "value": p.value, "unit": p.unit, "published": p.published,
                 "tolerance": p.tolerance, "reached": p.reached}
                for p in self.parameters
            ],
            "values": dict(self.values),
            "seconds": self.seconds,
            "notes": list(self.notes),
        }  # fmt: skip


def split_hash(*parts: tuple[str, Sequence[Array]]) -> str:
    """Return the first twelve digits of the SHA-256 of named groups of samples.

    Parameters
    ----------
    *parts : (str, sequence of ndarray)
        Role (``"train"``, ``"test"``) and the arrays, inputs first; their values are hashed as
        little-endian doubles, so a shifted or rescaled split has another hash.

    Examples
    --------
    >>> split_hash(("train", [np.arange(3.0)])) == split_hash(("train", [np.arange(3.0)]))
    True
    >>> split_hash(("train", [np.arange(3.0)])) == split_hash(("test", [np.arange(3.0)]))
    False
    """
    digest = hashlib.sha256()
    for role, arrays in parts:
        for a in arrays:
            block = np.ascontiguousarray(a, dtype="<f8")
            digest.update(f"{role}:{block.shape}".encode())
            digest.update(block.tobytes())
    return digest.hexdigest()[:12]
