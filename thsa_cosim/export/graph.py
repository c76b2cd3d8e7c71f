"""CasADi SX expressions as one interned graph: common subexpressions, dependencies, guards."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import casadi as ca

_COMMUTATIVE = {ca.OP_ADD, ca.OP_MUL, ca.OP_AND, ca.OP_OR, ca.OP_EQ, ca.OP_NE, ca.OP_FMIN, ca.OP_FMAX}
_CHEAP = {ca.OP_ADD, ca.OP_SUB, ca.OP_MUL, ca.OP_NEG, ca.OP_SQ, ca.OP_TWICE, ca.OP_LT, ca.OP_LE, ca.OP_NOT,
          ca.OP_AND, ca.OP_OR, ca.OP_IF_ELSE_ZERO, ca.OP_FABS}  # fmt: skip
_QUOTIENTS = {ca.OP_DIV, ca.OP_INV, ca.OP_SQRT}

Place = tuple[int, ...]


@dataclass(frozen=True)
class Node:
    """An operation on earlier nodes, a named symbol (``op`` is None) or a constant."""

    op: int | None
    arguments: tuple[int, ...] = ()
    symbol: str | None = None
    constant: float | None = None

    @property
    def cost(self) -> int:
        """Rough cost in additions."""
        if self.op is None:
            return 0
        return 1 if self.op in _CHEAP else 5 if self.op in _QUOTIENTS else 25

    @property
    def transcendental(self) -> bool:
        """Whether the operation calls the mathematical library."""
        return self.cost > 5


@dataclass
class Graph:
    """Nodes in topological order; equal operations on equal arguments are one node.

    A division by what depends on ``steady`` symbols alone becomes a product with a reciprocal, which can be kept.
    """

    steady: frozenset[str] = frozenset()
    nodes: list[Node] = field(default_factory=list)
    below: list[frozenset[str]] = field(default_factory=list)  # symbols that each node depends on
    _known: dict[Node, int] = field(default_factory=dict)
    _by_element: dict[int, int] = field(default_factory=dict)
    _kept: list[ca.SX] = field(default_factory=list)

    def add_column(self, expression: ca.SX) -> list[int]:
        """Nodes of the entries of a matrix in column-major order, structural zeros included."""
        dense = ca.densify(expression)
        return [self.add(dense.nz[i]) for i in range(dense.numel())]

    def add(self, expression: ca.SX) -> int:
        """Node of a scalar expression."""
        stack = [expression]
        while stack:
            top = stack[-1]
            if top.element_hash() in self._by_element:
                stack.pop()
                continue
            waiting = [
                top.dep(i) for i in range(top.n_dep()) if top.dep(i).element_hash() not in self._by_element
            ]
            if waiting:
                stack.extend(waiting)
                continue
            stack.pop()
            self._kept.append(top)  # element hashes are addresses: keep what they point to alive
            self._by_element[top.element_hash()] = self._intern(top)
        return self._by_element[expression.element_hash()]

    def expressions(self) -> dict[int, ca.SX]:
        """An expression for every node that was made from one."""
        return {self._by_element[e.element_hash()]: e for e in reversed(self._kept)}

    def _intern(self, expression: ca.SX) -> int:
        if expression.is_constant():
            node = Node(None, constant=float(expression))
        elif expression.is_symbolic():
            node = Node(None, symbol=expression.name())
        else:
            arguments = tuple(
                self._by_element[expression.dep(i).element_hash()] for i in range(expression.n_dep())
            )
            return self._operation(expression.op(), arguments)
        return self._insert(node)

    def _operation(self, operation: int, arguments: tuple[int, ...]) -> int:
        if operation == ca.OP_DIV:
            numerator, denominator = arguments
            if self.below[denominator] <= self.steady and not self.below[numerator] <= self.steady:
                return self._operation(ca.OP_MUL, (numerator, self._insert(Node(ca.OP_INV, (denominator,)))))
        return self._insert(
            Node(operation, tuple(sorted(arguments)) if operation in _COMMUTATIVE else arguments)
        )

    def _insert(self, node: Node) -> int:
        if node not in self._known:
            self._known[node] = len(self.nodes)
            self.nodes.append(node)
            own = frozenset() if node.symbol is None else frozenset({node.symbol})
            self.below.append(own.union(*(self.below[a] for a in node.arguments)))
        return self._known[node]

    def needed(self, outputs: Iterable[int], given: Iterable[int] = ()) -> list[int]:
        """Nodes that outputs need, in order, not going below the ``given`` ones."""
        stop = set(given)
        found: set[int] = set()
        stack = list(outputs)
        while stack:
            node = stack.pop()
            if node not in found:
                found.add(node)
                if node not in stop:
                    stack.extend(self.nodes[node].arguments)
        return sorted(found)

    def users(self, order: Sequence[int], given: Iterable[int] = ()) -> dict[int, list[int]]:
        """For every node of ``order`` the nodes of ``order`` that use it; the ``given`` ones use nothing."""
        stop = set(given)
        found: dict[int, list[int]] = {node: [] for node in order}
        for node in order:
            if node not in stop:
                for argument in self.nodes[node].arguments:
                    found[argument].append(node)
        return found

    def guards(self, outputs: Sequence[int], given: Sequence[int], threshold: int = 12) -> dict[int, Place]:
        """For every needed node the conditions under which alone it is evaluated, outermost first; () for always.

        A node that only values of ``condition ? value : 0`` need is guarded by that condition, so that a branch not
        taken costs nothing; conditions that would guard less than ``threshold`` additions guard nothing.
        """
        order = self.needed(outputs, given)
        loose: set[Place] = set()
        while True:
            guard = self._assign(order, set(outputs), set(given), loose)
            worth: dict[Place, int] = {}
            for node, place in guard.items():
                for depth in range(len(place)):
                    worth[place[: depth + 1]] = worth.get(place[: depth + 1], 0) + self.nodes[node].cost
            cheap = {place for place, cost in worth.items() if cost < threshold}
            if not cheap:
                return guard
            loose |= cheap

    def _assign(
        self, order: list[int], roots: set[int], given: set[int], loose: set[Place]
    ) -> dict[int, Place]:
        users = self.users(order, given)
        guard: dict[int, Place] = {}
        for node in reversed(order):
            places = (
                [()]
                if node in roots or node in given
                else [self.place(u, node, guard, loose) for u in users[node]]
            )
            shared = places[0]
            for place in places[1:]:
                depth = 0
                while depth < min(len(shared), len(place)) and shared[depth] == place[depth]:
                    depth += 1
                shared = shared[:depth]
            guard[node] = shared
        return guard

    def place(self, user: int, node: int, guard: dict[int, Place], loose: set[Place]) -> Place:
        """Where ``user`` needs ``node``: under its condition if the node is its value, else where it is itself."""
        entry = self.nodes[user]
        if entry.op == ca.OP_IF_ELSE_ZERO and entry.arguments[1] == node and entry.arguments[0] != node:
            inner = (*guard[user], entry.arguments[0])
            if inner not in loose:
                return inner
        return guard[user]
