"""Standard errors that cover what every model says that may be true: forms and rivals that fit within chance.

A model that fits worse counts by its likelihood, one that fits as well or better (as a wider form does) wholly: the
form is one more thing that is not known, and what it leaves open no simpler form knows better.
"""

from collections.abc import Sequence

import numpy as np

from thsa_cosim.diagnosis.choosing.attribution import Attribution, round_of
from thsa_cosim.diagnosis.choosing.forms import likelihood
from thsa_cosim.diagnosis.choosing.score import Scored
from thsa_cosim.diagnosis.fitting.fit import Fit
from thsa_cosim.diagnosis.fitting.trials import Trial
from thsa_cosim.diagnosis.fitting.uncertainty import standard_errors
from thsa_cosim.signals import FloatArray


def between_models(found: Attribution, fit: Fit, trials: Sequence[Trial]) -> FloatArray:
    """(n,) what rivals and forms of the accepted effects add to the standard errors of ``fit``, in quadrature.

    Each of them bends the declared parameters in its own way. An effect's own coefficients
    are compared between its forms; beside a rival they mean nothing. ``trials``: the fit recordings.
    """
    variance = np.zeros(len(fit.unknowns.members))
    for scored in found.accepted:
        one = round_of(found, scored)
        assert one.accepted is not None
        others = (*one.rivals, *one.forms)
        if others:
            own = standard_errors(one.accepted.fit, trials)
            variance += np.max(
                [
                    likelihood(other, one.accepted) * _apart(fit, one.accepted, own, other, trials)
                    for other in others
                ],
                axis=0,
            )
    return np.asarray(np.sqrt(variance))


def _apart(fit: Fit, winner: Scored, own: FloatArray, other: Scored, trials: Sequence[Trial]) -> FloatArray:
    """(n,) squared distance between two models' values of the unknowns of ``fit``, and what the other is less sure."""
    found = np.zeros(len(fit.unknowns.members))
    errors = standard_errors(other.fit, trials)
    ours, theirs = winner.fit.unknowns.names, other.fit.unknowns.names
    for k, name in enumerate(fit.unknowns.names):
        counterpart = _counterpart(name, winner, other)
        if name not in ours or counterpart not in theirs:
            continue
        a, b = ours.index(name), theirs.index(counterpart)
        wider = errors[b] ** 2 - own[a] ** 2 if np.isfinite(errors[b]) and np.isfinite(own[a]) else 0.0
        found[k] = (other.fit.vector[b] - winner.fit.vector[a]) ** 2 + max(0.0, wider)
    return found


def _counterpart(name: str, winner: Scored, other: Scored) -> str:
    """Name in the other model of an unknown; a coefficient's in another block by its own name, "" if it has none."""
    own = next((p for p in winner.candidate.parameters if p.variable == name), None)
    if own is None:
        return name
    if other.candidate.name != winner.candidate.name:
        return ""
    return next(
        (
            p.variable
            for p in other.candidate.parameters
            if p.variable == name or (p.name == own.name and p.role == own.role == "coefficient")
        ),
        "",
    )
