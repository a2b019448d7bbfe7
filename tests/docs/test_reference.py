"""The pages of docs/reference: they are fresh, and have every command, option, setting, flag and public name."""

import inspect
import re
from pkgutil import resolve_name

import click
import palpate
import pytest
from command_lines import commands
from palpate._core import scenes
from palpate.flags import Flag
from palpate.sources.registry import schemes
from project import ROOT

from docs.generator import cpp_headers, cpp_pages, docstrings, python_pages
from docs.generator.__main__ import pages
from docs.generator.api_names import PAGES
from docs.generator.attributes import attribute_docstrings
from docs.generator.markdown import headings, prose, table
from docs.generator.option_pages import SCHEMES, Scheme, options_table, tracker_of

FOLDER = ROOT / "docs" / "reference"
COMMITTED = {path.name: path.read_text(encoding="utf-8") for path in FOLDER.glob("*.md")}
# At namespace scope, as the headers are written: not indented.
_CPP_NAME = re.compile(
    r"^(?:(?:class|struct|enum class|enum) (\w+)\b(?! *<)[^;]*?\{|using (\w+) =)", re.MULTILINE
)


def section(page: str, heading: str) -> str:
    """Return the part of a page below a heading, up to the next one of the same size."""
    level = heading.split(" ")[0]
    return COMMITTED[page].split(f"\n{heading}\n")[1].split(f"\n{level} ")[0]


def test_the_pages_are_fresh() -> None:
    made = pages()
    assert COMMITTED.keys() == made.keys()
    old = [name for name, text in made.items() if COMMITTED[name] != text]
    assert old == [], "run python -m docs.generator"


def test_every_command_and_option_is_on_a_page() -> None:
    checked = 0
    for words, command in commands():
        part = section("commands.md", f"## `{' '.join(('palpate', *words))}`")
        for parameter in command.params:
            if isinstance(parameter, click.Option) and parameter.name != "debug":
                checked += 1
                names = [name for name in parameter.opts if f"`{name}`" in part]
                assert names == parameter.opts, (words, parameter.opts)
    assert checked > 100


def test_every_setting_is_on_a_page() -> None:
    part = section("settings.md", "## Scenes")
    for scene in scenes:
        for name in tracker_of(scene).settings:
            assert f"| `{name}` |" in part
    for estimator in (palpate.Rls(), palpate.AdaptiveRls(), palpate.HandoverRls()):
        part = section("settings.md", f"## `palpate.{type(estimator).__name__}`")
        assert [name for name in estimator.settings if f"| `{name}` |" not in part] == []


def test_every_option_of_a_source_is_on_a_page() -> None:
    assert SCHEMES.keys() - {""} <= set(schemes())
    for name, scheme in SCHEMES.items():
        part = section("sources.md", f"## `{name}:`" if name else "## A path")
        described = attribute_docstrings(scheme.options)
        for field, check in checks(scheme).items():
            assert field in described or not check, f"{scheme.options.__name__}.{field}"
        assert [field for field in described if f"| `{field}` |" not in part] == []


def checks(scheme: Scheme) -> dict[str, bool]:
    """Return whether each option of a kind of source can be in its name."""
    fields = scheme.options.__dataclass_fields__
    return {name: "check" in field.metadata for name, field in fields.items()}


def test_every_flag_and_public_name_is_on_a_page() -> None:
    assert [flag for flag in Flag if f"| `{flag}` |" not in COMMITTED["flags.md"]] == []
    listed = [name for page in PAGES for name in page.names()]
    assert len(set(listed)) == len(listed)
    public = {id(getattr(palpate, name)) for name in palpate.__all__ if name != "__version__"}
    assert public <= {id(resolve_name(name)) for name in listed}
    for page in PAGES:
        shown = [heading for heading, _ in headings(COMMITTED[page.file])]
        assert [name for name in page.names() if f"`{name}`" not in shown] == []


