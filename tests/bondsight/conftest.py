"""A model file that can be used."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.bondsight.carriage_files import GOOD


@pytest.fixture
def model(tmp_path: Path) -> Path:
    file = tmp_path / "carriage.py"
    file.write_text(GOOD, encoding="utf-8")
    return file
