"""From points to laws, and from laws back to values at any temperature."""

from collections.abc import Mapping, Sequence

import numpy as np

from thsa_cosim.errors import InputError
from thsa_cosim.identify.results import LawResult, PointResult
from thsa_cosim.laws import (
    FORMS,
    SearchedLaw,
    candidates_for,
    doubts_about,
    fit_law,
    largest_deviation,
    published_law,
    quantity_of,
    select_law,
)
from thsa_cosim.parameters import ParameterSpace
from thsa_cosim.scenario import LawTable


def all_laws(
    points: Sequence[PointResult], specs: Mapping[str, LawTable], space: ParameterSpace
) -> tuple[dict[str, LawResult], list[str]]:
    """The laws that were searched as such, and those that go through the points; as :func:`fit_laws`."""
    searched = [c for c in space.combinations if isinstance(c, SearchedLaw)]
    laws = {
        law.parameter.name: _searched(law, point, specs[law.parameter.name])
        for point in points[:1]
        for law in searched
    }
    others = {name: spec for name, spec in specs.items() if name not in {s.parameter.name for s in searched}}
    fitted, notes = fit_laws(points, others)
    return {**laws, **fitted}, notes


def _searched(law: SearchedLaw, point: PointResult, spec: LawTable) -> LawResult:
    """A law of the unknowns at ``point``, with their covariance."""
    name, unit = law.parameter.name, law.parameter.unit
    estimates = [point.parameters[member] for member in law.members]
    order = [list(point.parameters).index(member) for member in law.members]
    sizes = np.array([np.nan if e.stderr is None else e.stderr for e in estimates])
    covariance = point.correlation[np.ix_(order, order)] * np.outer(sizes, sizes)
    known = bool(np.isfinite(covariance).all())
    found = law.law([e.value for e in estimates], covariance if known else None)
    temperatures = np.linspace(law.cold, law.warm, 33)
    published = law_deviation = None
    if spec.published is not None and spec.compared_form is not None:
        published = published_law(spec.compared_form, spec.published)
        law_deviation = largest_deviation(found, published, temperatures)
    quantity = quantity_of(unit, spec.quantity)
    about = (quantity, name, unit, law.cold, law.warm)
    return LawResult(
        parameter=name,
        unit=unit,
        law=found,
        candidates=(found,),
        selected=False,
        published=published,
        deviation=None,
        law_deviation=law_deviation,
        determined=known,
        between=(law.cold, law.warm),
        doubts=doubts_about(found, *about) if known else (),
        published_doubts=doubts_about(published, *about) if published is not None else (),
    )


def fit_laws(
    points: Sequence[PointResult], specs: Mapping[str, LawTable]
) -> tuple[dict[str, LawResult], list[str]]:
    """Fit the wanted laws to the points; also return one sentence per law that could not be fitted."""
    laws: dict[str, LawResult] = {}
    notes: list[str] = []
    for name, spec in specs.items():
        members = [p for p in points if p.temperature_degC is not None and name in p.parameters]
        if len(members) < 2:
            notes.append(f"{name} has no law: it was identified at fewer than two temperatures.")
            continue
        t = np.array([p.temperature_degC for p in members], dtype=np.float64)
        estimates = [p.parameters[name] for p in members]
        values = np.array([e.value for e in estimates])
        stderr = np.array([np.nan if e.stderr is None else e.stderr for e in estimates])
        unit = estimates[0].unit
        quantity = quantity_of(unit, spec.quantity)
        best, candidates = select_law(t, values, stderr, candidates_for(quantity))
        if spec.form is not None:
            needed = FORMS[spec.form] or 2
            if len(members) < needed:
                notes.append(
                    f"{name} has no {spec.form} law: that needs {needed} temperatures, there are {len(members)}."
                )
                continue
            best = fit_law(spec.form, t, values, stderr)
        published = None
        deviation = law_deviation = None
        if spec.published is not None and spec.compared_form is not None:
            published = published_law(spec.compared_form, spec.published)
            true = published(t)
            deviation = float(np.max(np.abs(values - true)) / np.max(np.abs(true)))
            law_deviation = largest_deviation(best, published, t)
        determined = any(e.identifiable for e in estimates)
        about = (quantity, name, unit, float(t.min()), float(t.max()))
        laws[name] = LawResult(
            parameter=name,
            unit=unit,
            law=best,
            candidates=candidates,
            selected=spec.form is None,
            published=published,
            deviation=deviation,
            law_deviation=law_deviation,
            determined=determined,
            doubts=doubts_about(best, *about) if determined else (),
            published_doubts=doubts_about(published, *about) if published is not None else (),
        )
    return laws, notes


def values_at(
    temperature: float | None,
    names: Sequence[str],
    points: Sequence[PointResult],
    laws: Mapping[str, LawResult],
    round_to: float,
) -> dict[str, float]:
    """Values of ``names`` for a recording at ``temperature`` (degC): its own point's, else the laws'.

    Raises InputError, in one sentence, when neither is there.
    """
    for point in points:
        own = point.temperature_degC
        near = own is None or (temperature is not None and abs(own - temperature) <= 0.5 * round_to)
        if near and all(name in point.parameters for name in names):
            return {name: point.parameters[name].value for name in names}
    missing = [name for name in names if name not in laws]
    if temperature is None or missing:
        what = "it has no temperature" if temperature is None else f"{missing[0]} has neither point nor law"
        raise InputError(f"no parameters for it: {what} there")
    return {name: float(laws[name].law(temperature)) for name in names}
