"""Contents of hostile files, up to 1 MB each: some for every parser, others for one."""

from collections.abc import Callable, Iterator
from pathlib import Path

SIZE = 1_000_000
Contents = Iterator[tuple[str, bytes]]

_GOOD = Path(__file__).parents[1] / "fuzz" / "corpus" / "calibration" / "probe.toml"
_UNITS = (
    "9", ".", ",", ";", "\t", " ", '"', "'", "[", "{", "a", "-", "\\", "%", "&", "=", ":", "\n", "\r", "\0", "#", "é",
    "\U0001f600", "\ufeff", "\x1c", "\u2028", "a.", "a=1\n", "1,2\n", "1\n", '"\n', "a,", "1,", "1e", "[a]\n", "[[a]]\n",
    "'''", '"""', ":00000001FF\n", "800000\t812345\n", "12 ms\t", "OL ", '{"a":', "1.0 2.0\n",
)  # fmt: skip


def filled(unit: str | bytes, before: str = "", after: str = "") -> bytes:
    """Return a unit, repeated to `SIZE` bytes with what is before and after it."""
    repeated = unit.encode() if isinstance(unit, str) else unit
    left, right = before.encode(), after.encode()
    return left + repeated * ((SIZE - len(left) - len(right)) // len(repeated)) + right


def counted(pattern: str, before: str = "", after: str = "") -> bytes:
    """Return a pattern repeated with a running number in it."""
    count = (SIZE - len(before) - len(after)) // len(pattern.format(999_999))
    return (before + "".join(map(pattern.format, range(count))) + after).encode()


def anywhere() -> Contents:
    """Yield contents for every parser."""
    yield from ((repr(unit), filled(unit)) for unit in _UNITS)
    yield "surrogates", filled(b"\xed\xa0\x80")
    yield "not UTF-8", filled(b"\xfe")
    yield "every byte", bytes(range(256)) * (SIZE // 256)
    yield "UTF-16", b"\xff\xfe" + "1;2\n".encode("utf-16-le") * (SIZE // 8 - 1)


def toml() -> Contents:
    """Yield TOML for calibrations and palpate.toml."""
    yield "found: a dotted key of 100 kB", b"a." * 50_000 + b"a=1"
    yield "found: dotted keys", counted("a." * 1000 + "a{}=1\n")
    yield "dotted keys, 20 parts", counted("a." * 20 + "a{}=1\n")
    yield "dotted keys, from the first part on", counted("a{}" + ".a" * 32 + "=1\n")
    yield "spaced dotted key", filled("a . ", after="a=1")
    yield "quoted dotted key", filled('"".', after="a=1")
    yield "dotted table", filled("a.", "[", "a]")
    yield "dotted tables", counted("[" + "a." * 500 + "a{}]\n")
    yield "dotted keys in tables in a line", counted("x{} = {{" + "a." * 100 + "a=1}}\n")
    yield "tables", counted("[a{}]\n")
    yield "tables in tables", counted("[a.b{}.c]\nd.e=1\n")
    yield "keys", counted("a{}=1\n")
    yield "arrays in arrays", filled("[", "a=")
    yield "tables in tables in a line", filled("{a=", "a=")
    yield "digits", filled("9", "schema=")
    yield "digits, 4000 each", counted("a{}=" + "9" * 4000 + "\n")
    yield "digits with underscores", filled("9_", "schema=", "9")
    yield "hex digits", filled("f", "schema=0x")
    yield "digits of a fraction", filled("9", "schema=1.")
    yield "escapes", filled("\\u0041", 'schema="', '"')
    yield "a text of many lines", filled("\\\n", 'schema="""', '"""')
    yield "comments", filled("#\n")
    yield "numbers", filled("1,", "a=[", "]")
    yield "empty arrays", filled("[],", "a=[", "]")


def calibration() -> Contents:
    """Yield calibrations that are right but for one part."""
    yield from toml()
    good = _GOOD.read_text()
    longer = good
    for key, value in (("ratios", "1.5"), ("moduli_MPa", "1.5"), ("standard_errors", "0.1"), ("touches", "1")):
        start = longer.index(f"{key} = [") + len(key) + 4
        longer = longer[:start] + f"{value},\n" * 12_000 + longer[longer.index("]", start) :]
    yield "48,000 numbers", longer.encode()
    yield "a long note", good.replace("[about]", f'[about]\nx = "{"a" * 900_000}"').encode()
    yield "many notes", good.replace("[about]", "[about]\n" + "".join(f'x{i}="a"\n' for i in range(80_000))).encode()
    for key in ("schema", "touch_freedom", "misfit"):
        yield f"text as {key}", good.replace(f"{key} = ", f'{key} = "{"a" * 9000}"\nold_{key} = ').encode()


def sidecar() -> Contents:
    """Yield sidecars that are right but for one part."""
    long, text = '"' + "a" * 900_000 + '"', "[" * 900 + "]" * 900
    for schema in (1, 2):
        head = f'{{"schema":"palpate-recording-{schema}",'
        for name, marks in {
            "found: 100,000 marks": "0," * 100_000 + "0",
            "found: 10,000 tares": ",".join(f'{{"seq":{i},"tare":true}}' for i in range(10_000)),
            "found: deep marks": text,
            "deeper marks": "[" * 400_000,
            "digits": "9" * 900_000,
            "a tare of 4000 digits": f'{{"tare":true,"seq":{"9" * 4000}}}',
        }.items():
            yield f"{schema} {name}", f'{head}"device":{{}},"settings":{{}},"notes":[],"marks":[{marks}]}}'.encode()
        for name, part in {
            "found: full scale of 4000 digits": f'"device":{{"full_scale_pF":{"9" * 4000}}}',
            "a text as full scale": f'"device":{{"full_scale_pF":{long}}}',
            "many settings": '"settings":{' + ",".join(f'"a{i}":1' for i in range(80_000)) + "}",
            "a setting with a long name": f'"settings":{{{long}:1}}',
            "a long note": f'"notes":[{long[0]}begun after {long[1:]}]',
            "a list as end": '"end":[' + "1," * 400_000 + "1]",
            "a long repair": f'"end":{{"repaired":{long}}}',
            "rows of 4000 digits": f'"end":{{"rows":{"9" * 4000}}}',
        }.items():
            rest = {"device": "{}", "settings": "{}", "notes": "[]", "marks": "[]"}
            others = "".join(
                f',"{key}":{value}' for key, value in rest.items() if f'"{key}":' not in part[: len(key) + 3]
            )
            yield f"{schema} {name}", f"{head}{part}{others}}}".encode()


def table() -> Contents:
    """Yield tables of other loggers; the first byte selects the options."""
    for how in ("\1", "\2"):  # by names; by positions, with times
        head = f"{how}t,hard,soft\n"
        wide = "1," * 100_000 + "\n"
        yield f"found: 100,000 columns {how!r}", f"{how}t,hard,soft,{'a,' * 100_000}\n{wide}{wide}".encode()
        yield f"1000 columns {how!r}", f"{how}t,hard,soft,{'a,' * 996}\n{('1,' * 999 + chr(10)) * 490}".encode()
        yield f"header rows {how!r}", filled("a,b,c\n", how, "1,2,3\n" * 3)
        yield f"1000 header rows {how!r}", f"{how}{('a,' * 480 + chr(10)) * 999}t,hard,soft\n{'1,2,3' * 3}".encode()
        yield f"rows {how!r}", filled("1,2,3\n", head)
        yield f"rows, blanks {how!r}", filled("1 2 3\n", head)
        yield f"rows, quoted {how!r}", filled('"1","2","3"\n', head)
        yield f"rows, decimal commas {how!r}", filled("1,5;2,5;3,5\n", head.replace(",", ";"))
        yield f"dates {how!r}", filled("2026-01-01T00:00:00,2,3\n", head)
        yield f"overload {how!r}", filled("1,OL,OL\n", head + "1,2,3\n" * 3)
        yield f"digits {how!r}", filled("9", head + "1,2,3\n" * 3 + "1,2,")
        yield f"digits in cells {how!r}", filled("1,2," + "9" * 90_000 + "\n", head + "1,2,3\n" * 3)
        yield f"a long name {how!r}", filled("(", f"{how}t,hard,soft", "\n" + "1,2,3\n" * 3)
        yield f"blanks in a name {how!r}", filled(" ", f"{how}t,hard,soft", "x\n" + "1,2,3\n" * 3)
        yield f"CR {how!r}", filled("1,2,3\r", head.replace("\n", "\r"))
        yield f"open quote {how!r}", filled("a\n", head + '1,2,"')


def binary_data() -> Contents:
    """Yield "Binary Data.txt"."""
    time, rows = "conversion time: ", "\n800000\t812345\n"
    yield "found: 20,000 digits as time", (time + "9" * 20_000 + rows).encode()
    yield "digits as time", filled("9", time, rows)
    yield "dots as time", filled(".", time, rows)
    yield "blanks as time", filled(" ", time + "1", rows)
    yield "times", filled("conversion time: 9\n", after=rows[1:])
    yield "short lines", counted("a{}: " + "9" * 900 + "\n", after=rows[1:])
    yield "cells", filled("a: b\t", after=rows)
    yield "rows", filled("800000\t812345\n", "conversion time: 11 ms\n")
    yield "rows of one code", filled("800000\n", "conversion time: 11 ms\n")
    yield "empty rows", filled("\n", f"conversion time: 11 ms{rows}")
    yield "a long row", filled("f", f"conversion time: 11 ms{rows}")


def moduli() -> Contents:
    """Yield tables of moduli."""
    yield "many names", counted("a{},1\n", "name,modulus\n")
    yield "many names, 200 kB", counted("a{},1\n", "name,modulus\n")[:199_992]
    yield "a long name", filled("-", "name,modulus\n", ",1\n")
    yield "digits", filled("9", "name,modulus\nb,", "\n")
    yield "open quote", filled('"\n', 'name,modulus\n"')


def firmware() -> Contents:
    """Yield Intel HEX."""
    yield "a long record", filled("0", ":")
    records = (f":01{at:04X}0000{-(1 + (at >> 8) + at) & 255:02X}\n" for at in range(0x4000))
    yield "records of one byte", "".join(records).encode()


def uri() -> Contents:
    """Yield what stands behind the scheme of a source."""
    yield "options", counted("a{}=1&")
    for size in (9_900, SIZE):
        yield f"seed of {size}", b"x?seed=" + b"9" * size
        yield f"pattern of {size}", b"x?pattern=" + b"(a+)+" * (size // 5)
        yield f"groups of {size}", b"x?pattern=" + b"(" * size
        yield f"faults of {size}", b"four-specimens?fault=unplug@1" + b",unplug@1" * (size // 9)
        yield f"times of {size}", b"four-specimens?fault=unplug@" + b"9" * size


def own_file() -> Contents:
    """Yield rows of a recording by palpate."""
    row = "{},0.026,0.039,8388608,8400000,0.0,0.0,-1,0\n"
    yield "rows", counted(row)
    yield "equal rows", filled(row.format(1))
    yield "a long cell", filled("9", "1,0.026,0.039,8388608,8400000,", ",0.0,-1,0\n")
    yield "empty cells", filled(",,,,,,,\n")
    yield "a row of zeros", filled("\0", row.format(1))


SPECIAL: dict[str, Callable[[], Contents]] = {
    "own_file": own_file, "table": table, "sidecar": sidecar, "calibration": calibration, "config": toml,
    "binary_data": binary_data, "moduli": moduli, "firmware": firmware, "uri": uri,
}  # fmt: skip


def contents(parser: str) -> Contents:
    """Yield the contents for a parser: its own, then those for every one."""
    yield from SPECIAL.get(parser, lambda: iter(()))()
    yield from anywhere()
