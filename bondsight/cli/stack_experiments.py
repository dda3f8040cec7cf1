"""Experiments on the simulated stack: loading curve, charge drive, two clocks.

Each function prints tables, writes an SVG figure if asked, and returns 0. Every number is computed.
"""

from __future__ import annotations

from bondsight.cli.stack_charge import charge_drive
from bondsight.cli.stack_clocks import clock_skew
from bondsight.cli.stack_loading import mechanical

__all__ = ["charge_drive", "clock_skew", "mechanical"]
