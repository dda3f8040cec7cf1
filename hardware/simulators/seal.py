"""Commitment to a truth before the diagnosis, opened after it.

The commitment is SHA-256 over a random salt and the canonical JSON of the truth.  Publishing the
hash binds the bench; the salt keeps a small catalogue from being guessed by hashing it through.
"""

from __future__ import annotations

import hashlib
import hmac
import json
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Self, final

_SALT_BYTES = 32


class SealBrokenError(ValueError):
    """The content of an envelope is not what its hash promised."""


@final
@dataclass(frozen=True, slots=True)
class SealedEnvelope:
    """Hash of a truth and the envelope that opens it.

    Parameters
    ----------
    hash
        Commitment, 64 hexadecimal digits; the only part to show before the diagnosis.
    salt
        Random salt, hexadecimal; not shown by ``repr``.
    payload
        Canonical JSON of the truth; not shown by ``repr``.
    """

    hash: str
    salt: str = field(repr=False)
    payload: str = field(repr=False)

    @classmethod
    def closed(cls, truth: Mapping[str, Any]) -> Self:
        """Seal plain values with a fresh salt."""
        salt, payload = os.urandom(_SALT_BYTES).hex(), _canonical(truth)
        return cls(_digest(salt, payload), salt, payload)

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read what ``save`` wrote; ``truth`` does the checking."""
        content = json.loads(Path(path).read_text(encoding="utf-8"))
        return cls(content["hash"], content["salt"], content["payload"])

    def truth(self) -> dict[str, Any]:
        """Give the plain values after checking them against the hash.

        Raises
        ------
        SealBrokenError
            If salt or payload was changed after sealing.
        """
        if not hmac.compare_digest(_digest(self.salt, self.payload), self.hash):
            raise SealBrokenError(
                f"the envelope does not match its commitment {self.hash[:12]}...: the truth or "
                "the salt was changed after sealing; discard this run"
            )
        values: dict[str, Any] = json.loads(self.payload)
        return values

    def save(self, path: str | Path) -> None:
        """Write hash, salt and payload as JSON, at once or not at all.

        Keep the file away from the diagnosis.
        """
        content = {"hash": self.hash, "salt": self.salt, "payload": self.payload}
        file = Path(path)
        scratch = file.with_name(f".{file.name}.{os.getpid()}")
        scratch.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
        scratch.replace(file)


def _canonical(values: Mapping[str, Any]) -> str:
    return json.dumps(values, sort_keys=True, separators=(",", ":"), allow_nan=False)


def _digest(salt: str, payload: str) -> str:
    return hashlib.sha256(f"{salt}:{payload}".encode()).hexdigest()
