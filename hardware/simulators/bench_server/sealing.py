"""The truth of a bench: shown, or sealed until the end."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

from hardware.simulators.seal import Sealed


@dataclass(frozen=True, slots=True)
class SealedEnvelope(Sealed):
    """A sealed truth as plain values; the file that `save` writes is one of `SealedTruth`."""

    def truth(self) -> dict[str, Any]:
        """Open it."""
        return json.loads(self.payload)  # type: ignore[no-any-return]
