"""The progress of an acquisition, for the eyes."""

from hardware.live.gathering import Gathering
from hardware.live.snapshot import Snapshot
from hardware.live.state import ChannelState, LiveState, StreamState
from hardware.live.text import one_line, render
from hardware.live.view import LiveView
from hardware.live.watching import Report, Watching

__all__ = [
    "ChannelState",
    "Gathering",
    "LiveState",
    "LiveView",
    "Report",
    "Snapshot",
    "StreamState",
    "Watching",
    "one_line",
    "render",
]
