"""Show a take while it runs: what the recorder reports, to terminal and picture."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol, final

from hardware.contracts import Chunk
from hardware.live.gathering import Gathering
from hardware.live.snapshot import Snapshot
from hardware.live.view import LiveView


class Report(Protocol):
    """What the recorder tells of a running take."""

    @property
    def phase(self) -> str:
        """What it does: "prepare", "play", "drain", "end"."""
        ...

    @property
    def late(self) -> int:
        """Samples of the output that came late."""
        ...

    @property
    def chunks(self) -> Sequence[Chunk]:
        """What arrived since the last report."""
        ...


@final
class Watching:
    """Takes reports, shows the state when it is time.

    Parameters
    ----------
    gathering : Gathering
        Counts.
    view : LiveView, optional
        The terminal.
    snapshot : Snapshot, optional
        The picture.
    """

    def __init__(
        self,
        gathering: Gathering,
        view: LiveView | None = None,
        snapshot: Snapshot | None = None,
    ) -> None:
        self.gathering = gathering
        self._view, self._snapshot = view, snapshot

    def __call__(self, report: Report) -> None:
        """Count what a report brings, and show it if it is time."""
        if self._view is None and self._snapshot is None:
            return
        for chunk in report.chunks:
            self.gathering.take(chunk)
        if report.late:
            self.gathering.warn("output: samples came late, see the flag LATE")
        self.gathering.phase = report.phase
        if report.phase == "end":
            self.gathering.end()
        self.refresh(report.phase == "end")

    def refresh(self, at_once: bool = False) -> None:
        """Show the state if it is time; at once after something that must be seen."""
        view = self._view is not None and (at_once or self._view.due or self.gathering.urgent)
        picture = self._snapshot is not None and (at_once or self._snapshot.due)
        if not (view or picture):
            return
        state = self.gathering.state()
        if self._view is not None and view:
            self._view.show(state)
        if self._snapshot is not None and picture:
            if self._snapshot.error:
                self.gathering.warn(f"live picture: {self._snapshot.error}")
            self._snapshot.show(state)

    def close(self, sentence: str = "") -> None:
        """Show the end, with a last warning if there is one; any number of times."""
        if sentence:
            self.gathering.warn(sentence)
        self.gathering.end()
        self.refresh(at_once=True)
        if self._snapshot is not None:
            self._snapshot.close()
