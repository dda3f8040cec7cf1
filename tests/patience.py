"""The one time that tests wait for another thread or process."""

from typing import Final

HANGS: Final = 300.0
"""Seconds after which it is taken to hang; no machine is that slow."""
