"""Adapters to Bluesky (by its protocols, no import), PyMeasure and QCoDeS (imported late).

The last two stand in modules of their own: `with_pymeasure` and `with_qcodes`.
"""

from hardware.ecosystem.block import BlockPlan as BlockPlan
from hardware.ecosystem.block import PartialTake as PartialTake
from hardware.ecosystem.block import block_arrays as block_arrays
from hardware.ecosystem.block import take_block as take_block
from hardware.ecosystem.bluesky_block import BlueskyBlock as BlueskyBlock
from hardware.ecosystem.bluesky_displacement import BlueskyDisplacement as BlueskyDisplacement
from hardware.ecosystem.bluesky_displacement import DisplacementSource as DisplacementSource
from hardware.ecosystem.bluesky_voltage import BlueskyVoltage as BlueskyVoltage
from hardware.ecosystem.status import ActionStatus as ActionStatus
