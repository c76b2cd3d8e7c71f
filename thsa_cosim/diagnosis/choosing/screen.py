"""Which effects could explain what the declared model leaves: linear responses of the superset, one batch.

Each candidate's coefficients are stepped from the fitted base model, every start of its shape parameters in turn. The
responses are made orthogonal to what the declared parameters can explain; the gain is the decrease of the squared
residuals that the candidate's best combination promises (the score test, Rao 1948).
"""

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from thsa_cosim.diagnosis.catalogue.candidate import Candidate
from thsa_cosim.diagnosis.fitting.bench import AT_ONCE, Bench
from thsa_cosim.diagnosis.fitting.fit import RESPONSE, Fit
from thsa_cosim.diagnosis.fitting.unknowns import Unknown, Unknowns
from thsa_cosim.signals import FloatArray

_WANTED = 3.0 * RESPONSE
_ROWS = 20_000
#: Left of a response after orthogonalisation (as a share of its square) below which nothing can be said.
TESTABLE = 1e-6


@dataclass(frozen=True, eq=False)
class Proposal:
    """A candidate with its shapes at one of their starts: ``response`` (N, k) per unit of each coefficient.

    ``gain``: promised decrease of the squared residuals; ``amplitudes`` (k,) promise it. ``remaining``: share of the
    response that the declared parameters cannot imitate. ``precision`` (k, k): inverse covariance of the amplitudes.
    """

    candidate: Candidate
    shapes: Mapping[str, float]
    response: FloatArray
    gain: float
    amplitudes: FloatArray
    remaining: float
    precision: FloatArray
    held: frozenset[str] = frozenset()
    """Names of shapes that are known: orders of the machine."""
    moves: Mapping[str, FloatArray] = field(default_factory=dict)
    """By unknown of the model, in its unit: (k,) what imitates one unit of each coefficient best."""

    @property
    def stderr(self) -> FloatArray:
        """(k,) standard errors of the amplitudes, infinite where the response says nothing."""
        size = np.sqrt(np.diag(self.precision))
        if not size.all():
            return np.where(size > 0.0, 1.0 / np.where(size > 0.0, size, 1.0), np.inf)
        # of single precision, products of responses that are alike can have a negative eigenvalue, which says nothing
        values, vectors = np.linalg.eigh(self.precision / np.outer(size, size))
        known = values > TESTABLE * values[-1]
        return np.asarray(np.sqrt(np.sum(vectors[:, known] ** 2 / values[known], axis=1)) / size)

    @property
    def is_testable(self) -> bool:
        """Whether it would do anything to the fit recordings, whatever declared parameters can imitate."""
        return bool(np.isfinite(self.response).all() and np.any(self.precision))

    @property
    def summary(self) -> "Proposal":
        """The same without its response, which takes megabytes."""
        return replace(self, response=np.empty((0, self.response.shape[1])))  # a slice would keep it

    @property
    def label(self) -> str:
        """Candidate and shapes."""
        settings = ", ".join(f"{name} = {value:.3g}" for name, value in self.shapes.items())
        return self.candidate.key + (f" ({settings})" if settings else "")


def shape_starts(
    candidate: Candidate, scanned: Mapping[str, Sequence[float]], known: Mapping[str, float]
) -> list[dict[str, float]]:
    """Every combination of the starts of the candidate's shape parameters; ``scanned`` adds to them by slot.

    A shape that is in the model already (``known``, by variable) keeps its value.
    """
    names, choices = [], []
    for p in candidate.parameters:
        if p.role == "shape":
            further = scanned.get(candidate.slot.name, ()) if p.scanned else ()
            names.append(p.name)
            starts = dict.fromkeys((*p.starts, *(w for w in further if p.lower <= w <= p.upper)))
            choices.append((known[p.variable],) if p.variable in known else tuple(starts))
    return [dict(zip(names, combination, strict=True)) for combination in itertools.product(*choices)]


def screen(
    bench: Bench,
    base: Fit,
    candidates: Sequence[Candidate],
    scanned: Mapping[str, Sequence[float]],
) -> list[Proposal]:
    """All proposals, best first; a candidate that cannot be simulated is left out."""
    known = base.unknowns.named(base.vector)
    rows = [
        (candidate, shapes)
        for candidate in candidates
        if not candidate.variant.instead
        if not candidate.variant.beside or any(p.variable in known for p in candidate.all_parameters)
        for shapes in shape_starts(candidate, scanned, known)
    ]
    return propose(bench, base, rows)


