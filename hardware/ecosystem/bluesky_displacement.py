"""A displacement sensor as a Bluesky detector; satisfies the protocols without importing it."""

from __future__ import annotations

from typing import Any, Protocol, final, runtime_checkable

from hardware.contracts import Flag, Identity
from hardware.ecosystem.documents import number_key, readings, source_of
from hardware.ecosystem.status import ActionStatus
from hardware.errors import BeamLost


class DisplacementReading(Protocol):
    """One displacement and what is known against it."""

    @property
    def value(self) -> float:
        """Displacement (m)."""
        ...

    @property
    def flags(self) -> Flag:
        """Sum of flags."""
        ...


@runtime_checkable
class DisplacementSource(Protocol):
    """A sensor that can be asked for single values, such as `hardware.devices.interferometer`'s."""

    @property
    def identity(self) -> Identity:
        """The device."""
        ...

    def zero(self) -> None:
        """Set the displacement to zero here; clears a lost beam."""
        ...

    def read(self) -> DisplacementReading:
        """Return the displacement now; `BeamLost` if it means nothing."""
        ...


@final
class BlueskyDisplacement:
    """Readable, Triggerable and Stageable.

    Parameters
    ----------
    source : DisplacementSource
        The interferometer.
    name : str
        Of the field in the events; ``<name>_flags`` stands beside it.
    zero_on_stage : bool
        Set to zero when a run begins.
    """

    parent: None = None

    def __init__(
        self, source: DisplacementSource, name: str = "displacement", *, zero_on_stage: bool = True
    ) -> None:
        self._source = source
        self.name = name
        self._zero_on_stage = zero_on_stage
        self._last: DisplacementReading | None = None

    @property
    def hints(self) -> dict[str, Any]:
        """What to plot."""
        return {"fields": [self.name]}

    def trigger(self) -> ActionStatus:
        """Take one value.

        A lost beam fails it: every later value would be off by unknown fringes.
        """
        return ActionStatus.run(f"read {self.name}", self._take)

    def _take(self) -> DisplacementReading:
        reading = self._source.read()
        self._last = reading
        if reading.flags & (Flag.BEAM_LOST | Flag.MISCOUNT):
            raise BeamLost(
                f"{self.name}: {reading.value:g} m is off by unknown fringes; align and zero",
                partial=reading,
            )
        return reading

    def read(self) -> dict[str, dict[str, Any]]:
        """Return the value of the last trigger (m) and its flags; without one, take it now."""
        last = self._take() if self._last is None else self._last
        return readings({self.name: last.value, f"{self.name}_flags": int(last.flags)})

    def describe(self) -> dict[str, dict[str, Any]]:
        """Return unit and source."""
        source = source_of(self._source.identity)
        return {
            self.name: number_key(source, "m", precision=12),
            f"{self.name}_flags": {"source": source, "dtype": "integer", "shape": []},
        }

    def stage(self) -> ActionStatus:
        """Forget the last value, and set to zero if asked for.

        The zero is taken before this returns. An engine stages the devices of a plan without
        waiting in between: a voltage that powers up meanwhile would move the mirror under it.
        """
        self._last = None
        if not self._zero_on_stage:
            return ActionStatus.finished(f"stage {self.name}")
        return ActionStatus.at_once(f"zero {self.name}", self._source.zero)

    def unstage(self) -> ActionStatus:
        """Forget the last value."""
        self._last = None
        return ActionStatus.finished(f"unstage {self.name}")
