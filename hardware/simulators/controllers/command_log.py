"""What a simulated device was told; the last part of it, so that a bench can serve for days."""

from __future__ import annotations

from typing import final

__all__ = ["CommandLog"]

_MOST = 100_000


@final
class CommandLog(list[str]):
    """Commands in their order."""

    def add(self, command: str) -> None:
        """Append one; forgets the older half of too many."""
        self.append(command)
        if len(self) > _MOST:
            del self[: _MOST // 2]
