"""The bench of the recorder's tests serves loops too."""

from tests.hardware.recorder.conftest import _drawn_once, bench, library, target

__all__ = ["_drawn_once", "bench", "library", "target"]
