"""Which of the accepted effects are needless beside the others."""

from collections.abc import Sequence

import numpy as np

from thsa_cosim.diagnosis.catalogue.candidate import Candidate
from thsa_cosim.diagnosis.choosing.gates import SIGMAS, out_of_range
from thsa_cosim.diagnosis.choosing.score import Scored, extended_unknowns
from thsa_cosim.diagnosis.fitting.bench import Bench
from thsa_cosim.diagnosis.fitting.fit import Fit, refine
from thsa_cosim.diagnosis.fitting.structure import block_gains, consistency, structures
from thsa_cosim.diagnosis.fitting.unknowns import Unknowns
from thsa_cosim.diagnosis.fitting.weights import ChannelWeights
from thsa_cosim.signals import FloatArray


def prune(
    bench: Bench,
    unknowns: Unknowns,
    weights: ChannelWeights,
    accepted: list[Scored],
    current: Fit,
    held: FloatArray,
    visible: float = np.inf,
) -> tuple[list[Scored], Fit, FloatArray, list[str]]:
    """Drop every earlier effect that the later ones have made needless.

    One that explains more than ``visible`` (rms structure, in standard deviations of the noise) of a signal stays, and
    one without which a declared parameter ends at its range.
    """
    notes: list[str] = []
    while len(accepted) > 1:
        for dropped in accepted[:-1]:
            kept = [s for s in accepted if s is not dropped]
            if _carries(dropped.candidate, [s.candidate for s in kept]):
                continue
            fewer = extended_unknowns(unknowns, kept)
            fit = refine(
                bench,
                fewer,
                current.at(fewer.names),
                jacobian=current.jacobian_of(fewer),
                steps=current.steps_of(fewer),
                near=True,
                iterations=6,
                enough=3.0,
                to_beat=current.cost,
            )
            validate = None if fit is None else bench.residuals(fewer, fit.vector[None, :], "validate")[0]
            if fit is None or validate is None:
                continue
            if out_of_range(fit) and not out_of_range(current):  # the others need it
                continue
            lost = block_gains(bench.of("validate"), validate, held)
            total = float(weights.base_held @ weights.base_held - held @ held)
            sure = consistency(lost) >= SIGMAS
            if sure and _explained(bench, weights, validate, held) > visible**2:
                continue
            if not sure or float(lost.sum()) < 0.01 * total:
                notes.append(f"{dropped.candidate.name} was dropped: the other effects explain the same")
                accepted, current, held = kept, fit, validate
                break
        else:
            break
    return accepted, current, held, notes


def _explained(bench: Bench, weights: ChannelWeights, without: FloatArray, held: FloatArray) -> float:
    """Mean squared structure, in variances of the noise, that ``held`` (N,) lacks of ``without``, in one signal."""
    trials = bench.of("validate")
    more, less = (structures(trials, weights.plain(residual, "validate")) for residual in (without, held))
    return max(more[name] - less[name] for name in more)


def within_range(
    bench: Bench, unknowns: Unknowns, accepted: list[Scored], base: Fit, current: Fit, held: FloatArray
) -> tuple[list[Scored], Fit, FloatArray, list[str]] | None:
    """Drop the last effect as long as a declared parameter ends at its range; None if what is left does not run."""
    notes: list[str] = []
    while accepted and (name := out_of_range(current)):
        notes.append(f"{accepted[-1].candidate.name} was dropped: it drives {name} to the end of its range")
        accepted = accepted[:-1]
        current = accepted[-1].fit if accepted else base
        fewer = extended_unknowns(unknowns, accepted)
        # Its own fit holds every effect before it, those that were dropped since as well.
        if set(current.unknowns.names) != set(fewer.names):
            again = refine(bench, fewer, current.at(fewer.names), jacobian=current.jacobian_of(fewer))
            if again is None:
                return None
            current = again
        fallen = bench.residuals(current.unknowns, current.vector[None, :], "validate")[0]
        if fallen is None:
            return None
        held = fallen
    return accepted, current, held, notes


def _carries(candidate: Candidate, others: Sequence[Candidate]) -> bool:
    """Whether one of ``others`` is a part that is only offered beside the candidate; a ripple's orders are equals."""
    waves = any(p.scanned for p in candidate.parameters)
    return not waves and not candidate.variant.beside and bool(further_parts(candidate, others))


def further_parts(accepted: Candidate, candidates: Sequence[Candidate]) -> list[Candidate]:
    """What else the accepted effect's block can do in the same place, such as a ripple's further orders."""
    return [
        c
        for c in candidates
        if c.variant.beside and (c.variant.block, c.slot.name) == (accepted.variant.block, accepted.slot.name)
    ]
