"""What one decision looks at: the hypotheses with their scores, and the knobs they are held to."""

from __future__ import annotations

from dataclasses import dataclass, replace

from identification.diagnosis.evidence.block_score import BlockScore
from identification.diagnosis.evidence.kind_score import KindScore
from identification.diagnosis.evidence.remaining import Remaining
from identification.diagnosis.localisation.structural_classes import Isolability
from identification.diagnosis.search.candidates import Candidate


@dataclass(frozen=True)
class Thresholds:
    """The knobs of the decision, set on development seeds and then kept.

    Attributes
    ----------
    z : float
        Standard errors by which a hypothesis must lag behind the best to leave the set.
    noise : float
        Root mean square over a measured noise above which what is left is no noise.
    gain : float
        Least gain worth naming: mean square that an effect removes, in units of the noise.
    law : float
        Least part of what the best flexible form explains that a named law must explain.
    """

    z: float = 3.0
    noise: float = 1.5
    gain: float = 0.05
    law: float = 0.95


@dataclass(frozen=True, eq=False)
class Scored:
    """A fitted law with its score and what it leaves.

    Attributes
    ----------
    idle : bool
        All that it has beyond a simpler law that was fitted there has zero in its interval.
    """

    trial: Candidate
    score: BlockScore
    left: Remaining
    idle: bool = False

    @property
    def element(self) -> str:
        """Its place."""
        return self.trial.element


Hypothesis = Scored | KindScore


@dataclass(frozen=True, eq=False)
class Evidence:
    """Everything that one decision looks at.

    Attributes
    ----------
    plain : BlockScore
        The model without a further effect.
    laws : tuple of Scored
        Best first; the unnamed curve may be among them.
    kinds : tuple of KindScore
        Best first.
    before : Remaining
        What is left without a further effect.
    nominal : float
        Held-out mean square over the floor without one.
    trained : float
        The same on training samples.
    named : tuple of str
        Places of the effects that were named before this one.
    untried : tuple of (str, str)
        Effects with their places that could not be fitted beside what is in the model.
    located : tuple of str
        The only places where the mismatch may sit, whatever its law; empty where that is not known.
    along : bool
        Kinds were held against the true course of what was added there.
    paired : tuple of (str, str)
        Elements and kinds, of those in question, that all good pairs hold (`kind_pairs`).
    several : bool
        More than one recording is fitted.
    """

    plain: BlockScore
    laws: tuple[Scored, ...]
    kinds: tuple[KindScore, ...]
    before: Remaining
    nominal: float
    trained: float
    classes: Isolability | None = None
    named: tuple[str, ...] = ()
    untried: tuple[tuple[str, str], ...] = ()
    located: tuple[str, ...] = ()
    along: bool = False
    paired: tuple[tuple[str, str], ...] = ()
    several: bool = False

    @property
    def here(self) -> Evidence:
        """Only what sits at one of the places where the mismatch may sit.

        They are told of laws at one place: one that joins two is never excluded.
        """
        if not self.located:
            return self
        return replace(
            self,
            laws=tuple(
                s for s in self.laws if s.element in self.located or s.trial.insertion.joined
            ),
            kinds=tuple(k for k in self.kinds if k.element in self.located),
        )
