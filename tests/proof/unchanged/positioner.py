"""The positioner as a file that defines ``model()``."""

from __future__ import annotations

from models import positioner as model  # type: ignore[import-not-found]

__all__ = ["model"]
