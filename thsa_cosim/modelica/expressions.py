"""Expressions of Modelica: the lower half of the recursive descent."""

from pathlib import Path

from thsa_cosim.errors import ModelicaError
from thsa_cosim.modelica.lexer import Tokens, unquote
from thsa_cosim.modelica.syntax import Syntax

_RELATIONS = frozenset(("<", "<=", ">", ">=", "==", "<>"))
_ADDITIVE = frozenset(("+", "-", ".+", ".-"))
_MULTIPLICATIVE = frozenset(("*", "/", ".*", "./"))


class ExpressionParser:
    """A position in the tokens of one file, and the productions of expressions."""

    def __init__(self, tokens: Tokens, file: Path) -> None:
        self.tokens = tokens
        self.file = file
        self.index = 0

    @property
    def kind(self) -> str:
        return self.tokens.kinds[self.index]

    @property
    def line(self) -> int:
        return self.tokens.line(self.index)

    def peek(self) -> str:
        """Kind of the token after this one."""
        return self.tokens.kinds[min(self.index + 1, len(self.tokens.kinds) - 1)]

    def advance(self) -> str:
        """Text of this token; moves on."""
        text = self.tokens.texts[self.index]
        self.index += 1
        return text

    def accept(self, kind: str) -> bool:
        if self.tokens.kinds[self.index] != kind:
            return False
        self.index += 1
        return True

    def expect(self, kind: str) -> None:
        if not self.accept(kind):
            raise self.error(f"{kind!r}")

    def error(self, wanted: str) -> ModelicaError:
        found = self.tokens.texts[self.index][:40]
        return ModelicaError(f"{self.file}:{self.line}: syntax: {wanted} is expected, not {found!r}.")

    def identifier(self) -> str:
        if self.kind != "name":
            raise self.error("a name")
        return self.advance()

    def name(self) -> str:
        """A dotted name."""
        parts = [""] if self.accept(".") else []
        parts.append(self.identifier())
        while self.kind == "." and self.peek() == "name":
            self.advance()
            parts.append(self.advance())
        return ".".join(parts)

    def string_comment(self) -> str:
        if self.kind != "string":
            return ""
        text = unquote(self.advance())
        while self.accept("+"):
            if self.kind != "string":
                raise self.error("a string")
            text += unquote(self.advance())
        return text

    def expression(self) -> Syntax:
        line = self.line
        if not self.accept("if"):
            return self.simple_expression()
        branches = []
        while True:
            condition = self.expression()
            self.expect("then")
            branches.append((condition, self.expression()))
            if not self.accept("elseif"):
                break
        self.expect("else")
        return Syntax("if", (tuple(branches), self.expression()), line)

    def simple_expression(self) -> Syntax:
        line = self.line
        first = self.logical()
        if self.kind != ":" or self.peek() in (")", "]", ","):
            return first
        self.advance()
        second = self.logical()
        if self.accept(":"):
            return Syntax("range", (first, second, self.logical()), line)
        return Syntax("range", (first, None, second), line)

    def logical(self) -> Syntax:
        line = self.line
        left = self.logical_term()
        while self.accept("or"):
            left = Syntax("binary", ("or", left, self.logical_term()), line)
        return left

    def logical_term(self) -> Syntax:
        line = self.line
        left = self.logical_factor()
        while self.accept("and"):
            left = Syntax("binary", ("and", left, self.logical_factor()), line)
        return left

    def logical_factor(self) -> Syntax:
        line = self.line
        if self.accept("not"):
            return Syntax("unary", ("not", self.relation()), line)
        return self.relation()

    def relation(self) -> Syntax:
        line = self.line
        left = self.arithmetic()
        if self.kind in _RELATIONS:
            return Syntax("binary", (self.advance(), left, self.arithmetic()), line)
        return left

    def arithmetic(self) -> Syntax:
        line = self.line
        if self.kind in _ADDITIVE:
            sign = self.advance()[-1]
            left = self.term()
            if sign == "-":
                left = Syntax("unary", ("-", left), line)
        else:
            left = self.term()
        while self.kind in _ADDITIVE:
            left = Syntax("binary", (self.advance(), left, self.term()), line)
        return left

    def term(self) -> Syntax:
        line = self.line
        left = self.factor()
        while self.kind in _MULTIPLICATIVE:
            left = Syntax("binary", (self.advance(), left, self.factor()), line)
        return left

    def factor(self) -> Syntax:
        line = self.line
        left = self.primary()
        if self.kind in ("^", ".^"):
            return Syntax("binary", (self.advance(), left, self.primary()), line)
        return left

    def primary(self) -> Syntax:
        line, kind = self.line, self.kind
        if kind == "number":
            text = self.advance()
            return Syntax("number", (int(text) if text.isdigit() else float(text),), line)
        if kind == "string":
            return Syntax("string", (unquote(self.advance()),), line)
        if kind in ("true", "false"):
            return Syntax("boolean", (self.advance() == "true",), line)
        if kind in ("name", "."):
            return self.component_reference()
        if kind in ("der", "initial", "pure") and self.peek() == "(":
            name = self.advance()
            return self._call(name, line)
        if kind == "end":
            self.advance()
            return Syntax("end", (), line)
        if kind == "(":
            self.advance()
            items = self._tuple_items()
            if len(items) == 1:
                return items[0]
            return Syntax("tuple", tuple(items), line)
        if kind == "{":
            return self._array(line)
        if kind == "[":
            self.advance()
            rows = []
            while True:
                row = [self.expression()]
                while self.accept(","):
                    row.append(self.expression())
                rows.append(tuple(row))
                if not self.accept(";"):
                    break
            self.expect("]")
            return Syntax("matrix", tuple(rows), line)
        raise self.error("an expression")

    def _tuple_items(self) -> list[Syntax]:
        items: list[Syntax] = []
        while self.kind != ")":
            if self.kind == ",":
                items.append(Syntax("colon", (), self.line))
            else:
                items.append(self.expression())
            if not self.accept(","):
                break
            if self.kind == ")":
                items.append(Syntax("colon", (), self.line))
        self.expect(")")
        return items

    def _array(self, line: int) -> Syntax:
        self.expect("{")
        items: list[Syntax] = []
        if self.kind != "}":
            items.append(self.expression())
            if self.accept("for"):
                iterators = self.iterators()
                self.expect("}")
                return Syntax("comprehension", (items[0], iterators), line)
            while self.accept(","):
                items.append(self.expression())
        self.expect("}")
        return Syntax("array", tuple(items), line)

    def iterators(self) -> tuple[tuple[str, Syntax | None], ...]:
        found = []
        while True:
            name = self.identifier()
            found.append((name, self.expression() if self.accept("in") else None))
            if not self.accept(","):
                return tuple(found)

    def component_reference(self) -> Syntax:
        line = self.line
        parts: list[tuple[str, tuple[Syntax, ...]]] = [("", ())] if self.accept(".") else []
        while True:
            identifier = self.identifier()
            parts.append((identifier, self.array_subscripts() if self.kind == "[" else ()))
            if not (self.kind == "." and self.peek() == "name"):
                break
            self.advance()
        if self.kind == "(":
            return self._call(".".join(identifier for identifier, _ in parts), line)
        return Syntax("name", tuple(parts), line)

    def _call(self, name: str, line: int) -> Syntax:
        self.expect("(")
        positional: list[Syntax] = []
        named: dict[str, Syntax] = {}
        while self.kind != ")":
            if self.kind == "name" and self.peek() == "=":
                key = self.advance()
                self.advance()
                named[key] = self._function_argument()
            else:
                item = self._function_argument()
                if self.accept("for"):
                    iterators = self.iterators()
                    item = Syntax("comprehension", (item, iterators), line)
                positional.append(item)
            if not self.accept(","):
                break
        self.expect(")")
        return Syntax("call", (name, tuple(positional), named), line)

    def _function_argument(self) -> Syntax:
        if self.kind != "function":
            return self.expression()
        line = self.line
        self.advance()
        name = self.name()
        call = self._call(name, line)
        return Syntax("function", call.args, line)

    def array_subscripts(self) -> tuple[Syntax, ...]:
        self.expect("[")
        found = []
        while True:
            if self.kind == ":" and self.peek() in (",", "]"):
                self.advance()
                found.append(Syntax("colon", (), self.line))
            else:
                found.append(self.expression())
            if not self.accept(","):
                break
        self.expect("]")
        return tuple(found)
