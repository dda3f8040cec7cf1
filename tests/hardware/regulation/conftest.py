"""The bench of the recorder's tests serves loops too."""

import pytest

from tests.hardware.recorder.conftest import bench, library, target

__all__ = ["bench", "library", "target"]


@pytest.fixture(autouse=True)
def _patient(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let a busy machine be slow: nothing here tests a bench that does not answer."""
    monkeypatch.setenv("BONDSIGHT_BENCH_SIOS_TIMEOUT", "60")
