"""The progress of an acquisition, for the eyes."""

from hardware.live.gathering import Gathering as Gathering
from hardware.live.snapshot import Snapshot as Snapshot
from hardware.live.state import ChannelState as ChannelState
from hardware.live.state import LiveState as LiveState
from hardware.live.state import StreamState as StreamState
from hardware.live.text import one_line as one_line
from hardware.live.text import render as render
from hardware.live.view import LiveView as LiveView
from hardware.live.watching import Report as Report
from hardware.live.watching import Watching as Watching
