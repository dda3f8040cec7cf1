"""The progress of an acquisition, for the eyes."""

from hardware.live.snapshot import Snapshot
from hardware.live.state import ChannelState, LiveState, Progress, StreamState
from hardware.live.text import one_line, render
from hardware.live.view import LiveView

__all__ = [
    "ChannelState",
    "LiveState",
    "LiveView",
    "Progress",
    "Snapshot",
    "StreamState",
    "one_line",
    "render",
]
