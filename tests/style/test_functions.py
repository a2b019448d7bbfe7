"""No function of the C++ core is longer than a screen's third: 25 lines between its braces."""

import re

from project import ROOT

LONGEST = 25
# A comment or a string may contain a brace.
HIDDEN = re.compile(r'//[^\n]*|"[^"\n]*"')
# Every function of the core is noexcept; up to its body there are a type, or members and their values.
HEAD = re.compile(r"\bnoexcept\b[^;]*?\{\n")


def lengths(text: str) -> dict[int, int]:
    """Return the lines between the braces of each function that has some, by the line of its opening brace."""
    code = HIDDEN.sub("", text)
    found = {}
    for head in HEAD.finditer(code):
        depth = 1
        end = head.end()
        while depth > 0:
            depth += {"{": 1, "}": -1}.get(code[end], 0)
            end += 1
        found[code.count("\n", 0, head.end())] = code.count("\n", head.end(), end)
    return found


def test_no_function_of_the_core_is_too_long() -> None:
    too_long = {}
    for header in sorted((ROOT / "cpp" / "include").rglob("*.hpp")):
        for line, length in lengths(header.read_text(encoding="utf-8")).items():
            if length > LONGEST:
                too_long[f"{header.name}:{line}"] = length
    assert too_long == {}


def test_the_lines_between_the_braces_are_counted() -> None:
    text = """int one() noexcept { return 1; }
    Two(int a) noexcept
        : a_{a} {
      if (a) {  // }
        print("}");
      }
    }
    int declared() noexcept;
    auto three() noexcept -> int {
      return 3;
    }
"""
    assert lengths(text) == {3: 3, 9: 1}
