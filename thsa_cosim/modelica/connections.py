"""Connections → equations: potentials are equal, flows sum to zero (Modelica Language Specification 3.6, 9.2)."""

from __future__ import annotations

from typing import Any

from thsa_cosim.errors import ModelicaError
from thsa_cosim.modelica.scope import DISABLED, Scope, Variable
from thsa_cosim.modelica.terms import Scalar, Term, make

Flow = tuple[str, bool]  # a flow variable and whether its connector is seen from inside


class Connections:
    """Sets of connected variables."""

    def __init__(self) -> None:
        self._parent: dict[Any, Any] = {}
        self._place: dict[Any, str] = {}

    def _root(self, key: Any) -> Any:
        self._parent.setdefault(key, key)
        while self._parent[key] != key:
            self._parent[key] = self._parent[self._parent[key]]
            key = self._parent[key]
        return key

    def connect(self, a: Any, b: Any, a_inside: bool, b_inside: bool, place: str) -> None:
        """Connect two connectors; ``inside`` says whether one belongs to the boundary of the class itself."""
        if a is DISABLED or b is DISABLED:
            return
        if isinstance(a, list) or isinstance(b, list):
            if not (isinstance(a, list) and isinstance(b, list) and len(a) == len(b)):
                raise ModelicaError(f"{place}: connect() of arrays of different sizes.")
            for x, y in zip(a, b, strict=True):
                self.connect(x, y, a_inside, b_inside, place)
            return
        if isinstance(a, Scope) and isinstance(b, Scope):
            self._connectors(a, b, a_inside, b_inside, place)
            return
        if not (isinstance(a, Variable) and isinstance(b, Variable)):
            raise ModelicaError(f"{place}: connect() of connectors that do not fit together.")
        if a.variability in ("parameter", "constant") and b.variability in ("parameter", "constant"):
            return
        flows = ("flow" in a.prefixes) + ("flow" in b.prefixes)
        if flows == 1:
            raise ModelicaError(
                f"{place}: connect() of the flow variable with the other: {a.name}, {b.name}."
            )
        if "stream" in a.prefixes:
            raise ModelicaError(f"{place}: stream connectors are a limit of this exporter ({a.name}).")
        keys = ((a.name, a_inside), (b.name, b_inside)) if flows else (a.name, b.name)
        for key in keys:
            self._place.setdefault(key, place)
        first, second = self._root(keys[0]), self._root(keys[1])
        if first != second:
            self._parent[second] = first

    def _connectors(self, a: Scope, b: Scope, a_inside: bool, b_inside: bool, place: str) -> None:
        for scope in (a, b):
            if "expandable" in scope.definition.prefixes:
                raise ModelicaError(
                    f"{place}: expandable connectors are a limit of this exporter ({scope.path})."
                )
        names = [n for n in a.elements if a.declares(n)]
        others = [n for n in b.elements if b.declares(n)]
        if set(names) != set(others):
            odd = sorted(set(names) ^ set(others))[0]
            raise ModelicaError(f"{place}: connect({a.path}, {b.path}): only one of them has {odd}.")
        for name in names:
            self.connect(a.component(name), b.component(name), a_inside, b_inside, place)

    def equations(self, variables: dict[str, Variable], given: set[str]) -> list[tuple[Scalar, Scalar, str]]:
        """Left side, right side and place of all equations of the connections.

        A flow that is not connected is zero, unless an equation outside of its component says what it is (``given``).
        """
        sets: dict[Any, list[Any]] = {}
        for key in self._parent:
            sets.setdefault(self._root(key), []).append(key)
        made: list[tuple[Scalar, Scalar, str]] = []
        connected: set[str] = set()
        for members in sets.values():
            place = self._place[members[0]]
            if isinstance(members[0], str):
                first, *rest = members
                made += [(Term("ref", (first,)), Term("ref", (name,)), place) for name in rest]
                continue
            sum_: Scalar = 0.0
            for name, inside in members:
                reference = Term("ref", (name,))
                sum_ = make("-" if inside else "+", sum_, reference)
                if not inside:
                    connected.add(name)
            made.append((sum_, 0.0, place))
        for variable in variables.values():
            if "flow" in variable.prefixes and variable.name not in connected | given:
                made.append((Term("ref", (variable.name,)), 0.0, variable.place))
        return made
