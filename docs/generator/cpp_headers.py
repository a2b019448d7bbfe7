"""Reads the declarations of the C++ headers with their comments. It knows the layout of clang-format.

A comment of three slashes is above its declaration, or behind it with `///<`. `/// @{` and `/// @}`
give one comment to all declarations between them. Private members and the namespace `detail` are
left out.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field

_OPEN = "([{"
_CLOSE = ")]}"
_TYPE = re.compile(
    r"(?:template <.*> )?(?:struct|class|enum class|enum|union) (?:\w+)[^()]*", re.DOTALL
)
_NAMESPACE = re.compile(r"(?:inline )?namespace (\w*) ?\{")
_ACCESS = re.compile(r"(public|private|protected):")
_ENUMERATOR = re.compile(r"^\s*(\w+)(?: = ([^,/]+?))?,?\s*///<\s*(.*)$", re.MULTILINE)
_OTHER_COMPILER = re.compile(r"^#else$.*?(?=^#endif)", re.DOTALL | re.MULTILINE)
_LONGEST_VALUE = 60
_MACROS = ("PALPATE_INLINE ", "PALPATE_COLD ")


@dataclass
class Declaration:
    """A declaration without its body, its comment, and for a class the public members."""

    text: str
    comment: str
    members: list["Declaration"] = field(default_factory=list)
    body: str = ""

    @property
    def name(self) -> str:
        """The name that it declares."""
        text = without_template(self.text)
        found = re.search(r"(?:struct|class|enum class|enum|union|using|namespace) ([\w:]+)", text)
        if found and not text.startswith(("friend", "constexpr", "inline")):
            return str(found[1]).rpartition("::")[2]
        head = re.split(r" = |\{", text)[0]
        called = re.search(r"(operator[^ (]+|~?\w+)\(", head)
        if called:
            return str(called[1])
        words: list[str] = re.findall(r"\w+", head.partition("[")[0])
        return words[-1]


class Reader:
    """Reads the text of a header, or of a part of it, from left to right."""

    def __init__(self, text: str) -> None:
        self.text = _OTHER_COMPILER.sub("", text)
        self.at = 0

    def declarations(self, is_public: bool = True) -> Iterator[Declaration]:
        """Yield the declarations of one scope."""
        comment = ""
        is_group = False
        while self._skip_blank():
            access = _ACCESS.match(self.text, self.at)
            namespace = _NAMESPACE.match(self.text, self.at)
            if self._starts("///"):
                line = self._line().removeprefix("///").removeprefix(" ")
                if line in ("@{", "@}"):
                    is_group = line == "@{"
                    comment = ""
                else:
                    comment += line + "\n"
            elif self._starts("//"):
                self._line()
            elif self._starts("#"):
                self._directive()
                comment = ""
            elif access:
                is_public = access[1] == "public"
                self.at = access.end()
            elif namespace:
                yield from self._namespace(namespace, comment)
                comment = ""
            else:
                found = self._declaration(comment)
                if not is_group:
                    comment = ""
                if is_public and found.text:
                    yield found

    def _namespace(self, head: "re.Match[str]", comment: str) -> Iterator[Declaration]:
        inside = self._block(head.end() - 1)
        name = head[1]
        if name == "detail":
            return
        found = list(Reader(inside).declarations())
        if name in ("palpate", "PALPATE_NAMESPACE"):
            yield from found
        else:
            yield Declaration(f"namespace {name}", comment, found)

    def _declaration(self, comment: str) -> Declaration:
        begin = self.at
        body = ""
        depth = 0
        while self.at < len(self.text):
            character = self.text[self.at]
            head = self.text[begin : self.at]
            if character == '"':
                self.at = self.text.index('"', self.at + 1)
            elif self._starts("//"):
                self.at = self.text.index("\n", self.at)
                continue
            elif character == ";" and depth == 0:
                break
            elif character == "{" and depth == 0 and begins_body(head):
                body = self._block(self.at)
                if not is_type(head):
                    self.at -= 1
                    break
                continue
            elif character in _OPEN:
                depth += 1
            elif character in _CLOSE:
                depth -= 1
            self.at += 1
        head = self.text[begin : self.at]
        self.at += 1
        comment += self._trailing()
        if is_type(head) and body:
            return self._type(head, body, comment)
        return Declaration(declared(head), comment)

    def _type(self, head: str, body: str, comment: str) -> Declaration:
        words = one_line(head[: head.index("{")])
        text = without_private_bases(words)
        if " enum " in f" {text} " or text.startswith("enum"):
            return Declaration(text, comment, body=body)
        is_class = "class" in without_template(text).split()[:1]
        return Declaration(text, comment, list(Reader(body).declarations(not is_class)))

    def _trailing(self) -> str:
        found = re.compile(r"[ \t]*///<(.*)(?:\n[ \t]*///<(.*))*").match(self.text, self.at)
        if not found:
            return ""
        self.at = found.end()
        lines = [line.strip().removeprefix("///<") for line in found[0].splitlines()]
        return " ".join(line.strip() for line in lines)

    def _block(self, at: int) -> str:
        """Return what is between a brace and its partner, and go behind it."""
        depth = 0
        for found in re.compile(r'[{}]|//.*|"[^"\n]*"|\'[^\'\n]\'').finditer(self.text, at):
            if found[0] == "{":
                depth += 1
            elif found[0] == "}":
                depth -= 1
                if depth == 0:
                    self.at = found.end()
                    return self.text[at + 1 : found.start()]
        raise ValueError(f"a brace without its partner: {self.text[at : at + 60]!r}")

    def _skip_blank(self) -> bool:
        while self.at < len(self.text) and self.text[self.at].isspace():
            self.at += 1
        return self.at < len(self.text)

    def _starts(self, text: str) -> bool:
        return self.text.startswith(text, self.at)

    def _line(self) -> str:
        end = self.text.find("\n", self.at)
        if end < 0:
            end = len(self.text)
        line = self.text[self.at : end]
        self.at = end
        return line

    def _directive(self) -> None:
        while self._line().endswith("\\"):
            self.at += 1


def one_line(text: str) -> str:
    """Return code on one line, without its comments."""
    return " ".join(re.sub(r"//.*", "", text).split())


def without_template(text: str) -> str:
    """Return a declaration without `template <...>` before it."""
    text = one_line(text)
    while text.startswith("template <"):
        depth = 0
        for found in re.finditer("[<>]", text):
            depth += 1 if found[0] == "<" else -1
            if depth == 0:
                text = text[found.end() :].lstrip()
                break
    return text


def is_type(head: str) -> bool:
    """Return whether this is the head of a class or an enumeration."""
    text = without_template(head).partition("{")[0]
    return bool(re.match(r"(struct|class|enum|union)\b", text)) and "(" not in text


def begins_body(head: str) -> bool:
    """Return whether the brace after this begins a body, not an initial value."""
    if is_type(head):
        return True
    text = without_template(head)
    outside = re.sub(r"\([^()]*\)", "", re.sub(r"\([^()]*\)", "", text))
    return "(" in text and " = " not in outside and head[-1:].isspace()


def declared(head: str) -> str:
    """Return a declaration without body, initializers of a constructor, and long values."""
    text = one_line(head)
    for macro in _MACROS:
        text = text.replace(macro, "")
    if without_template(text).startswith(("static_assert", "friend class", "friend struct")):
        return ""
    text = re.split(r"(?<=\)) : (?=\w)|(?<=noexcept) : (?=\w)", text)[0]
    if "(" in text and " = [" not in text:
        text = cut_body(text)
    rest = without_template(text)
    name, _, value = rest.partition(" = ")
    is_variable = "(" not in name and not rest.startswith("using")
    if is_variable and (len(value) > _LONGEST_VALUE or "{" in value):
        text = text[: len(text) - len(rest)] + name
    return text.strip()


def cut_body(text: str) -> str:
    """Return a function's declaration up to its body."""
    depth = 0
    for i, character in enumerate(text):
        if character in "(":
            depth += 1
        elif character in ")":
            depth -= 1
        elif character == "{" and depth == 0 and text[i - 1] == " ":
            return text[:i].rstrip()
    return text


def without_private_bases(text: str) -> str:
    """Return the head of a class without bases that are private or of the inside."""
    start = len(text) - len(without_template(text))
    head, colon, bases = text[start:].partition(" : ")
    if not colon or head.startswith("enum"):
        return text
    if head.startswith("class") or "detail::" in bases:
        return text[:start] + head
    return text


def enumerators(body: str) -> list[tuple[str, str]]:
    """Return name and comment of each enumerator; one without a comment has its name alone."""
    found = [(name, comment) for name, _, comment in _ENUMERATOR.findall(body)]
    if found:
        return found
    return [(name, "") for name in re.findall(r"\w+", re.sub(r"//.*", "", body))]
