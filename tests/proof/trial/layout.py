"""Where the files of a trial lie: one folder to commit, one for data and the seal beside it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, slots=True)
class Layout:
    """Paths of a trial.

    Attributes
    ----------
    folder : Path
        What is committed: public list, commitment, answers, score, and the truths at the end.
    """

    folder: Path

    @property
    def public(self) -> Path:
        """Plant, sensors and what is declared of every recording."""
        return self.folder / "public.json"

    @property
    def commitment(self) -> Path:
        """Hashes, commit of the tool and thresholds, written before the run."""
        return self.folder / "commitment.json"

    @property
    def note(self) -> Path:
        """What became known of the trial after the commitment, such as a salt that is public."""
        return self.folder / "NOTE.md"

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
    def revealed(self) -> Path:
        """Truths and salt after the answers are in."""
        return self.folder / "revealed.json"

    @property
    def data(self) -> Path:
        """Folder beside `folder`: the generator's; too large, and too secret, to be committed."""
        return self.folder.with_name(self.folder.name + "-data")

    @property
    def recordings(self) -> Path:
        """Folder of the recordings, `ID.npz`."""
        return self.data / "records"

    @property
    def truths(self) -> Path:
        """The truths while they are sealed."""
        return self.data / "sealed" / "truths.json"

    @property
    def drawn(self) -> Path:
        """The kind of trial that the salt was drawn for."""
        return self.data / "sealed" / "kind.txt"

    @property
    def salt(self) -> Path:
        """The salt while it is sealed."""
        return self.data / "sealed" / "salt.txt"