def test_every_public_name_of_the_headers_is_on_a_page() -> None:
    shown = [heading.strip("`") for heading, _ in headings(COMMITTED["cpp.md"])]
    missing = []
    for path in cpp_pages.headers():
        text = path.read_text(encoding="utf-8").split("namespace palpate", 1)[-1]
        text = re.sub(r"namespace detail \{.*?\}  // namespace detail", "", text, flags=re.DOTALL)
        below = "palpate::"
        if path.stem in ("design", "embedded"):
            below += f"{path.stem}::"
        names = {a or b for a, b in _CPP_NAME.findall(text)} - cpp_pages.PARTS
        missing += [below + name for name in names if below + name not in shown]
    assert missing == []
    assert "palpate::embedded::PaperRls" in shown


HEADER = """
/// Room.
namespace palpate {
/// One; a brace } in words.
template <class Real, class Other = int>
class One : detail::Base<Real> {
 public:
  /// Made of a value.
  constexpr explicit One(Real value) noexcept : detail::Base<Real>{value}, value_(value) {}
  Real field = 1;  ///< pF
  static constexpr auto visit = [](auto& s) noexcept { s.x(); };  ///< each field
  /// @{
  /// As of a list.
  int begin() const noexcept { return '{'; }
  int end() const noexcept { return 2; }
  /// @}
 private:
  Real value_;
};
namespace detail {
struct Hidden {};
}  // namespace detail
/// Which.
enum class Which { first, second };
}  // namespace palpate
"""


def test_a_header_is_understood() -> None:
    one, which = cpp_headers.Reader(HEADER).declarations()
    assert cpp_pages.written(one, "one.hpp") == (
        "template <class Real, class Other = int>\n"
        "class One {\n"
        "  constexpr explicit One(Real value) noexcept;  // Made of a value.\n"
        "  Real field = 1;  // pF\n"
        "  static constexpr auto visit;  // each field\n"
        "  int begin() const noexcept;  // As of a list.\n"
        "  int end() const noexcept;\n"
        "};"
    )
    assert which.comment.strip() == "Which."
    assert cpp_pages.written(which, "one.hpp") == "enum class Which {\n  first,\n  second,\n};"


@pytest.mark.parametrize(
    ("text", "name"),
    [("struct Bare {};", "Bare"), ("/// Has.\nstruct Has {\n  int bare;\n};", "bare")],
)
def test_a_comment_that_is_missing_is_an_error(text: str, name: str) -> None:
    declarations = list(cpp_headers.Reader(text).declarations())
    with pytest.raises(ValueError, match=rf"one.hpp: .*{name} has no comment"):
        list(cpp_pages.described_declarations(declarations, "palpate", "one.hpp"))


def documented(low: float, *, high: float = 1.5) -> None:
    r"""Return nothing *of* <use>, $5.

    Parameters
    ----------
    low, high : float, pF
        The range, as `low`.

    Returns
    -------
    numpy.ndarray, shape (n,)
        Numbers:
        two lines.

    Examples
    --------
    >>> documented(1)
    """


def test_a_docstring_is_written_as_markdown() -> None:
    parts = docstrings.as_markdown(docstrings.parse(inspect.getdoc(documented) or ""))
    assert parts == [
        r"Return nothing \*of\* &lt;use>, \$5.",
        "**Parameters**",
        "- `low`, `high` (float, pF): The range, as `low`.",
        "**Returns**",
        "- numpy.ndarray, shape (n,): Numbers: two lines.",
        "```pycon\n>>> documented(1)\n```",
    ]
    assert python_pages.signature("documented", documented) == "documented(low, *, high=1.5)"


def test_text_keeps_its_meaning_in_markdown() -> None:
    assert prose("a * b, **kw, `**kw` and x_1") == r"a * b, \*\*kw, `**kw` and x_1"
    assert table(("a", "b"), [("1 | 2", "x\ny")]) == "| a | b |\n|---|---|\n| 1 \\| 2 | x y |"
    assert [anchor for _, anchor in headings("# A `b.c`\n\n```sh\n# no\n```\n\n## A bc")] == [
        "a-bc",
        "a-bc-1",
    ]
    assert "| `seed` | `0` |" in options_table(SCHEMES["sim"].options)
