"""A value where a law leaves room for it."""

from __future__ import annotations

from bondgraph.laws import Law


def beside(law: Law | None, value: float) -> float | None:
    """Return the value, None beside a law that is whole without it."""
    return value if law is None or law.slope is None else None
