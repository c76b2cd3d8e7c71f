"""Laws in place of the effects: what these recordings cannot tell from what was named.

Effects of the catalogue that explain the recordings to the noise may imitate what is missing there, as friction in
proportion to the load imitates the gain of a current sensor. So a law is searched as if no effect had been found; one
that explains the held-out recordings as well is a rival of the effects, and so are the places where its term does so.
A law of one term that was found where no effect explains anything has rivals of the same kind.
"""

from collections.abc import Iterator, Sequence

from thsa_cosim.diagnosis.choosing.attribution import Attribution, round_of
from thsa_cosim.diagnosis.choosing.findings import values_of
from thsa_cosim.diagnosis.choosing.gates import SIGMAS
from thsa_cosim.diagnosis.choosing.score import Scored
from thsa_cosim.diagnosis.choosing.selection import TIE_SHARE
from thsa_cosim.diagnosis.explaining.empirical import terms_of
from thsa_cosim.diagnosis.fitting.fit import Fit
from thsa_cosim.diagnosis.fitting.structure import block_gains, consistency
from thsa_cosim.diagnosis.fitting.trials import Trial
from thsa_cosim.diagnosis.results import RivalLaw


def rival_laws(effects: Attribution, law: Attribution, trials: Sequence[Trial]) -> tuple[RivalLaw, ...]:
    """The ``law`` that was found without the ``effects`` and what ties with it, if they tie with the effects.

    ``trials``: of both searches.
    """
    base, ours, theirs = law.base_validate, law.final_validate, effects.final_validate
    lead = block_gains([t for t in trials if t.part == "validate"], ours, theirs)
    gain = float(base @ base - ours @ ours)
    if consistency(lead) >= SIGMAS and float(lead.sum()) >= TIE_SHARE * gain:
        return ()
    return tuple(_alternatives(law))


def tied_laws(law: Attribution) -> tuple[RivalLaw, ...]:
    """Other terms that explain the held-out recordings as well as a ``law`` of one term, each in place of it."""
    return tuple(_alternatives(law))[1:]


def _alternatives(law: Attribution) -> Iterator[RivalLaw]:
    """The law itself; of a single term what explains the held-out recordings as well."""
    yield _law(law.accepted, law.plain_final)
    if len(law.accepted) == 1:
        for rival in round_of(law, law.accepted[0]).rivals:
            yield _law([rival], rival.fit)


def _law(scored: Sequence[Scored], fit: Fit) -> RivalLaw:
    values = values_of(fit, declared=False)
    terms = tuple(term for one in scored for term in terms_of(one, values))
    return RivalLaw(terms, values_of(fit, declared=True))
