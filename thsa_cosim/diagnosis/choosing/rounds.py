"""One round of the search as it is kept: what was proposed, refined and decided."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import zip_longest

from thsa_cosim.diagnosis.choosing.chance import probability
from thsa_cosim.diagnosis.choosing.score import Scored
from thsa_cosim.diagnosis.choosing.screen import Proposal
from thsa_cosim.signals import FloatArray

#: Objections to what another form, or another effect, takes the place of.
TAKEN = "another form of it fits better"
APART = "explains the held-out recordings as well, but not the fit recording that distinguishes them"


@dataclass(frozen=True, eq=False)
class Round:
    """One screening: its threshold, what was proposed, what was refined (best first) and what was decided.

    ``objections``: why each of the first refined ones was not accepted, "" for the one that was. ``rivals``: other
    effects that explain the held-out recordings as well as the accepted one, within the uncertainty; ``forms``: other
    forms of it that do. ``factors`` (N,): how the residuals of the fit recordings were weighed.
    """

    threshold: float
    proposals: tuple[Proposal, ...]
    scored: tuple[Scored, ...]
    accepted: Scored | None
    objections: tuple[str, ...]
    rivals: tuple[Scored, ...]
    gains: FloatArray
    factors: FloatArray
    forms: tuple[Scored, ...] = ()

    @property
    def folded(self) -> "Round":
        """The same without the Jacobians of what was only weighed; errors are compared with those of the rivals."""
        whole = {id(s) for s in (self.accepted, *self.rivals, *self.forms)}
        return replace(self, scored=tuple(s if id(s) in whole else s.folded for s in self.scored))

    @property
    def without_responses(self) -> "Round":
        """The same without the responses of what was not refined: those of the first round tell what is alike."""
        refined = {id(s.proposal) for s in (*self.scored, *self.rivals)}
        return replace(self, proposals=tuple(p if id(p) in refined else p.summary for p in self.proposals))

    def with_accepted(self, choice: Scored) -> "Round":
        """The same with ``choice`` in place of the accepted one."""
        old = self.accepted
        if old is None or old.proposal is choice.proposal:
            return self
        proposals = tuple(choice.proposal if p is old.proposal else p for p in self.proposals)
        scored = tuple(choice if s.proposal is old.proposal else s for s in self.scored)
        return replace(self, proposals=proposals, scored=scored, accepted=choice)

    def probability(self, gain: float) -> float:
        """Probability that chance makes at least ``gain``."""
        return probability(gain, self.gains)


def number_of(rounds: Sequence[Round], scored: Scored) -> int:
    """Which of the ``rounds`` accepted an effect, from 0."""
    return next(
        k for k, r in enumerate(rounds) if r.accepted is not None and r.accepted.proposal is scored.proposal
    )


def taken_over(
    choice: Scored, scored: Sequence[Scored], objections: Sequence[str]
) -> tuple[list[Scored], tuple[str, ...]]:
    """What was refined, and its objections, with a better form in the first place."""
    others = [(s, why) for s, why in zip_longest(scored, objections) if s.proposal is not choice.proposal]
    whys = [
        why or (TAKEN if s.candidate.name == choice.candidate.name else APART)
        for s, why in others
        if why is not None
    ]
    return [choice, *(s for s, _ in others)], ("", *whys)
