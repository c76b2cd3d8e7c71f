"""Further starts of a curve over the speed, from a fitted one: at other exponents, and as another form.

Where a breakaway makes the machine stick and slip, each event sits where one curve puts it: Gauss-Newton ends in an
optimum near its start, with an exponent that has hardly moved. A curve of another exponent that is near the fitted one
over the speeds keeps the events in their places, and shows whether it fits better.
"""

from collections.abc import Mapping

import numpy as np
from scipy.optimize import least_squares

from thsa_cosim.diagnosis.catalogue.candidate import Candidate
from thsa_cosim.diagnosis.choosing.score import Scored, judge
from thsa_cosim.diagnosis.choosing.selection import Selection
from thsa_cosim.diagnosis.fitting.fit import Fit, refine
from thsa_cosim.signals import FloatArray

#: Exponents from which a fit sets out: those of the literature (1 and 2), and about them.
EXPONENTS = (0.7, 1.0, 1.4, 2.0, 2.8)
#: Exponents nearer to the fitted one than this factor lead where it was found.
SAME = 1.1
#: A fit that comes so near to the known one, as a share of each parameter, needs no more.
ARRIVED = 0.05
#: How many of the starts are fitted with all parameters.
WHOLE = 2
#: Speeds over which two curves are compared, in multiples of the slot's largest.
SPEEDS = np.linspace(0.003, 1.0, 300)


def along_exponents(selection: Selection, one: Scored, like: Scored) -> Scored:
    """``one``, or a better fit of it, from curves that are near the one of ``like`` in the same place.

    ``one`` is fitted with all parameters, and so is what comes back. A form that is no such curve stays as it is.
    """
    bench, known = selection.bench, one.fit
    own = known.unknowns.index([p.variable for p in one.candidate.parameters if not p.fixed])
    tried: list[Fit] = []
    for vector in _starts(one, like):
        residual = bench.residuals(known.unknowns, vector[None, :], "fit")[0]
        if residual is None:
            continue
        fit = refine(
            bench,
            known.unknowns,
            vector,
            residual=residual,
            jacobian=known.jacobian,
            steps=known.steps,
            fresh=own,
            anew=True,
            iterations=4,
            enough=3.0,
        )
        if fit is not None and not np.allclose(fit.vector[own], known.vector[own], rtol=ARRIVED):
            tried.append(fit)
    best = known
    for fit in sorted(tried, key=lambda f: f.cost)[:WHOLE]:
        whole = refine(
            bench,
            fit.unknowns,
            fit.vector,
            residual=fit.residual,
            jacobian=fit.jacobian,
            steps=fit.steps,
            near=True,
            to_beat=best.cost,
        )
        if whole is not None and whole.cost < best.cost:
            best = whole
    if best is known:
        return one
    return judge(bench, one.proposal, best, selection.current, selection.held) or one


def _starts(one: Scored, like: Scored) -> list[FloatArray]:
    """(n,) vectors of the unknowns of ``one``: the declared parameters and the nearest curves of ``like``'s fit."""
    unknowns = one.fit.unknowns
    values = {**unknowns.named(one.fit.vector), **like.fit.unknowns.named(like.fit.vector)}
    is_same = one.candidate.key == like.candidate.key
    at = [values[p.variable] for p in like.candidate.parameters if p.name == "n" and is_same]
    held_at: list[dict[str, float]] = [] if is_same else [{}]
    if "n" in {p.name for p in one.candidate.parameters}:
        held_at = [{"n": n} for n in EXPONENTS if not any(max(n / a, a / n) < SAME for a in at)]
    found = []
    for held in held_at:
        curve = nearest(one.candidate, held, like.candidate, values)
        if curve is not None:
            found.append(unknowns.clip(np.array([{**values, **curve}[name] for name in unknowns.names])))
    return found


def nearest(
    candidate: Candidate, held: Mapping[str, float], like: Candidate, values: Mapping[str, float]
) -> dict[str, float] | None:
    """The candidate's parameters, by variable, whose law is nearest that of ``like`` at ``values`` (by variable).

    ``held``: parameters that keep a value, by name. None where a law is no curve over the speed alone, or has a
    parameter that the other one lacks.
    """
    one, two = candidate.variant.law, like.variant.law
    start = {p.name: values[p.variable] for p in like.parameters if p.variable in values}
    free = [p for p in candidate.parameters if p.name not in held]
    at = _speeds(candidate)
    if one is None or two is None or at is None or any(not start.get(p.name) for p in free):
        return None
    try:
        aim = two(start, at)
        size = np.array([start[p.name] for p in free])

        def off(x: FloatArray) -> FloatArray:
            values = dict(zip((p.name for p in free), x * size, strict=True))
            return np.asarray((one({**values, **held}, at) - aim) / np.abs(aim).max())

        off(np.ones(size.size))
    except KeyError:  # a law of more than the speed
        return None
    low, high = np.sort(np.array([[p.lower, p.upper] for p in free]) / size[:, None], axis=1).T
    found = least_squares(off, np.clip(1.0, low, high), bounds=(low, high))
    return {p.variable: float(x) for p, x in zip(free, found.x * size, strict=True)} | {
        p.variable: held[p.name] for p in candidate.parameters if p.name in held
    }


def falls(candidate: Candidate, values: Mapping[str, float]) -> bool:
    """Whether its law at ``values`` (by variable) falls over the speed alone: a friction that may excite itself."""
    law, at = candidate.variant.law, _speeds(candidate)
    if law is None or at is None:
        return False
    try:
        force = np.asarray(law({p.name: values[p.variable] for p in candidate.parameters}, at))
    except KeyError:  # a law of more than the speed
        return False
    return bool(np.all(np.diff(force) <= 0.0) and force[0] > force[-1])


def _speeds(candidate: Candidate) -> dict[str, FloatArray] | None:
    """What the slot of a curve over the speed sees up to its largest speed; None where no speed is a parameter."""
    lengths = [
        p.typical / q.typical
        for p, q in zip(candidate.parameters, candidate.variant.parameters, strict=True)
        if q.dimension == "V" and not p.fixed
    ]
    return {"v": lengths[0] * SPEEDS, "s": np.ones(SPEEDS.size)} if lengths else None
