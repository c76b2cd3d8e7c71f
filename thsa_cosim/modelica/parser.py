"""Tokens → class definitions, by recursive descent (Modelica Language Specification 3.6, appendix A)."""

import re
from pathlib import Path

from thsa_cosim.errors import ModelicaError
from thsa_cosim.modelica.expressions import ExpressionParser
from thsa_cosim.modelica.lexer import read_source, tokenize, unquote
from thsa_cosim.modelica.syntax import (
    Argument,
    ClassDefinition,
    Component,
    Equation,
    Extends,
    Import,
    Syntax,
)

_CLASS_KINDS = frozenset(
    ["class", "model", "block", "connector", "record", "type", "package", "function", "operator"]
)
_CLASS_PREFIXES = frozenset(["partial", "encapsulated", "expandable", "pure", "impure", "operator"])
_ELEMENT_PREFIXES = frozenset(["redeclare", "final", "inner", "outer", "replaceable"])
_TYPE_PREFIXES = frozenset(["flow", "stream", "discrete", "parameter", "constant", "input", "output"])
_SECTIONS = frozenset(
    ["public", "protected", "equation", "algorithm", "initial", "external", "annotation", "end"]
)


def parse_file(file: Path) -> tuple[str, list[ClassDefinition]]:
    """The ``within`` clause ("" if there is none) and the classes of a file.

    Raises ModelicaError, with file and line, for a syntax error.
    """
    parser = Parser(read_source(file), file)
    return parser.stored_definition()


