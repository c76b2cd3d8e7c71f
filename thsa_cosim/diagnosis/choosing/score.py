"""One candidate fitted together with the declared parameters, and its score on the held-out recordings."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from thsa_cosim.diagnosis.catalogue.candidate import Candidate
from thsa_cosim.diagnosis.choosing.screen import Proposal
from thsa_cosim.diagnosis.fitting.bench import Bench
from thsa_cosim.diagnosis.fitting.fit import FORESEEN, Fit, refine
from thsa_cosim.diagnosis.fitting.structure import block_squares, consistency, relative_consistency, structure
from thsa_cosim.diagnosis.fitting.unknowns import Unknowns, unknowns_of
from thsa_cosim.signals import FloatArray

#: Mean squared residual, in variances of the noise, above which a fit may have missed the optimum.
ENOUGH = 1.05
#: Iterations of a fit that is gone on from in another way.
ROUGH = 2
#: What leaves less than this many times the squares of the noise leaves little beside it.
LITTLE = 2.0
#: Shares of the promised amplitudes that are tried where these gain less than FORESEEN of what they promised.
SHARES = (0.3, 0.1)


@dataclass(frozen=True, eq=False)
class Scored:
    """A candidate fitted together with the declared parameters, and its score on the held-out recordings.

    ``fit_gain``, ``held_out_gain``: decrease of the squared residuals in variances of the noise. ``consistency``: the
    held-out gain over blocks of time in standard errors. ``share``: of the held-out structure explained.
    """

    proposal: Proposal
    fit: Fit
    validate: FloatArray
    fit_gain: float
    held_out_gain: float
    consistency: float
    share: float

    @property
    def candidate(self) -> Candidate:
        """The candidate."""
        return self.proposal.candidate

    @property
    def folded(self) -> "Scored":
        """The same with a `Fit.folded`: of long recordings, what is only listed must not hold a Jacobian."""
        return replace(self, fit=self.fit.folded)


def score(
    bench: Bench, current: Fit, held: FloatArray, proposal: Proposal, iterations: int = 2
) -> Scored | None:
    """Fit a proposal's parameters beside the current ones, whose Jacobian is kept, and score it; None if it fails."""
    own = unknowns_of(proposal.candidate, proposal.shapes, proposal.held)
    unknowns = current.unknowns.with_members([u for u in own if u.name not in current.unknowns.names])
    members = unknowns.names
    new = [k for k in range(len(members)) if k >= len(current.unknowns.members)]
    amplitude = {
        p.variable: float(a)
        for p, a in zip(proposal.candidate.coefficients, proposal.amplitudes, strict=True)
    }
    start = unknowns.start
    start[: current.vector.size] = current.vector

    def at(share: float) -> FloatArray:
        trial = start.copy()
        for variable, value in amplitude.items():
            trial[members.index(variable)] += share * value
        return unknowns.clip(trial)

    trials = [at(1.0)]
    found = bench.residuals(unknowns, trials[0][None, :], "fit")
    if found[0] is None or current.misfit - float(found[0] @ found[0]) < FORESEEN * proposal.gain:
        trials += [at(share) for share in SHARES]
        found += bench.residuals(unknowns, np.array(trials[1:]), "fit")
    costs = [np.inf if r is None else float(r @ r) for r in found]
    best = int(np.argmin(costs))
    residual = found[best]
    if residual is None:
        return None
    jacobian = np.concatenate([current.jacobian, np.zeros((residual.size, len(new)))], axis=1)
    steps = np.concatenate([current.steps, np.full(len(new), 1e-2)])
    fit = refine(
        bench,
        unknowns,
        trials[best],
        residual=residual,
        jacobian=jacobian,
        steps=steps,
        fresh=new,
        anew=True,
        iterations=iterations,
        enough=3.0,
    )
    return None if fit is None else judge(bench, proposal, fit.sharing(current.jacobian), current, held)


def go_on(bench: Bench, scored: Scored, current: Fit, held: FloatArray, iterations: int = 4) -> Scored:
    """The same with further iterations, the Jacobian's columns of the declared parameters kept as in `score`."""
    fit = scored.fit
    if fit.converged:
        return scored
    again = refine(
        bench,
        fit.unknowns,
        fit.vector,
        residual=fit.residual,
        jacobian=fit.jacobian,
        steps=fit.steps,
        fresh=list(range(len(current.unknowns.members), len(fit.unknowns.members))),
        iterations=iterations,
        enough=3.0,
    )
    if again is None:
        return scored
    again = again if fit.shared is None else again.sharing(fit.shared)
    return judge(bench, scored.proposal, again, current, held) or scored