def propose(bench: Bench, base: Fit, rows: Sequence[tuple[Candidate, Mapping[str, float]]]) -> list[Proposal]:
    """A proposal for every candidate with its shapes at given starts, best first, less what cannot be simulated."""
    variables = {p.variable: p for c, _ in rows for p in c.parameters}
    own = [
        Unknown(v, v, p.unit, p.at_start, np.inf, p.typical, p.lower, p.upper, declared=False)
        for v, p in variables.items()
        if v not in base.unknowns.names
    ]
    unknowns = base.unknowns.with_members(own)
    index = {name: k for k, name in enumerate(unknowns.names)}
    start = np.concatenate([base.vector, [u.start for u in own]])
    columns: list[tuple[int, str, float, FloatArray]] = []  # row, variable, step
    for r, (candidate, shapes) in enumerate(rows):
        at = start.copy()
        for p in candidate.parameters:
            if p.role == "shape":
                at[index[p.variable]] = shapes[p.name]
        columns += [(r, p.variable, p.typical, at) for p in candidate.coefficients]
    found: dict[tuple[int, str], FloatArray] = {}
    for _ in range(2):
        vectors = np.array([at for *_, at in columns]) if columns else np.zeros((0, start.size))
        for vector, (_, variable, step, _at) in zip(vectors, columns, strict=True):
            vector[index[variable]] += step
        again = []
        for (r, variable, step, at), residual in zip(
            columns, _in_batches(bench, unknowns, vectors, base.residual.size), strict=True
        ):
            if residual is None:
                again.append((r, variable, 0.1 * step, at))
                continue
            difference = residual - base.residual
            norm = float(np.linalg.norm(difference))
            found[r, variable] = np.asarray(difference / step, dtype=np.float32)
            if not _WANTED / 30 < norm < _WANTED * 30:
                again.append((r, variable, step * float(np.clip(_WANTED / max(norm, 1e-9), 1e-3, 30.0)), at))
        columns = again
        if not columns:
            break
    proposals, orthogonal = [], Orthogonal(base)
    for r, (candidate, shapes) in enumerate(rows):
        responses = [found.pop((r, p.variable), None) for p in candidate.coefficients]
        if all(response is not None for response in responses):
            proposals.append(_propose(base, orthogonal, candidate, shapes, np.stack(responses, axis=1)))  # type: ignore[arg-type]
    return sorted(proposals, key=lambda p: -p.gain)


def _in_batches(
    bench: Bench, unknowns: Unknowns, vectors: FloatArray, size: int
) -> Iterator[FloatArray | None]:
    """The residuals of each vector; of long recordings only as many at a time as memory should hold."""
    count = max(1, AT_ONCE // (8 * size))
    for first in range(0, len(vectors), count):
        yield from bench.residuals(unknowns, vectors[first : first + count], "fit")


class Orthogonal:
    """Removes from responses what a fit's own unknowns can imitate."""

    def __init__(self, base: Fit) -> None:
        self._jacobian = np.asarray(base.jacobian, dtype=np.float32)
        self._factor = _factor(base.information)

    def project(self, response: FloatArray) -> FloatArray:
        """(n, k) the unknowns' moves that imitate ``response`` (N, k) best."""
        return np.asarray(cho_solve(self._factor, (self._jacobian.T @ response).astype(float)))

    def remaining(self, response: FloatArray, moves: FloatArray | None = None) -> FloatArray:
        """``response`` (N, k) less what the unknowns imitate, by its ``moves`` (n, k) where they are known."""
        moves = self.project(response) if moves is None else moves
        return np.asarray(response - self._jacobian @ moves.astype(np.float32))

    def products(self, responses: Sequence[FloatArray]) -> FloatArray:
        """(K, K) products of what remains of ``responses`` (N, k) each, side by side; a block of rows at a time."""
        moves = [self.project(response).astype(np.float32) for response in responses]
        count = sum(move.shape[1] for move in moves)
        found = np.zeros((count, count))
        for first in range(0, self._jacobian.shape[0], _ROWS):
            rows = slice(first, first + _ROWS)
            left = [r[rows] - self._jacobian[rows] @ m for r, m in zip(responses, moves, strict=True)]
            block = np.concatenate(left, axis=1)
            found += block.T @ block
        return found


def _factor(information: FloatArray) -> tuple[FloatArray, bool]:
    """Cholesky factor of an information matrix with a small ridge; larger where rounding leaves it indefinite.

    An unknown on which nothing depends is its own direction.
    """
    size = np.diag(information)
    ridge = np.diag(np.where(size > 0.0, size, 1.0))
    for share in (1e-9, 1e-7, 1e-5):
        try:
            return cho_factor(information + share * ridge)
        except np.linalg.LinAlgError:
            continue
    return cho_factor(np.diag(np.diag(ridge)))


def _propose(
    base: Fit, orthogonal: Orthogonal, candidate: Candidate, shapes: Mapping[str, float], response: FloatArray
) -> Proposal:
    moved = orthogonal.project(response)
    left = orthogonal.remaining(response, moved)
    whole = np.asarray(response.T @ response, dtype=float)
    precision = np.asarray(left.T @ left, dtype=float)
    pull = -np.asarray(left.T @ base.residual, dtype=float)
    scale = np.sqrt(np.maximum(np.diag(whole), 1e-300))
    eigenvalues, vectors = np.linalg.eigh(precision / np.outer(scale, scale))
    kept = eigenvalues > TESTABLE
    inverse = (vectors[:, kept] / eigenvalues[kept]) @ vectors[:, kept].T
    amplitudes = inverse @ (pull / scale) / scale
    if len(amplitudes) == 1:  # a coefficient that can only be positive
        only = candidate.coefficients[0]
        amplitudes = np.clip(amplitudes, only.lower - only.neutral, None)
    return Proposal(
        candidate=candidate,
        shapes=shapes,
        response=response,
        gain=float(2.0 * pull @ amplitudes - amplitudes @ precision @ amplitudes),
        amplitudes=amplitudes,
        remaining=float(np.trace(precision / np.outer(scale, scale)) / len(scale)),
        precision=precision,
        moves=dict(zip(base.unknowns.names, moved * base.unknowns.scale[:, None], strict=True)),
    )
