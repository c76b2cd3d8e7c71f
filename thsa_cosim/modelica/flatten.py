"""A class of a library → a ``FlatModel``."""

from __future__ import annotations

import sys
from dataclasses import replace
from typing import Any

from thsa_cosim.errors import ModelicaError, did_you_mean
from thsa_cosim.modelica.arrays import Record
from thsa_cosim.modelica.derivatives import with_rates
from thsa_cosim.modelica.equations import Collector
from thsa_cosim.modelica.evaluate import bound
from thsa_cosim.modelica.flat import Experiment, FlatEquation, FlatModel, FlatVariable
from thsa_cosim.modelica.library import Library
from thsa_cosim.modelica.modifier import Binding
from thsa_cosim.modelica.scope import Scope, Variable, World
from thsa_cosim.modelica.syntax import ClassDefinition, Extends
from thsa_cosim.modelica.terms import Enumeration, Scalar, Term, constant, plain
from thsa_cosim.modelica.types import check_types

_DEPTH = 20_000


def flatten_class(library: Library, name: str, folded: bool = False) -> FlatModel:
    """Flatten a class by its qualified name; ``folded`` fixes all its Boolean and Integer parameters.

    Raises ModelicaError, with file and line, for what is missing, wrong or outside the exportable subset.
    """
    limit = sys.getrecursionlimit()
    sys.setrecursionlimit(max(limit, _DEPTH))
    try:
        return _flatten(library, name, folded)
    finally:
        sys.setrecursionlimit(limit)


def class_scope(library: Library, name: str) -> Scope:
    """A class by its qualified name; raises ModelicaError if there is none."""
    world = World(library)
    first, *rest = name.split(".")
    found = world.top(first)
    for part in rest:
        found = found.member_class(part) if found else None
    if found is None:
        raise ModelicaError(f"The class {name} is not found.{did_you_mean(name, library.names())}")
    return found


def _flatten(library: Library, name: str, folded: bool) -> FlatModel:
    declared = class_scope(library, name)
    declared.world.folded = folded
    definition = declared.definition
    if definition.kind not in ("model", "block", "class") or "operator" in definition.prefixes:
        raise ModelicaError(
            f"{declared.place(definition.line)}: {name} is a {definition.kind}; a model or block is needed to export."
        )
    if "partial" in definition.prefixes:
        raise ModelicaError(
            f"{declared.place(definition.line)}: {name} is partial; export a class that completes it."
        )
    root = Scope(declared.world, definition, declared.parent, declared.given, path="")
    collector = Collector()
    collector.collect(root)
    world = root.world
    equations = list(collector.equations)
    equations += [
        FlatEquation(a, b, place)
        for a, b, place in collector.connections.equations(world.variables, collector.given_flows)
    ]
    if not world.variables:
        raise ModelicaError(f"{declared.place(definition.line)}: {name} has no variables.")
    variables = {v.name: _variable(v, collector, world) for v in world.variables.values() if v.type in _TYPES}
    open_ = world.tunable - world.structural
    variables = {
        k: replace(v, structural=k in world.structural, tunable=k in open_) for k, v in variables.items()
    }
    equations, initial, variables = with_rates(equations, collector.initial, variables)
    flat = FlatModel(
        name=name,
        description=definition.description,
        variables=variables,
        equations=tuple(equations),
        initial_equations=tuple(initial),
        reinits=tuple(collector.reinits),
        assertions=tuple(collector.assertions),
        experiment=_experiment(declared),
        source_digest=library.digest(),
    )
    check_types(flat)
    return flat


_TYPES = frozenset(("Real", "Integer", "Boolean", "enumeration"))


def _variable(variable: Variable, collector: Collector, world: World) -> FlatVariable:
    variability = variable.variability
    if variable.name in collector.discrete and variability == "continuous":
        variability = "discrete"
    causality = "local"
    if "." not in variable.name and "protected" not in variable.prefixes:
        causality = next((c for c in ("input", "output") if c in variable.prefixes), "local")
    fixed = _attribute(variable, "fixed")
    if fixed is not None and not isinstance(fixed, bool):
        fixed = _known(variable, "fixed", fixed, world)
    binding = _checked(variable, variable.binding) if variable.binding else None
    type_name = "Integer" if variable.type == "enumeration" else variable.type
    start = _attribute(variable, "start")
    select = _attribute(variable, "stateSelect")
    unit, quantity = _attribute(variable, "unit"), _attribute(variable, "quantity")
    return FlatVariable(
        name=variable.name,
        type=type_name,
        variability=variability,
        causality=causality,
        unit=unit if isinstance(unit, str) and unit else None,
        quantity=quantity if isinstance(quantity, str) and quantity else None,
        description=variable.description,
        start=start,
        binding=binding,
        minimum=_attribute(variable, "min"),
        maximum=_attribute(variable, "max"),
        nominal=_attribute(variable, "nominal"),
        fixed=fixed,
        final=variable.final,
        state_select=select.name if isinstance(select, Enumeration) else "default",
        structural=False,
        place=variable.place,
    )


def _checked(variable: Variable, binding: Binding) -> Scalar:
    value = bound(binding)
    if isinstance(value, tuple) and value:
        value = value[0]
    if isinstance(value, (list, Record, tuple)):
        raise ModelicaError(f"{variable.place}: {variable.name} is a scalar, but gets an array or a record.")
    if isinstance(value, str) and variable.type != "String":
        raise ModelicaError(f"{variable.place}: {variable.name} is a {variable.type}, but gets a String.")
    return plain(value)


def _attribute(variable: Variable, name: str) -> Any:
    binding = variable.attributes.get(name)
    if binding is None:
        return None
    value = bound(binding)
    if isinstance(value, (list, Record)):
        raise ModelicaError(f"{variable.place}: {name} of {variable.name} is a scalar, but gets an array.")
    return value if name == "stateSelect" else plain(value)


def _known(variable: Variable, what: str, value: Scalar, world: World) -> Any:
    from thsa_cosim.modelica.evaluate import Evaluator

    binding = variable.attributes[what]
    return bool(Evaluator(binding.scope).fixed(value, binding.value, f"{what} of {variable.name}"))


def _experiment(scope: Scope) -> Experiment:
    values: dict[str, float] = {}
    seen: ClassDefinition = scope.definition
    values = dict(seen.experiment)
    default = Experiment()
    start = values.get("StartTime", default.start)
    stop = values.get("StopTime", default.stop)
    return Experiment(
        start=start,
        stop=stop if stop > start else start + 1.0,
        tolerance=values.get("Tolerance", default.tolerance),
        interval=values.get("Interval", default.interval),
    )


__all__ = ["Extends", "Term", "class_scope", "constant", "flatten_class"]
