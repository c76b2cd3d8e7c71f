"""The C code of implicit equations: residuals, Jacobians, and the total derivatives through them.

The unknowns y of all blocks live at the end of the cache, so that the next solution starts from the last one. With
R(y, v) = 0 the derivative of a function f(y, v) is f_v + f_y S, S = -R_y^-1 R_v, whose numbers are found at run time.
"""

from dataclasses import dataclass, replace

import casadi as ca

from thsa_cosim.export.block import Block
from thsa_cosim.export.emit import statements
from thsa_cosim.export.graph import Graph
from thsa_cosim.export.model import CausalModel, column
from thsa_cosim.export.solve import HOMOTOPY

STEPS = 20  # of the way from the simplified to the actual initial system

_POINT = "double t, const double *x, const double *u, const double *p, const double *d, const double *m"


@dataclass(frozen=True)
class Rates:
    """Symbols of dy/dx, dy/du, dy/dt and of dy along a direction."""

    x: ca.SX
    u: ca.SX
    t: ca.SX
    along: ca.SX


class Implicit:
    """What the blocks of one model add to its C code."""

    def __init__(self, model: CausalModel, seeds: tuple[ca.SX, ca.SX, ca.SX], dependent_rate: ca.SX) -> None:
        self.model = model
        self.size = model.y.numel()
        n_x, n_u = model.x.numel(), model.u.numel()
        self.rates = Rates(
            _symbols("yx", self.size, n_x), _symbols("yu", self.size, n_u), _symbols("yt", self.size, 1),
            _symbols("ys", self.size, 1),
        )  # fmt: skip
        self.columns = n_x + n_u + 1
        self._seeds = seeds
        self._dependent_rate = dependent_rate
        self.symbols = {model.y.nz[i].name(): f"v[{i}]" for i in range(self.size)}
        for symbol, first in ((self.rates.x, 0), (self.rates.u, n_x), (self.rates.t, n_x + n_u)):
            for i in range(symbol.numel()):
                self.symbols[symbol.nz[i].name()] = f"S[{first * self.size + i}]"
        for i in range(self.size):
            self.symbols[self.rates.along.nz[i].name()] = f"S[{i}]"
        self.initial: list[Block] = []
        offset = 0
        for block in model.initial_blocks:
            for i in range(block.unknown.numel()):
                self.symbols[block.unknown.nz[i].name()] = f"y0[{offset + i}]"
            offset += block.unknown.numel()
        self.initial_size = offset
        self.homotopy = any(str(s) == HOMOTOPY for b in model.initial_blocks for s in ca.symvar(b.residual))
        if self.homotopy:  # how far the system is simplified lies behind its unknowns
            self.symbols[HOMOTOPY] = f"y0[{offset}]"

    @property
    def loops(self) -> int:
        """Number of loops that `unsolved` can name; the last is all loops of the running model at once."""
        return len(self.model.blocks) + len(self.model.initial_blocks) + bool(self.size)

    def total(self, function: ca.SX, over: ca.SX, rates: ca.SX) -> ca.SX:
        """Jacobian of a function with y following."""
        partial = ca.jacobian(function, over)
        if not self.size or not over.numel():
            return partial
        return partial + ca.mtimes(ca.jacobian(function, self.model.y), rates)

    def along(self, function: ca.SX, partial: ca.SX) -> ca.SX:
        """Directional derivative of a function with y following."""
        return partial + ca.jtimes(function, self.model.y, self.rates.along) if self.size else partial

    def begin(self, name: str) -> list[str]:
        """The first statements of a function: bring y, and its derivatives, up to date."""
        if name in ("dependent", "moving", "samples", "first_indicators"):
            return []
        if name in ("initial", "discrete_start"):
            lines = []
            if self.initial_size:
                lines = [
                    f"  double y0[{self.initial_size + self.homotopy}];",
                    "  if (solve_initial(t, u, p, d, m, x_start, y0)) return 1;",
                ]
            if self.size:
                lines.append("  double *v = implicit_of(d);")
                if name == "discrete_start" and ca.depends_on(self.model.events.z_start, self.model.y):
                    lines.append("  if (solve(t, x, u, p, d, m)) return 1;")
                lines.append("  (void)v;")
            return lines
        if not self.size:
            return []
        lines = ["  double *v = implicit_of(d);", "  (void)v;", "  if (solve(t, x, u, p, d, m)) return 1;"]
        if name == "jacobian":
            lines += [
                f"  double S[{self.size * self.columns}];",
                "  if (rates(t, x, u, p, d, m, S)) return 1;",
            ]
        elif name == "directional":
            lines += [
                f"  double S[{self.size}];",
                "  if (rates_along(t, x, u, p, d, m, sx, su, sp, S)) return 1;",
            ]
        return lines

    def source(
        self, graph: Graph, symbols: dict[str, str], cached: dict[int, str], own: int, refresh: bool
    ) -> list[str]:
        """Functions that the others call."""
        if not self.loops:
            return []
        lines = [
            '#include "newton.h"',
            "",
            "/* Notes the loop that has no solution, for messages; 0 = all have one. */",
            "static int unsolved(const double *d, int loop) {",
            "  ((double *)d)[N_D + N_CACHE - 1] = loop;",
            "  return loop;",
            "}",
            "",
        ]
        if self.size:
            lines += [
                f"static double *implicit_of(const double *d) {{ return (double *)d + N_D + {own}; }}",
                "",
            ]
        lines += self._solve(graph, symbols)
        lines += self._solve_initial(graph, symbols)
        if self.size:
            lines += self._rates(graph, symbols)
        return lines

    def _residual(
        self, graph: Graph, symbols: dict[str, str], name: str, block: Block, y: str, extra: str
    ) -> list[str]:
        """``static int name(const Point *at, double *f, double *jacobian)``; of a linear block f is -residual(0)."""
        residual = block.residual
        if block.linear:
            zeros = ca.SX.zeros(block.unknown.numel())
            residual = -ca.substitute([residual], [block.unknown], [zeros])[0]
        f = [(f"f[{i}]", node) for i, node in enumerate(graph.add_column(residual))]
        matrix = ca.jacobian(block.residual, block.unknown)
        jac = [(f"jacobian[{i}]", node) for i, node in enumerate(graph.add_column(matrix))]
        lines = [
            f"static int {name}(const Point *at, double *f, double *jacobian) {{",
            "  const double t = at->t, *x = at->x, *u = at->u, *p = at->p, *d = at->d, *m = at->m;",
            f"  const double *{y} = at->y;",
            f"  (void)t; (void)x; (void)u; (void)p; (void)d; (void)m; (void){y};",
        ]
        if extra:
            lines += [f"  const double *{extra} = at->x;", f"  (void){extra};"]
        lines += ["  {", *statements(graph, f, symbols, {}), "  }", "  if (jacobian) {"]
        lines += statements(graph, jac, symbols, {})
        return [*lines, "  }", "  return 0;", "}", ""]

    @staticmethod
    def _declared(blocks: tuple[Block, ...]) -> list[str]:
        largest = max(b.unknown.numel() for b in blocks)
        return [f"  double work[{largest * (largest + 4)}];", f"  int pivot[{largest}];"]

    @staticmethod
    def _calls(blocks: tuple[Block, ...], prefix: str, y: str, first: int) -> list[str]:
        """Calls of the loops, which ``unsolved`` numbers from ``first`` on."""
        lines, offset = [], 0
        for k, block in enumerate(blocks):
            n, part = block.unknown.numel(), f"{y} + {offset}"
            if block.linear:
                direct = f"{prefix}{k}(&at, {part}, work) || newton_linear({n}, 1, work, {part}, pivot)"
                lines.append(f"  if ({direct}) return unsolved(d, {first + k});")
            else:
                call = f"newton_solve({n}, {part}, {prefix}{k}, &at, work, pivot)"
                lines.append(f"  if ({call}) return unsolved(d, {first + k});")
            offset += n
        return lines

    def _solve(self, graph: Graph, symbols: dict[str, str]) -> list[str]:
        if not self.size:
            return []
        lines = []
        for k, block in enumerate(self.model.blocks):
            lines += self._residual(graph, symbols, f"block_{k}", block, "v", "")
        lines += [
            f"static int solve({_POINT}) {{",
            "  double *v = implicit_of(d);",
            "  const Point at = {t, x, u, p, d, m, v};",
            *self._declared(self.model.blocks),
            *self._calls(self.model.blocks, "block_", "v", 1),
            "  return unsolved(d, 0);",
            "}",
            "",
        ]
        return lines

    def _solve_initial(self, graph: Graph, symbols: dict[str, str]) -> list[str]:
        if not self.initial_size:
            return []
        lines = []
        for k, block in enumerate(self.model.initial_blocks):
            lines += self._residual(graph, symbols, f"initial_block_{k}", block, "y0", "x_start")
        guesses = column(
            b.guess.nz[i]
            for b in (_dense(b) for b in self.model.initial_blocks)
            for i in range(b.unknown.numel())
        )
        first = [(f"y0[{i}]", node) for i, node in enumerate(graph.add_column(guesses))]
        lines += [
            "static int solve_initial(double t, const double *u, const double *p, const double *d, const double *m,",
            "                         const double *x_start, double *y0) {",
            "  const Point at = {t, x_start, u, p, d, m, y0};",
            "  (void)u; (void)p; (void)d; (void)m;",
            *statements(graph, first, symbols, {}),
            *self._declared(self.model.initial_blocks),
            *(
                [f"  for (int k = {STEPS}; k >= 0; k--) {{", f"  y0[{self.initial_size}] = k / {STEPS}.0;"]
                if self.homotopy
                else []
            ),
            *self._calls(self.model.initial_blocks, "initial_block_", "y0", 1 + len(self.model.blocks)),
            *(["  }"] if self.homotopy else []),
            "  return unsolved(d, 0);",
            "}",
            "",
        ]
        return lines

    def end(self, graph: Graph, name: str, symbols: dict[str, str]) -> list[str]:
        """The last statements of a function: relations at the end of the way from the simplified initial system."""
        if name != "first_indicators" or not self.homotopy:
            return []
        found = [(f"g[{i}]", node) for i, node in enumerate(graph.add_column(self.model.g_simplified))]
        return [
            f"  double settled[N_M + 1], y0[{self.initial_size + 1}];",
            "  for (int k = 0; k < N_M; k++) settled[k] = k < N_G ? (double)(g[k] > 0.0) : m[k];",
            "  if (solve_initial(t, u, p, d, settled, x_start, y0)) return 0;",
            "  {",
            "  const double *m = settled;",
            "  (void)m;",
            *statements(graph, found, symbols, {}),
            "  }",
        ]

    def _path(self) -> list[str]:
        """The head of the loop from the simplified to the actual initial system."""
        if not self.homotopy:
            return []
        return [f"  for (int k = {STEPS}; k >= 0; k--) {{", f"  y0[{self.initial_size}] = k / {STEPS}.0;"]

    def _rates(self, graph: Graph, symbols: dict[str, str]) -> list[str]:
        model, n = self.model, self.size
        residual = ca.vertcat(*[b.residual for b in model.blocks])
        matrix = ca.jacobian(residual, model.y)
        over = ca.vertcat(model.x, model.u, model.time)
        wide = -ca.jacobian(residual, over)
        known = ca.vertcat(model.x, model.u, model.p, model.d)
        directed = -ca.jtimes(residual, known, ca.vertcat(*self._seeds, self._dependent_rate))
        made = []
        seeds = ", const double *sx, const double *su, const double *sp"
        for name, right, columns, arguments in (
            ("rates", wide, self.columns, ""),
            ("rates_along", directed, 1, seeds),
        ):
            outputs = [(f"R[{i}]", node) for i, node in enumerate(graph.add_column(matrix))]
            outputs += [(f"S[{i}]", node) for i, node in enumerate(graph.add_column(right))]
            made += [
                f"static int {name}({_POINT}{arguments}, double *S) {{",
                f"  double *v = implicit_of(d), R[{n * n}];",
                f"  int pivot[{n}];",
                "  (void)t; (void)x; (void)u; (void)p; (void)d; (void)m; (void)v;",
                *(["  (void)sx; (void)su; (void)sp;"] if arguments else []),
                *statements(graph, outputs, symbols, {}),
                f"  return unsolved(d, newton_linear({n}, {columns}, R, S, pivot) ? {self.loops} : 0);",
                "}",
                "",
            ]
        return made


def _symbols(name: str, rows: int, columns: int) -> ca.SX:
    """A matrix of symbols whose names no variable of a model can have."""
    made = [ca.SX.sym(f"{name}({k})") for k in range(rows * columns)]
    return ca.reshape(column(made), rows, columns)


def _dense(block: Block) -> Block:
    return replace(block, guess=ca.densify(block.guess))