def judge(bench: Bench, proposal: Proposal, fit: Fit, current: Fit, held: FloatArray) -> Scored | None:
    """A fit with a proposal's parameters, judged on the held-out recordings; None if it fails there."""
    validate = bench.residuals(fit.unknowns, fit.vector[None, :], "validate")[0]
    if validate is None:
        return None
    trials = bench.of("validate")
    worse, better = block_squares(trials, held), block_squares(trials, validate)
    before, after = structure(trials, held), structure(trials, validate)
    return Scored(
        proposal=proposal,
        fit=fit,
        validate=validate,
        fit_gain=current.misfit - fit.misfit,
        held_out_gain=float((worse - better).sum()),
        consistency=max(consistency(worse - better), relative_consistency(worse, better)),
        share=(before - after) / before if before > 0.0 else 0.0,
    )


def polish(bench: Bench, choice: Scored, current: Fit, held: FloatArray, rough: bool = False) -> Scored:
    """The same with every Jacobian column fresh, and once more with the declared parameters from the drawing.

    A missing effect bends the declared parameters; from there an effect that acts by contact may not find its optimum.
    ``rough``: it is gone on from in another way, a first fit will do.
    """
    unknowns, iterations = choice.fit.unknowns, ROUGH if rough else 8
    fits = [refine(bench, unknowns, choice.fit.vector, steps=choice.fit.steps, iterations=iterations)]
    is_open = fits[0] is None or _is_bent(bench, fits[0]) or fits[0].misfit > ENOUGH * fits[0].residual.size
    if is_open and not rough:
        known = np.inf if fits[0] is None else fits[0].cost
        near, steps = (choice.fit if fits[0] is None else fits[0]).jacobian, choice.fit.steps
        drawn = unknowns.at_drawing(choice.fit.vector)
        fits.append(refine(bench, unknowns, drawn, jacobian=near, steps=steps, near=True, to_beat=known))
    best = min((f for f in fits if f is not None), key=lambda f: f.cost, default=None)
    if best is None:
        return choice
    return judge(bench, choice.proposal, best, current, held) or choice


def _is_bent(bench: Bench, fit: Fit) -> bool:
    """Whether a fit that leaves little but noise has declared parameters far from the drawing: it may have crept."""
    return fit.unknowns.is_far(fit.vector) and leaves_little(bench, fit)


def leaves_little(bench: Bench, fit: Fit) -> bool:
    """Whether a fit leaves little beside the noise, as it is weighed: no further effect bends its parameters."""
    return fit.misfit < LITTLE * bench.level("fit") ** 2 * fit.residual.size


def refit(
    bench: Bench,
    proposal: Proposal,
    current: Fit,
    held: FloatArray,
    unknowns: Unknowns,
    vector: FloatArray,
    steps: FloatArray | None = None,
) -> Scored | None:
    """A proposal fitted with all parameters from ``vector`` (n,), every Jacobian column fresh; None if it fails.

    ``steps`` (n,): the difference steps to begin with.
    """
    fit = refine(bench, unknowns, vector, steps=steps, enough=3.0)
    return None if fit is None else judge(bench, proposal, fit, current, held)


def extended_unknowns(declared: Unknowns, accepted: Sequence[Scored]) -> Unknowns:
    """The declared parameters and those of the accepted effects, the latter from their own starts."""
    members = [u for s in accepted for u in unknowns_of(s.candidate, s.proposal.shapes, s.proposal.held)]
    return declared.with_members(list({u.name: u for u in members}.values()))


def held_shapes(candidates: Sequence[Candidate]) -> dict[str, float]:
    """The shapes that no fit changes, by FMU variable, of every candidate: for each simulation of all effects."""
    return {p.variable: p.at_start for c in candidates for p in c.parameters if p.fixed}


def fixed_shapes(accepted: Sequence[Scored]) -> dict[str, float]:
    """The shapes that no fit changes, by FMU variable, at the values of the accepted proposals."""
    return {
        p.variable: s.proposal.shapes[p.name] for s in accepted for p in s.candidate.parameters if p.fixed
    }
