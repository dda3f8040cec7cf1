"""Adapters to Bluesky (by its protocols, no import), PyMeasure and QCoDeS (imported late).

The last two stand in modules of their own: `with_pymeasure` and `with_qcodes`.
"""

from hardware.ecosystem.block import BlockPlan, PartialTake, block_arrays, take_block
from hardware.ecosystem.bluesky_block import BlueskyBlock
from hardware.ecosystem.bluesky_displacement import BlueskyDisplacement, DisplacementSource
from hardware.ecosystem.bluesky_voltage import BlueskyVoltage
from hardware.ecosystem.status import ActionStatus

__all__ = [
    "ActionStatus",
    "BlockPlan",
    "BlueskyBlock",
    "BlueskyDisplacement",
    "BlueskyVoltage",
    "DisplacementSource",
    "PartialTake",
    "block_arrays",
    "take_block",
]
