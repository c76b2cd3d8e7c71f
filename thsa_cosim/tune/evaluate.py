"""Sets of gains under all conditions, outside of any search: every term of every condition, and the signals."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from thsa_cosim.signals import FloatArray, Signals
from thsa_cosim.study import Engine, Request, Want
from thsa_cosim.tune.combine import Combined
from thsa_cosim.tune.problem import Group


@dataclass(frozen=True, eq=False)
class Evaluation:
    """One set of values under every case of a group: terms (c, q), their combination, and the signals."""

    values: dict[str, float]
    terms: FloatArray
    combined: Combined
    signals: tuple[Signals | None, ...]
    reason: str


def evaluate(
    engine: Engine, group: Group, sets: Sequence[dict[str, float]], *, keep_signals: bool = False
) -> list[Evaluation]:
    """Evaluate whole sets of values under every case of ``group``; the journal only knows the worst terms."""
    each = [[values] * len(group.cases) for values in sets]
    return evaluate_each(engine, group, each, keep_signals=keep_signals)


def evaluate_each(
    engine: Engine, group: Group, sets: Sequence[Sequence[dict[str, float]]], *, keep_signals: bool = False
) -> list[Evaluation]:
    """The same with values of its own for every case (a schedule); ``values`` is then that of the first."""
    vectors = np.array([[[values[name] for name in group.names] for values in each] for each in sets])
    want = Want.SIGNALS if keep_signals else Want.TERMS
    engine.plan(group, len(sets))
    reply = engine.ask(group, Request(want, vectors))
    return [
        Evaluation(
            values=dict(each[0]),
            terms=group.terms(outcomes),
            combined=group.combine(outcomes),
            signals=tuple(o.signals for o in outcomes),
            reason=reason,
        )
        for each, outcomes, reason in zip(sets, reply.outcomes, reply.reasons, strict=True)
    ]