class Parser(ExpressionParser):
    """One file; the methods are named after the productions of the grammar."""

    def __init__(self, source: str, file: Path) -> None:
        super().__init__(tokenize(source, file), file)

    def stored_definition(self) -> tuple[str, list[ClassDefinition]]:
        within = ""
        if self.accept("within"):
            if self.kind != ";":
                within = self.name()
            self.expect(";")
        classes = []
        while self.kind != "end-of-file":
            prefixes = {"final"} if self.accept("final") else set()
            classes.append(self.class_definition(prefixes, False))
            self.expect(";")
        return within, classes

    def at_class(self) -> bool:
        """Whether a class definition starts here."""
        if self.kind == "operator":
            return True
        return self.kind in _CLASS_KINDS or self.kind in _CLASS_PREFIXES

    def class_definition(self, prefixes: set[str], protected: bool) -> ClassDefinition:
        line = self.line
        words = set(prefixes)
        while self.kind in _CLASS_PREFIXES:
            words.add(self.advance())
        if self.kind in _CLASS_KINDS:
            kind = self.advance()
        elif "operator" in words:
            kind = "operator"
        else:
            raise self.error("a class (model, block, package, …)")
        extending = self.accept("extends")
        definition = ClassDefinition(self.identifier(), kind, self.file, line, frozenset(words))
        definition.protected, definition.extending = protected, extending
        if extending and self.kind == "(":
            definition.arguments = self.class_modification()
        if not extending and self.accept("="):
            self._short_class(definition)
        else:
            definition.description = self.string_comment()
            self._composition(definition)
            self.expect("end")
            closing = self.identifier()
            if closing != definition.name:
                raise ModelicaError(
                    f"{self.file}:{self.line}: class {definition.name} ends with the name {closing}."
                )
        if self.accept("constrainedby"):
            definition.constraint = (self.name(), self.class_modification() if self.kind == "(" else [])
            self.comment()
        return definition

    def _short_class(self, definition: ClassDefinition) -> None:
        if self.accept("enumeration"):
            self.expect("(")
            literals: list[str] = []
            if not self.accept(":"):
                while self.kind == "name":
                    literals.append(self.identifier())
                    self.comment()
                    if not self.accept(","):
                        break
            self.expect(")")
            definition.literals = tuple(literals)
        elif self.accept("der"):
            raise ModelicaError(
                f"{self.file}:{definition.line}: function {definition.name} is the derivative of another function, "
                "which the exporter does not support."
            )
        else:
            words = set(definition.prefixes)
            while self.kind in ("input", "output", "flow", "stream"):
                words.add(self.advance())
            definition.prefixes = frozenset(words)
            definition.base = self.name()
            definition.dimensions = self.array_subscripts() if self.kind == "[" else ()
            if self.kind == "(":
                definition.arguments = self.class_modification()
        definition.description = self.comment()

    def _composition(self, definition: ClassDefinition) -> None:
        protected = False
        while True:
            kind = self.kind
            if kind in ("public", "protected"):
                protected = self.advance() == "protected"
            elif kind == "end":
                return
            elif kind == "annotation":
                self.annotation(definition)
                self.expect(";")
            elif kind == "external":
                self._external(definition)
            elif kind in ("equation", "algorithm") or (
                kind == "initial" and self.peek() in ("equation", "algorithm")
            ):
                self._section(definition)
            else:
                self.element(definition.elements, protected)

    def _external(self, definition: ClassDefinition) -> None:
        self.advance()
        language = unquote(self.advance()) if self.kind == "string" else "C"
        called = ""
        while self.kind not in (";", "end-of-file"):
            if self.kind == "annotation":
                self.annotation(None)
                continue
            if self.kind == "name" and self.peek() == "(" and not called:
                called = self.tokens.texts[self.index]
            self.advance()
        self.expect(";")
        definition.external = (language, called or definition.name)

    def _section(self, definition: ClassDefinition) -> None:
        initial = self.accept("initial")
        is_equation = self.advance() == "equation"
        body: list[Equation] = []
        while self.kind not in _SECTIONS or (
            self.kind == "initial" and self.peek() not in ("equation", "algorithm")
        ):
            body.append(self.equation(is_equation))
            self.expect(";")
        if is_equation:
            (definition.initial_equations if initial else definition.equations).extend(body)
        else:
            (definition.initial_algorithms if initial else definition.algorithms).append(body)

    def element(self, into: "list[Component | Extends | Import | ClassDefinition]", protected: bool) -> None:
        if self.accept("import"):
            into.append(self._import())
            self.comment()
            self.expect(";")
            return
        if self.kind == "extends":
            line = self.line
            self.advance()
            base = self.name()
            into.append(Extends(base, self.class_modification() if self.kind == "(" else [], line))
            self.comment()
            self.expect(";")
            return
        words: set[str] = set()
        while self.kind in _ELEMENT_PREFIXES:
            words.add(self.advance())
        if self.at_class():
            into.append(self.class_definition(words, protected))
            self.comment()
        else:
            into.extend(self.component_clause(words, protected))
        self.expect(";")

    def _import(self) -> Import:
        first = self.name()
        if self.accept("="):
            return Import({first: self.name()}, [])
        if self.accept(".*"):
            return Import({}, [first])
        if self.accept("."):
            if self.accept("*"):
                return Import({}, [first])
            self.expect("{")
            names = {}
            while True:
                local = self.identifier()
                names[local] = f"{first}.{local}"
                if not self.accept(","):
                    break
            self.expect("}")
            return Import(names, [])
        return Import({first.rsplit(".", 1)[-1]: first}, [])

    def component_clause(self, words: set[str], protected: bool, single: bool = False) -> list[Component]:
        prefixes = set(words)
        while self.kind in _TYPE_PREFIXES:
            prefixes.add(self.advance())
        type_name = self.name()
        shared = self.array_subscripts() if self.kind == "[" else ()
        made = []
        while True:
            line = self.line
            name = self.identifier()
            own = self.array_subscripts() if self.kind == "[" else ()
            arguments = self.class_modification() if self.kind == "(" else []
            value = self.expression() if self.accept("=") or self.accept(":=") else None
            condition = self.expression() if self.accept("if") else None
            description = self.comment()
            made.append(
                Component(
                    name, type_name, frozenset(prefixes), (*own, *shared), arguments, value, condition, description,
                    None, protected, line,
                )
            )  # fmt: skip
            if single or not self.accept(","):
                break
        if self.accept("constrainedby"):
            constraint = (self.name(), self.class_modification() if self.kind == "(" else [])
            self.comment()
            for component in made:
                component.constraint = constraint
        return made

    def class_modification(self) -> list[Argument]:
        self.expect("(")
        arguments: list[Argument] = []
        while self.kind != ")":
            arguments.append(self.argument())
            if not self.accept(","):
                break
        self.expect(")")
        return arguments

    def argument(self) -> Argument:
        line = self.line
        words: set[str] = set()
        while self.kind in ("redeclare", "each", "final", "replaceable"):
            words.add(self.advance())
        each, final = "each" in words, "final" in words
        if "redeclare" in words or "replaceable" in words:
            prefixes = words - {"each"}
            element: Component | ClassDefinition
            if self.at_class():
                element = self.class_definition(prefixes, False)
            else:
                element = self.component_clause(prefixes, False, single=True)[0]
            return Argument(element.name, [], None, each, final, element, line)
        name = self.name()
        nested = self.class_modification() if self.kind == "(" else []
        value = self.expression() if self.accept("=") or self.accept(":=") else None
        self.string_comment()
        first, *rest = name.split(".")
        if rest:
            inner = Argument(rest[-1], nested, value, False, final, None, line)
            for part in reversed(rest[:-1]):
                inner = Argument(part, [inner], None, False, False, None, line)
            return Argument(first, [inner], None, each, False, None, line)
        return Argument(first, nested, value, each, final, None, line)

    def comment(self) -> str:
        text = self.string_comment()
        if self.kind == "annotation":
            self.annotation(None)
        return text

    def annotation(self, definition: ClassDefinition | None) -> None:
        """Skip an annotation; keep the experiment of the class."""
        self.advance()
        start, depth = self.index, 0
        kinds = self.tokens.kinds
        while True:
            kind = kinds[self.index]
            depth += (kind in "([{") - (kind in ")]}")
            if kind == "end-of-file":
                raise self.error("the end of the annotation")
            self.index += 1
            if depth == 0:
                break
        if definition is None:
            return
        positions = self.tokens.positions
        text = self.tokens.source[positions[start] : positions[self.index]]
        found = re.search(r"\bexperiment\s*\(([^)]*)\)", re.sub(r'"(?:\\.|[^"\\])*"', "", text))
        if found:
            pairs = re.findall(r"(\w+)\s*=\s*([-+.\deE]+)", found.group(1))
            definition.experiment = {key: float(value) for key, value in pairs}

    def equation(self, is_equation: bool) -> Equation:
        line = self.line
        kind = self.kind
        if kind == "if":
            branches, otherwise = self._branches("if", "elseif", is_equation)
            return Equation("if", (branches, otherwise), line)
        if kind == "when":
            branches, _ = self._branches("when", "elsewhen", is_equation)
            return Equation("when", (branches, []), line)
        if kind == "for":
            self.advance()
            iterators = self.iterators()
            self.expect("loop")
            body = self._body(is_equation)
            self.expect("end")
            self.expect("for")
            return Equation("for", (iterators, body), self._commented(line))
        if kind == "while":
            self.advance()
            condition = self.expression()
            self.expect("loop")
            body = self._body(is_equation)
            self.expect("end")
            self.expect("while")
            return Equation("while", (condition, body), self._commented(line))
        if kind in ("return", "break"):
            self.advance()
            return Equation(kind, (), self._commented(line))
        if kind == "connect":
            self.advance()
            self.expect("(")
            left = self.expression()
            self.expect(",")
            right = self.expression()
            self.expect(")")
            return Equation("connect", (left, right), self._commented(line))
        left = self.simple_expression()
        if self.kind in ("=", ":="):
            op = "equal" if self.advance() == "=" else "assign"
            right = self.expression()
            return Equation(op, (left, right), self._commented(line))
        if left.op != "call":
            raise self.error("= or :=")
        return Equation("call", (left,), self._commented(line))

    def _commented(self, line: int) -> int:
        self.comment()
        return line

    def _body(self, is_equation: bool) -> list[Equation]:
        body = []
        while self.kind not in ("end", "else", "elseif", "elsewhen"):
            body.append(self.equation(is_equation))
            self.expect(";")
        return body

    def _branches(
        self, word: str, other: str, is_equation: bool
    ) -> tuple[list[tuple[Syntax, list[Equation]]], list[Equation]]:
        self.advance()
        branches: list[tuple[Syntax, list[Equation]]] = []
        otherwise: list[Equation] = []
        condition = self.expression()
        self.expect("loop" if word == "loop" else "then")
        branches.append((condition, self._body(is_equation)))
        while self.accept(other):
            condition = self.expression()
            self.expect("then")
            branches.append((condition, self._body(is_equation)))
        if word == "if" and self.accept("else"):
            otherwise = self._body(is_equation)
        self.expect("end")
        self.expect(word)
        self.comment()
        return branches, otherwise
