"""Which effects these recordings cannot distinguish: principal angles between what they would do to the outputs.

The responses of the candidates, less what the declared parameters imitate, span one plane each; the smallest principal
angle between two planes (A. Bjorck, G. Golub, Mathematics of Computation 27 (1973) 579) says how alike they are. An
effect that explains a gain G leaves at least G sin^2(angle) to a candidate at that angle from it.
"""

from collections.abc import Sequence

import numpy as np
from scipy.cluster.hierarchy import fcluster, linkage
from scipy.spatial.distance import squareform

from thsa_cosim.diagnosis.choosing.attribution import Attribution
from thsa_cosim.diagnosis.choosing.screen import Orthogonal, Proposal
from thsa_cosim.diagnosis.results import EquivalenceClass
from thsa_cosim.signals import FloatArray


def equivalence(found: Attribution) -> tuple[EquivalenceClass, ...]:
    """Classes of candidates that the fit recordings cannot distinguish at an ordinary size, closest first.

    Two candidates are alike if what one of ordinary size (its ``typical`` coefficients) does beyond the other gains
    less than chance does; within a class every two are. What would drown in chance by itself is in no class.
    """
    if not found.rounds:
        return ()
    one = found.rounds[0]
    best: dict[str, Proposal] = {}
    for proposal in one.proposals:  # best first
        if _ordinary_gain(proposal) > one.threshold:
            best.setdefault(proposal.candidate.key, proposal)
    chosen = tuple(best.values())
    if len(chosen) < 2:
        return ()
    orthogonal = Orthogonal(found.base)
    angles = principal_angles([orthogonal.remaining(p.response) for p in chosen])
    gains = np.array([_ordinary_gain(p) for p in chosen])
    beyond = np.sin(angles) ** 2 * np.minimum.outer(gains, gains) / one.threshold
    np.fill_diagonal(beyond, 0.0)
    labels = fcluster(linkage(squareform(beyond, checks=False), "complete"), 1.0, "distance")
    classes = []
    for label in np.unique(labels):
        members = np.flatnonzero(labels == label)
        names = tuple(dict.fromkeys(chosen[k].candidate.name for k in members))
        if len(names) > 1:
            own = angles[np.ix_(members, members)][np.triu_indices(members.size, 1)]
            classes.append(EquivalenceClass(names, float(np.degrees(own.min()))))
    return tuple(sorted(classes, key=lambda c: c.angle_deg))


def principal_angles(responses: Sequence[FloatArray]) -> FloatArray:
    """(m, m) the smallest principal angle in rad between the columns of every two of m responses (N, k)."""
    bases = [_orthonormal(response) for response in responses]
    edges = np.cumsum([0, *(basis.shape[1] for basis in bases)])
    together = np.concatenate(bases, axis=1)
    products = np.asarray(together.T @ together)
    angles = np.zeros((len(bases), len(bases)))
    for i in range(len(bases)):
        for j in range(i):
            block = products[edges[i] : edges[i + 1], edges[j] : edges[j + 1]]
            largest = float(np.linalg.norm(block, 2)) if block.size else 0.0
            angles[i, j] = angles[j, i] = np.arccos(min(largest, 1.0))
    return angles


def _orthonormal(response: FloatArray) -> FloatArray:
    """(N, r) an orthonormal basis of the columns (N, k); what is nearly a combination of the others is left out."""
    size = np.linalg.norm(response, axis=0)
    if size.size == 1 and size[0] > 0.0:
        return np.asarray(response / size, dtype=np.float64)
    left, values, _ = np.linalg.svd(response[:, size > 0.0] / size[size > 0.0], full_matrices=False)
    return np.asarray(left[:, values > 1e-3], dtype=np.float64)


def _ordinary_gain(proposal: Proposal) -> float:
    """What the candidate explains at its typical coefficients, in variances of the noise."""
    typical = np.array([p.typical for p in proposal.candidate.coefficients])
    return float(np.max(typical**2 * np.diag(proposal.precision)))
