"""What explains most where the model is kept in step: candidates beside a model that sticks and slips.

What a little of an effect would do to the free run of such a machine hardly tells one effect from another.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from thsa_cosim.diagnosis.catalogue.candidate import Candidate
from thsa_cosim.diagnosis.choosing.orders import Machine
from thsa_cosim.diagnosis.choosing.ripples import on_orders
from thsa_cosim.diagnosis.choosing.score import go_on, score
from thsa_cosim.diagnosis.choosing.screen import Proposal, Say, screen
from thsa_cosim.diagnosis.fitting.continuation import InStep
from thsa_cosim.diagnosis.fitting.fit import Fit, refine

#: So many effects and places are fitted in step, if they promise this share of the best one's gain, so many starts of
#: each, and so many of all freely.
FITTED, WORTH, STARTS, FREED = 6, 0.1, 2, 2

Scan = Callable[[Fit], Mapping[str, Sequence[float]]]


def found_in_step(
    in_step: InStep,
    current: Fit,
    candidates: Sequence[Candidate],
    scan: Scan,
    machine: Machine,
    say: Say,
) -> list[tuple[Proposal, Fit]]:
    """Those of ``candidates`` that explain most in step beside what ``current`` has, fitted freely in the end."""
    bench = in_step.held
    base = refine(bench, current.unknowns, current.vector, iterations=12, enough=3.0)
    held = None if base is None else bench.residuals(base.unknowns, base.vector[None, :], "validate")[0]
    if base is None or held is None:
        return []
    proposals = on_orders(screen(bench, base, candidates, scan(base)), machine, base)
    tried = []
    for proposal in best_of_each(proposals):
        say(f"fitting {proposal.label} in step")
        one = score(bench, base, held, proposal)
        tried += [] if one is None else [go_on(bench, one, base, held)]
    found = []
    for one in sorted(tried, key=lambda s: -s.held_out_gain)[:FREED]:
        say(f"fitting {one.proposal.label} freely from there")
        unknowns = one.fit.unknowns
        fit = in_step.fit(unknowns, unknowns.at_drawing(one.fit.vector), to_beat=current.misfit)
        found += [] if fit is None else [(replace(one.proposal), fit)]
    return found


def best_of_each(proposals: Sequence[Proposal]) -> list[Proposal]:
    """The best of ``proposals`` (best first): so many effects and places, so many starts of each."""
    chosen: list[Proposal] = []
    count: dict[str, int] = {}
    for p in proposals:
        name = p.candidate.name
        if p.gain < WORTH * proposals[0].gain or (name not in count and len(count) == FITTED):
            continue
        count[name] = count.get(name, 0) + 1
        if count[name] <= STARTS:
            chosen.append(p)
    return chosen
