"""The truth of a bench: shown, or sealed until the end."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Self


@dataclass(frozen=True, slots=True)
class SealedEnvelope:
    """A truth as plain values with its commitment: SHA-256 over a random salt and canonical JSON.

    The file that `save` writes is one of `SealedTruth`.

    Parameters
    ----------
    hash : str
        The only part to show before the diagnosis.
    salt, payload : str
        Not shown by ``repr``.
    """

    hash: str
    salt: str = field(repr=False)
    payload: str = field(repr=False)

    @classmethod
    def closed(cls, truth: Mapping[str, Any]) -> Self:
        """Seal plain values with a fresh salt."""
        salt = os.urandom(32).hex()
        payload = json.dumps(truth, sort_keys=True, separators=(",", ":"), allow_nan=False)
        return cls(hashlib.sha256(f"{salt}:{payload}".encode()).hexdigest(), salt, payload)

    def truth(self) -> dict[str, Any]:
        """Open it."""
        return json.loads(self.payload)  # type: ignore[no-any-return]

    def save(self, path: str | Path) -> None:
        """Write hash, salt and payload as JSON, at once or not at all."""
        content = {"hash": self.hash, "salt": self.salt, "payload": self.payload}
        file = Path(path)
        scratch = file.with_name(f".{file.name}.{os.getpid()}")
        scratch.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
        scratch.replace(file)
