"""CasADi SX expressions as one interned graph: common subexpressions, dependencies, guards."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import casadi as ca

_COMMUTATIVE = {ca.OP_ADD, ca.OP_MUL, ca.OP_AND, ca.OP_OR, ca.OP_EQ, ca.OP_NE, ca.OP_FMIN, ca.OP_FMAX}
_CHEAP = {ca.OP_ADD, ca.OP_SUB, ca.OP_MUL, ca.OP_NEG, ca.OP_SQ, ca.OP_TWICE, ca.OP_LT, ca.OP_LE, ca.OP_NOT,
          ca.OP_AND, ca.OP_OR, ca.OP_IF_ELSE_ZERO, ca.OP_FABS}  # fmt: skip
_QUOTIENTS = {ca.OP_DIV, ca.OP_INV, ca.OP_SQRT}

ROOT = -1


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

    def guards(self, outputs: Sequence[int], given: Sequence[int], threshold: int = 12) -> dict[int, int]:
        """For every needed node the conditional under whose value it is evaluated, ROOT for always.

        A node that only the value of ``condition ? value : 0`` needs is guarded by that conditional, so that a branch
        not taken costs nothing; conditionals whose value is cheaper than ``threshold`` guard nothing.
        """
        order = self.needed(outputs, given)
        loose: set[int] = set()
        while True:
            guard = self._assign(order, set(outputs), set(given), loose)
            worth: dict[int, int] = {}
            for node in order:
                place = guard[node]
                while place != ROOT:
                    worth[place] = worth.get(place, 0) + self.nodes[node].cost
                    place = guard[place]
            cheap = {place for place, cost in worth.items() if cost < threshold}
            if not cheap:
                return guard
            loose |= cheap

    def _assign(self, order: list[int], roots: set[int], given: set[int], loose: set[int]) -> dict[int, int]:
        users: dict[int, list[tuple[int, bool]]] = {node: [] for node in order}
        for node in order:
            if node not in given:
                conditional = self.nodes[node].op == ca.OP_IF_ELSE_ZERO and node not in loose
                for position, argument in enumerate(self.nodes[node].arguments):
                    users[argument].append((node, conditional and position == 1))
        guard: dict[int, int] = {}
        depth = {ROOT: 0}
        for node in reversed(order):
            places = [ROOT] if node in roots or node in given else []
            places += [user if value else guard[user] for user, value in users[node]]
            place = places[0]
            for other in places[1:]:
                while place != other:
                    if depth[place] >= depth[other]:
                        place = guard[place]
                    else:
                        other = guard[other]
            guard[node] = place
            depth[node] = depth[place] + 1
        return guard
