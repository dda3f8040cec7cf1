"""What a simulated device was told, and the instant at which it obeys."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar, final

from hardware.simulators.rig import Rig

_T = TypeVar("_T")

_MOST = 100_000


@final
class CommandLog(list[str]):
    """Commands in their order; the last part of them, so that a bench can serve for days."""

    def add(self, command: str) -> None:
        """Append one; forgets the older half of too many."""
        self.append(command)
        if len(self) > _MOST:
            del self[: _MOST // 2]


def standing_still(rig: Rig, act: Callable[[], _T]) -> _T:
    """Return what `act` does at one instant, also on a bench whose time passes by itself."""
    done: list[_T] = []
    with rig.lock:
        # what was due before is done by asking for the time; then it stands until act is done
        rig.at(rig.now, lambda: done.append(act()))
    return done[0]
