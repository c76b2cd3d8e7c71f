"""Which effects the recordings ask for: screen, refine, score on held-out recordings, accept one, and again.

Forward selection (each step against the model so far, declared parameters fitted along), then every accepted
effect must still be needed beside the others.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from thsa_cosim.diagnosis.catalogue.candidate import Candidate
from thsa_cosim.diagnosis.choosing.again import Model, asked_again
from thsa_cosim.diagnosis.choosing.chance import largest_gains, threshold
from thsa_cosim.diagnosis.choosing.forms import best_form, from_other_starts, rivals_forms
from thsa_cosim.diagnosis.choosing.gates import SMALLEST_STRUCTURE
from thsa_cosim.diagnosis.choosing.needless import further_parts, prune, within_range
from thsa_cosim.diagnosis.choosing.orders import NO_MACHINE, Machine
from thsa_cosim.diagnosis.choosing.places import tied_places
from thsa_cosim.diagnosis.choosing.ripples import first_free_orders, freed, on_orders
from thsa_cosim.diagnosis.choosing.rounds import Round, number_of, taken_over
from thsa_cosim.diagnosis.choosing.score import Scored
from thsa_cosim.diagnosis.choosing.screen import Proposal, screen
from thsa_cosim.diagnosis.choosing.selection import Say, Selection
from thsa_cosim.diagnosis.choosing.verdict import VISIBLE_BESIDE, leaves_structure
from thsa_cosim.diagnosis.fitting.bench import Bench
from thsa_cosim.diagnosis.fitting.fit import Fit, cost_of, refine
from thsa_cosim.diagnosis.fitting.unknowns import Unknowns
from thsa_cosim.diagnosis.fitting.weights import ChannelWeights
from thsa_cosim.signals import FloatArray

#: What is noted of an effect that was fitted in step, where that led to a better free run, and where it did not.
CONTINUED = (
    " makes the machine stick and slip: it was fitted with the model kept in step with a measured speed, then to the"
    " free run from there; the stated errors hold what the fits in step differ by"
)
NOT_CONTINUED = (
    " makes the machine stick and slip, and the model falls out of step with it: fits with it kept in step with a"
    " measured speed lead to no better free run; the stated errors hold what they differ by"
)
#: What is noted where such an effect is all that is missing.
IS_ALL = "nothing further was looked for: kept in step, the model leaves nothing but noise in any signal"
#: What is noted where the free run says little of what else there is.
NO_MORE = (
    "what else is missing was looked for with the model kept in step; its free run was asked only for what was found"
    " or does not show there"
)
Scan = Callable[[Fit], Mapping[str, Sequence[float]]]


@dataclass(frozen=True, eq=False)
class Attribution:
    """The declared model's fit, the rounds, the accepted effects in order, and the model with them.

    ``base_cost``: of the declared model's fit without weights, the prior's share included.
    ``base_validate``, ``final_validate`` (N,): held-out residuals of both, in standard deviations of the noise.
    ``factors`` (N,): how the fit recordings' residuals of ``final`` are weighed. ``sticking``: the names of effects
    that were found, or gone on from, with the model kept in step, be they dropped since.
    """

    base: Fit
    base_cost: float
    rounds: tuple[Round, ...]
    accepted: tuple[Scored, ...]
    final: Fit
    base_validate: FloatArray
    final_validate: FloatArray
    factors: FloatArray
    notes: tuple[str, ...] = ()
    sticking: tuple[str, ...] = ()

    @property
    def plain_final(self) -> Fit:
        """``final`` without weights."""
        final = self.final
        rows = final.jacobian / self.factors[:, None]
        return replace(final, residual=final.residual / self.factors, own=rows, shared=None)


def round_of(found: Attribution, scored: Scored) -> Round:
    """The round in which an accepted effect was accepted."""
    return found.rounds[number_of(found.rounds, scored)]


@dataclass(frozen=True, eq=False)
class Begun:
    """What was found in another way than by screening: rounds, effects, the model's fit with them, and what to note.

    ``held`` (N,): its held-out residuals. ``tried``: further fits that count in the first round as those of the
    screening do. ``in_step``: the free run says nothing of which effects are needless.
    """

    rounds: tuple[Round, ...]
    accepted: tuple[Scored, ...]
    fit: Fit
    held: FloatArray
    notes: tuple[str, ...] = ()
    tried: tuple[Scored, ...] = ()
    in_step: bool = False


#: The weights, the declared model's fit, and its held-out residuals (N,) → what is found at once.
Begin = Callable[[ChannelWeights, Fit, FloatArray], Begun | None]

#: An accepted effect, the model's fit with it, and its held-out residuals (N,).
Judged = tuple[Scored, Fit, FloatArray]


@dataclass(frozen=True, eq=False)
class Continued:
    """An accepted effect as it was, or better, and what was found on the ``ways`` to that.

    ``left``: the only candidates that may still be missing, whatever the free run leaves; None: all may. ``note``: why.
    ``rounds``: those in which what is ``beside`` it was found.
    """

    found: Judged
    ways: tuple[Scored, ...]
    left: Sequence[Candidate] | None = None
    note: str = ""
    rounds: tuple[Round, ...] = ()
    beside: tuple[Scored, ...] = ()


#: The weights, and what was accepted → what it leads to; None: there is no other way.
Continue = Callable[[ChannelWeights, Judged], Continued | None]


def attribute(
    bench: Bench,
    unknowns: Unknowns,
    candidates: Sequence[Candidate],
    scan: Scan,
    *,
    start: Fit | None = None,
    seed: int,
    most: int = 3,
    machine: Machine = NO_MACHINE,
    deep: bool = True,
    begin: Begin = lambda _weights, _base, _held: None,
    stuck: Begin = lambda _weights, _base, _held: None,
    continued: Continue = lambda _weights, _found: None,
    rough: Callable[[Scored], bool] = lambda _: False,
    settled: float = 0.0,
    least: float = 0.0,
    say: Say = lambda _: None,
) -> Attribution | None:
    """Find the effects; None if the model does not run.

    ``start``: what the same unknowns were fitted to before, on the same recordings (default: from the drawing).
    ``machine``: whose orders the ripples keep to. ``deep``: further starts, larger sizes, other forms and rivals count.
    ``begin``: what is found in another way first, and gone on from. ``stuck``: what is found in another way where
    nothing that the first screening leads to leaves nothing; effects that it finds are all that count. ``continued``: a
    better fit of an accepted effect, or the same, and other ways to it, which count as forms of it. ``rough``: whether
    ``continued`` is for a candidate, so that a first fit of it will do. ``settled``: structure, in standard deviations
    of the noise, which is not looked into any more beside an effect, nor for it whether a known order is free.
    ``least``: share of what is left that an effect has to promise.
    """
    say("fitting the declared model")
    base = refine(
        bench,
        unknowns,
        unknowns.start if start is None else start.at(unknowns.names),
        jacobian=None if start is None else start.jacobian_of(unknowns),
        steps=None if start is None else start.steps_of(unknowns),
        iterations=10,
    )
    if base is None:
        return None
    weights = ChannelWeights(bench)
    base, held = weights.weigh(base)
    if held is None:
        return None
    base_cost = cost_of(unknowns, base.vector, weights.plain(base.residual, "fit"))
    weights.base_held = held
    current, current_held = base, held
    rounds: list[Round] = []
    accepted: list[Scored] = []
    said: list[str] = []
    sticking: list[str] = []
    pool = candidates
    begun = begin(weights, base, held)
    if begun is not None:
        rounds, accepted, current, current_held = [*begun.rounds], [*begun.accepted], begun.fit, begun.held
    for _ in range(most):
        if accepted and weights.left(current_held) < SMALLEST_STRUCTURE**2:
            break
        if accepted and settled and not leaves_structure(bench, weights, current_held, settled):
            break
        if not pool:
            break
        beside = f" beside {accepted[-1].candidate.name}" if accepted else ""
        say(f"screening {len(pool)} candidates{beside}")
        offered = pool
        while offered:
            # The optimum of a free run that is out of step is where it began.
            selection = Selection(bench, weights, current, current_held, say, rough, pool is candidates)
            left = _left(offered, accepted, current)
            own = seed + len(rounds)
            screened = _screened(selection, left, scan(current), own, machine, least)
            if not rounds and selection.is_open(screened.scored):
                otherwise = stuck(weights, base, held)
                if otherwise is not None and otherwise.accepted:
                    begun, rounds, accepted = otherwise, [*otherwise.rounds], [*otherwise.accepted]
                    current, current_held = otherwise.fit, otherwise.held
                    sticking = [s.candidate.name for s in accepted]
                    break
                screened = screened.beside(() if otherwise is None else otherwise.tried)
            rounds.append(_round(selection, left, screened, own, accepted, offered is pool, deep).folded)
            if len(rounds) > 1:
                rounds[-1] = rounds[-1].without_responses
            choice = rounds[-1].accepted
            if choice is None:
                break
            is_rough = rough(choice) or not selection.whole
            fit, reweighed = weights.weigh(choice.fit, 0) if is_rough else weights.weigh(choice.fit)
            if reweighed is None:
                return None
            current_held = reweighed
            more: tuple[Round, ...] = ()
            others: tuple[Scored, ...] = ()
            if not settled:
                choice, fit, current_held = freed(bench, weights, choice, (fit, reweighed), say)
                way = continued(weights, (choice, fit, current_held))
                if way is not None:
                    led = way.found[1] is not fit
                    choice, fit, current_held = way.found
                    rounds[-1] = replace(rounds[-1], forms=way.ways)
                    sticking.append(choice.candidate.name)
                    said.append(choice.candidate.name + (CONTINUED if led else NOT_CONTINUED))
                    said += [way.note] if way.note else []
                    more, others = way.rounds, way.beside
                    if others:
                        rounds[-1] = _of_one_effect(rounds[-1], choice)
                    pool = candidates if way.left is None else way.left
            rounds[-1] = rounds[-1].with_accepted(choice)
            rounds += more
            accepted += [choice, *others]
            current = fit
            offered = further_parts(choice.candidate, pool)
        if offered is pool:
            break
    notes: list[str] = []
    lost = begun is not None and begun.in_step
    if not settled:  # else what is left may be what bends the model
        if not lost:
            accepted, current, current_held, notes = prune(
                bench, unknowns, weights, accepted, current, current_held, VISIBLE_BESIDE
            )
        kept = within_range(bench, unknowns, accepted, base, current, current_held)
        if kept is None:
            return None
        accepted, current, current_held, ended = kept
        notes += ended
        whole = Model(tuple(rounds), tuple(accepted), current, current_held)
        whole = whole if lost else asked_again(bench, unknowns, whole, say)
        accepted, current, current_held = list(whole.accepted), whole.fit, whole.held
        rounds = _with_places(bench, whole.rounds, accepted, current, current_held, candidates, machine)
    return Attribution(
        base,
        base_cost,
        tuple(rounds),
        tuple(accepted),
        current,
        weights.plain(weights.base_held, "validate"),
        weights.plain(current_held, "validate"),
        bench.factors("fit"),
        (*(begun.notes if begun is not None else ()), *said, *notes),
        tuple(sticking),
    )


def shallow_round(
    selection: Selection,
    candidates: Sequence[Candidate],
    waves: Mapping[str, Sequence[float]],
    accepted: Sequence[Scored],
    seed: int,
    machine: Machine,
    least: float,
) -> Round:
    """A round of `attribute` beside what is ``accepted``, without further starts, larger sizes and other forms.

    ``waves``: wave numbers by slot. ``least``: share of what is left that an effect has to promise.
    """
    left = _left(candidates, accepted, selection.current)
    screened = _screened(selection, left, waves, seed, machine, least)
    found = _round(selection, left, screened, seed, accepted, True, deep=False)
    if found.accepted is not None:
        choice, scored, objections = found.accepted, list(found.scored), found.objections
        better = selection.overtaking(choice, scored)
        if better is not None:
            choice, (scored, objections) = better, taken_over(better, scored, objections)
        rivals = selection.rivals(choice, scored, {s.candidate.effect.name for s in accepted})
        found = replace(found, accepted=choice, scored=tuple(scored), objections=objections, rivals=rivals)
    return found.folded


def _of_one_effect(found: Round, choice: Scored) -> Round:
    """``found`` without the rivals of ``choice`` but at other places: they were compared while another was missing."""
    own = choice.candidate.effect.name
    return replace(found, rivals=tuple(r for r in found.rivals if r.candidate.effect.name == own))


def _left(offered: Sequence[Candidate], accepted: Sequence[Scored], fit: Fit) -> list[Candidate]:
    """What is left of the ``offered`` beside what is ``accepted``, and in the model of ``fit``."""
    free = [c for c in offered if not any(_is_taken(c, s.candidate) for s in accepted)]
    return first_free_orders([c for c in free if not _is_known(c, fit)], fit)


def _with_places(
    bench: Bench,
    rounds: Sequence[Round],
    accepted: Sequence[Scored],
    current: Fit,
    held: FloatArray,
    candidates: Sequence[Candidate],
    machine: Machine,
) -> list[Round]:
    """``rounds`` with the accepted effects at other shafts among their rivals, where those explain as much."""
    found = list(rounds)
    for scored in accepted:
        k = number_of(found, scored)
        named = {s.candidate.name for s in (*accepted, *found[k].rivals)}
        others = [c for c in candidates if c.name not in named]
        more = tied_places(bench, scored, current, held, others, machine)
        found[k] = replace(found[k], rivals=(*found[k].rivals, *more))
    return found


def _is_known(candidate: Candidate, fit: Fit) -> bool:
    """Whether a coefficient of the candidate is in the model already, by another variant of its effect."""
    return any(p.variable in fit.unknowns.names for p in candidate.coefficients)


def _is_taken(candidate: Candidate, accepted: Candidate) -> bool:
    """Whether an accepted one leaves no room: the same, or another form of the same effect in the same place.

    Forms are alternatives: two of them at once only make up for each other's misfit.
    """
    alternative = not candidate.variant.beside and candidate.name == accepted.name
    return candidate.key == accepted.key or alternative


@dataclass(frozen=True, eq=False)
class _Screened:
    """What a screening proposes (best first), what chance gains, and what of it is refined (best first)."""

    proposals: list[Proposal]
    gains: FloatArray
    limit: float
    scored: list[Scored]

    def beside(self, tried: Sequence[Scored]) -> "_Screened":
        """The same with ``tried`` among what is refined."""
        return replace(self, scored=sorted([*tried, *self.scored], key=lambda s: -s.held_out_gain))


def _screened(
    selection: Selection,
    offered: Sequence[Candidate],
    waves: Mapping[str, Sequence[float]],
    seed: int,
    machine: Machine = NO_MACHINE,
    least: float = 0.0,
) -> _Screened:
    """Screen what is ``offered`` and refine the best; none counts that promises less than ``least`` of what is left."""
    proposals = on_orders(
        screen(selection.bench, selection.current, offered, waves), machine, selection.current
    )
    gains = largest_gains(selection.current, proposals, seed)
    limit = threshold(gains)
    if least:
        limit = max(limit, least * selection.current.misfit)
    return _Screened(proposals, gains, limit, selection.refined(proposals, limit))


def _round(
    selection: Selection,
    offered: Sequence[Candidate],
    screened: _Screened,
    seed: int,
    accepted: Sequence[Scored],
    whole: bool,
    deep: bool = True,
) -> Round:
    """Choose one of what is ``offered`` (``whole``: all effects, else parts of the last one) and ``screened``."""
    proposals, gains, limit, scored = screened.proposals, screened.gains, screened.limit, screened.scored
    if deep and whole and proposals and selection.is_open(scored):
        further = selection.further(proposals)
        scored = selection.refined_further(scored, proposals, further, limit)
        if not accepted:  # the first effect leaves the next ones a model that is led less far astray
            scored = selection.at_sizes(scored, proposals)
        proposals = sorted([*proposals, *further], key=lambda p: -p.gain)
        gains = largest_gains(selection.current, proposals, seed)
        limit = threshold(gains)
    choice, objections = selection.choose(scored, limit, not accepted, not whole)
    rivals: tuple[Scored, ...] = ()
    forms: tuple[Scored, ...] = ()
    if choice is not None and deep and whole:
        first = choice
        choice = from_other_starts(selection, choice)
        scored += rivals_forms(selection, choice, scored, proposals, offered)
        choice = selection.overtaking(choice, scored) or choice
        choice, forms = best_form(selection, choice, scored, proposals, offered)
        if choice is not first:
            scored, objections = taken_over(choice, scored, objections)
        if choice.proposal not in proposals:
            proposals = [choice.proposal, *proposals]
        scored += selection.elsewhere(choice, scored, proposals)
        rivals = selection.rivals(choice, scored, {s.candidate.effect.name for s in accepted})
    factors = selection.bench.factors("fit")
    return Round(limit, tuple(proposals), tuple(scored), choice, objections, rivals, gains, factors, forms)
