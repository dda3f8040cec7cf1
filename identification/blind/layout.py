"""Where the files of a trial lie: one folder to commit, one that stays sealed beside it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

__all__ = ["Layout"]


@dataclass(frozen=True, slots=True)
class Layout:
    """Paths of a trial.

    Attributes
    ----------
    folder : Path
        What is shown: the public list, recordings, commitment, answers, score.
    """

    folder: Path

    @property
    def public(self) -> Path:
        """Plant, sensors and declared dead times of every recording."""
        return self.folder / "public.json"

    @property
    def recordings(self) -> Path:
        """Folder of the recordings, `ID.csv` or `ID.npz`."""
        return self.folder / "recordings"

    @property
    def commitment(self) -> Path:
        """Hashes, commit of the tool and thresholds, written before the run."""
        return self.folder / "commitment.json"

    @property
    def answers(self) -> Path:
        """Folder of the answers, one a recording."""
        return self.folder / "answers"

    @property
    def oracle(self) -> Path:
        """Folder of what fits that were told the truth reach, one a recording."""
        return self.folder / "oracle"

    @property
    def withheld(self) -> Path:
        """Folder of the answers with the true law out of the catalogue."""
        return self.folder / "withheld"

    @property
    def score(self) -> Path:
        """Folder of the score."""
        return self.folder / "score"

    @property
    def sealed(self) -> Path:
        """Folder beside `folder` with the truths and the salt; not committed before the answers."""
        return self.folder.with_name(self.folder.name + "-sealed")

    @property
    def truths(self) -> Path:
        """The truths while they are sealed."""
        return self.sealed / "truths.json"

    @property
    def salt(self) -> Path:
        """The salt while it is sealed."""
        return self.sealed / "salt.txt"

    @property
    def revealed(self) -> Path:
        """Truths and salt after the answers are in."""
        return self.folder / "revealed.json"
