"""What palpate prints, writes and sends over fixed inputs, as text. `python tests/tools/freeze.py` writes tests/golden anew.

A changed line there is a changed behaviour: the commit says why.
"""

import asyncio
import inspect
import json
import pkgutil
import platform
import re
import sys
import tempfile
import zlib
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import chdir
from functools import cache
from pathlib import Path
from typing import Any

import palpate
from bs4 import BeautifulSoup
from command_lines import commands, run
from foreign_files import CASES, ending
from live_server import Live
from palpate.live.page_frames import HEADER, FrameKind
from palpate.simulation.scenarios import SCENARIOS
from palpate.simulation.scenarios import run as run_scenario
from project import FOUR, ROOT
from websockets.asyncio.client import connect

GOLDEN = ROOT / "tests" / "golden"
SIMULATED = ("stiff-steady", "step-up", "dropouts", "saturating", "not-level", "drift-both")
SIZE = r'(\bbytes"?\s*[=:]\s*)\d+(,?\s+"?sha256)'  # a sidecar has the version in it
EPHEMERAL = r'"(started|started_utc_ns|sidecar_crc32|python|system|version|palpate)": ("[^"]*"|\d+)'


def _cell(text: str, row: int, column: int, cell: str) -> str:
    lines = text.splitlines(keepends=True)
    cells = lines[row].rstrip("\n").split(",")
    cells[column] = cell
    return "".join([*lines[:row], ",".join(cells) + "\n", *lines[row + 1 :]])


DAMAGES: dict[str, Callable[[str], str]] = {
    "whole": str,
    "torn": lambda text: text[:-11],
    "gap": lambda text: "".join((lines := text.splitlines(keepends=True))[:400] + lines[420:]),
    "letter": lambda text: _cell(text, 300, 5, "0.1x"),
    "not-finite": lambda text: _cell(text, 300, 5, "nan"),
    "one-digit": lambda text: _cell(text, 300, 5, "0.62"),
    "windows": lambda text: text.replace("\n", "\r\n"),
    "header-only": lambda text: text.splitlines(keepends=True)[0],
    "no-codes": lambda text: re.sub(r"(?m)^(\d+,[\d.]+,[\d.]+),\d+,\d+,", r"\1,-1,-1,", text),
}


def recordings(folder: Path) -> Iterator[Path]:
    """Write the fixed recordings: whole, damaged and simulated ones."""
    yield from damaged(folder)
    for name in SIMULATED:
        path = folder / f"{name}.csv"
        for suffix, content in simulated(name).items():
            path.with_suffix(suffix).write_bytes(content)
        yield path


@cache
def simulated(name: str) -> dict[str, bytes]:
    """Return the files of a recorded simulation, by their suffixes."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"{name}.csv"
        said("record", f"sim:{name}?seed=1", "-o", str(path))
        return {each.suffix: each.read_bytes() for each in (path, path.with_suffix(".json"))}


def damaged(folder: Path) -> Iterator[Path]:
    """Write a recording in each form: with a sidecar, without one, without an end, of the first schema."""
    sidecar = json.loads(FOUR.with_suffix(".json").read_text())
    end = {"rows": 1411, "dropped": 0, "clean": True}
    bare = {key: value for key, value in sidecar.items() if key != "sidecar_crc32"}
    sidecars = {
        "described": FOUR.with_suffix(".json").read_text(),
        "bare": None,
        "unclean": json.dumps({key: value for key, value in bare.items() if key != "end"}),
        "first": json.dumps(bare | {"schema": "palpate-recording-1", "end": end}),
    }
    for damage, change in DAMAGES.items():
        for kind, description in sidecars.items():
            if kind in ("described", "bare") or damage in ("whole", "torn"):
                path = folder / f"{damage}-{kind}.csv"
                path.write_bytes(change(FOUR.read_text()).encode())
                if description is not None:
                    path.with_suffix(".json").write_text(description)
                yield path


def said(*arguments: str) -> str:
    """Return what a command prints, its messages and its exit code, without what depends on folder and time."""
    done = run(*arguments)
    return f"$ palpate {' '.join(arguments)}\n{done.stdout}{done.stderr}exit {done.exit_code}\n"


def _steady(text: str, folder: Path) -> str:
    """Replace the folder, times, versions; round numbers to 8 digits, for other versions of numpy and other processors."""
    text = re.sub(r"20\d\d-\d\d-\d\d[T ]\d\d:\d\d:\d\d(\+00:00| UTC)?|\b[0-9a-f]{64}\b", "*", text)
    text = text.replace(f"{folder}/", "").replace(str(folder), ".").replace(f"{ROOT}/", "")
    text = text.replace(platform.python_version(), "*")
    text = re.sub(SIZE, r"\1*\2", text)
    text = re.sub(EPHEMERAL, r'"\1": "*"', text)
    return re.sub(r"\d+\.\d{9,}(e-?\d+)?", lambda found: f"{float(found[0]):.8g}", text)


def replayed(folder: Path) -> str:
    """Return what replay and check say of each recording."""
    parts = []
    for path in recordings(folder):
        parts += [
            said("replay", str(path)),
            said("replay", str(path), "--json"),
            said("check", str(path), "--json"),
        ]
        parts.append(said("check", str(path)))
    whole = str(folder / "whole-described.csv")
    options = [["--scene", scene] for scene in ("fixed", "paper", "sliding")]
    options += [
        ["--offline", "--json"],
        ["--set", "false_alarm_interval=2e4", "--touch-seconds", "3"],
    ]
    return "".join([*parts, *(said("replay", whole, *words) for words in options)])


def written(folder: Path) -> str:
    """Return the files of simulated measurements: the sidecar, and the rows as their number, first, last and checksum."""
    parts = []
    for name in (*SIMULATED, "four-specimens"):
        path = folder / f"{name}.csv"
        said("record", f"sim:{name}?seed=1", "-o", str(path), "--note", "frozen")
        lines = path.read_text().splitlines()
        parts += [
            f"{name}: {len(lines)} lines, crc32 {zlib.crc32(path.read_bytes())}",
            *lines[:3],
            lines[-1],
        ]
        parts.append(path.with_suffix(".json").read_text())
    return "\n".join(parts)


def repaired(folder: Path) -> str:
    """Return what a repair says, and the files it leaves: size and checksum."""
    parts = []
    for path in damaged(folder):
        parts.append(said("check", "--repair", "--yes", str(path)))
        for left in sorted(folder.glob(f"{path.stem}.*")):
            size = left.stat().st_size if left.suffix != ".json" else ""
            parts.append(f"{left.name} {size}\n")
    return "".join(parts)


def foreign(folder: Path) -> str:
    """Return how `palpate replay` ends with each file of another program, and the ratios."""
    parts = []
    for number, (name, make) in enumerate(CASES.items()):
        (folder / str(number)).mkdir()
        parts.append(f"{name}: {ending(make, folder / str(number))}\n")
    return "".join(parts)


def _text_of(page: str) -> str:
    """Return the text of a page, a line for each part, and how many marks its drawings have."""
    soup = BeautifulSoup(page, "html.parser")
    marks = Counter(tag.name for tag in soup.find_all(["circle", "path", "line", "rect", "text"]))
    return "\n".join([*soup.stripped_strings, str(sorted(marks.items())), ""])


def advised(_: Path) -> str:
    """Return the flags and the advice of the touches of each scenario, and how they are shown."""
    parts = []
    for name in SCENARIOS:
        touches = palpate.touches(run_scenario(name, seed=1))
        parts += [f"== {name}", repr(touches), _text_of(touches._repr_html_())]
        for touch in touches:
            parts += [str(each) for each in palpate.advice(touch)]
            parts.append(json.dumps(touch.as_dict(), default=str))
    return "\n".join(parts)


def calibrated(folder: Path) -> str:
    """Return what calibrate, replay with a calibration, plot and report print and write."""
    said("simulate", "-o", str(folder / "ten"))
    said("simulate", "-o", str(folder / "gel"), "--object", "gel=1.1", "--seed", "7")
    said("record", "sim:four-specimens?seed=2", "-o", str(folder / "four.csv"))
    moduli = str(folder / "ten" / "moduli.csv")
    specimens = [
        str(path) for path in sorted((folder / "ten").glob("*.csv")) if str(path) != moduli
    ]
    probe, gel = folder / "probe.toml", folder / "gel" / "gel.csv"
    shared = ["--moduli", moduli, "--force", "-o"]
    parts = [
        said(
            "calibrate",
            *specimens,
            *shared,
            str(probe),
            "--report",
            str(folder / "calibration.html"),
        ),
        said("calibrate", *specimens, *shared, str(folder / "json.toml"), "--json"),
        said("calibrate", *specimens, *shared, str(folder / "level.toml"), "--ratio", "level"),
        said("calibrate", *specimens[:3], *shared, str(folder / "few.toml"), "--by", "mean"),
        said(
            "calibrate",
            *specimens,
            *shared,
            str(folder / "soft.toml"),
            "--free-soft-ratio",
            "--accept",
            "offset",
        ),
    ]
    parts += [path.read_text() for path in sorted(folder.glob("*.toml"))]
    for calibration in ("probe", "level", "few"):
        options = ["--calibration", str(folder / f"{calibration}.toml")]
        for path in (gel, folder / "four.csv"):
            parts += [
                said("replay", str(path), *options),
                said("replay", str(path), *options, "--json"),
            ]
        made = str(folder / f"{calibration}.html")
        parts.append(
            said("report", str(gel), *options, "-o", made, "--operator", "A. Bee", "--shore")
        )
        parts.append(_text_of(Path(made).read_text(encoding="utf-8")))
    parts.append(
        said("report", str(folder / "four.csv"), "-o", str(folder / "plain.html"), "--unit", "kPa")
    )
    parts += [
        _text_of((folder / name).read_text(encoding="utf-8"))
        for name in ("plain.html", "calibration.html")
    ]
    return "\n".join(parts)


def converted(folder: Path) -> str:
    """Return what convert, import and plot print of recordings and tables, and the size and checksum of what they write."""
    parts = []
    for number, path in enumerate(recordings(folder)):
        out = folder / f"{number}-out.csv"
        parts += [said("import", str(path)), said("convert", str(path), "-o", str(out))]
        if out.exists():
            parts += [f"crc32 {zlib.crc32(out.read_bytes())}", out.with_suffix(".json").read_text()]
    for number, make in enumerate(CASES.values()):
        (folder / f"case{number}").mkdir()
        words = [str(word) for word in make(folder / f"case{number}")]
        if words[0] != "-":
            parts += [said("import", *words), said("check", *words)]
    parts.append(said("plot", str(FOUR), "-o", str(folder / "drawn.png")))
    return "\n".join(parts)


def accepted(folder: Path) -> str:
    """Return what the commands for a board print of a simulated one."""
    with chdir(folder):
        report = str(folder / "kit.json")
        return "".join(
            [
                said("kit", "accept", "sim:?wiring=exca", "--no-prompt", "-o", report),
                Path(report).read_text(encoding="utf-8"),
                *(
                    said("kit", "scan", f"sim:{wiring}")
                    for wiring in ("", "?wiring=exca", "?wiring=excb-shorted")
                ),
                said("kit", "dump", "sim:"),
                said("kit", "noise", "sim:", "--capf", "0"),
                said("devices"),
            ]
        )


def names(_: Path) -> str:
    """Return the public names with their signatures and members."""
    listed = []
    for page in (ROOT / "docs" / "reference").glob("api*.md"):
        text = page.read_text(encoding="utf-8")
        listed += re.findall(r"^### `(palpate\.\S+)`$", text, re.MULTILINE)
    parts = [f"palpate: {' '.join(palpate.__all__)}"]
    for name in sorted(set(listed)):
        found = pkgutil.resolve_name(name)
        members = (
            sorted(each for each in dir(found) if not each.startswith("_"))
            if inspect.isclass(found)
            else []
        )
        parts.append(f"{name}{_signature(found)} {' '.join(members)}".rstrip())
    return "\n".join(parts) + "\n"


def _signature(found: Any) -> str:
    try:
        return re.sub(r" at 0x\w+", "", str(inspect.signature(found))) if callable(found) else ""
    except ValueError:
        return "(...)"


def helps(_: Path) -> str:
    """Return --help of each command."""
    return "\n".join(said(*words, "--help") for words, _ in commands())


async def _messages(
    live: Live, enough: Callable[[dict[str, Any]], bool]
) -> tuple[dict[str, Any], list[bytes]]:
    """Return the last message of each type that a page gets, and the frames of rows, until a state is enough."""
    last: dict[str, Any] = {"state": {"state": "begun"}}
    frames: list[bytes] = []
    address, origin = f"{live.address.replace('http', 'ws')}ws", live.origin.rstrip("/")
    async with connect(address, origin=origin) as socket:  # type: ignore[arg-type]
        while not enough(last):
            message = await asyncio.wait_for(socket.recv(), 60)
            if isinstance(message, bytes):
                _, number, rows, kind = HEADER.unpack_from(message)
                if kind == FrameKind.VIEW:
                    last[f"view{number}"] = {
                        "rows": rows,
                        "crc32": zlib.crc32(message[HEADER.size :]),
                    }
                else:
                    frames.append(message)
                continue
            document = json.loads(message)
            if document["type"] == "touches":  # only the rows that changed
                before = last.get("touches", {"rows": []})["rows"][: document.pop("count")]
                rows = {row["number"]: row for row in before + document["rows"]}
                document["rows"] = [rows[number] for number in sorted(rows)]
            if document.get("state") == "ended" and last["state"]["state"] != "ended":
                for touch in last["touches"]["rows"]:
                    part = {"from_s": touch["start_s"], "to_s": touch["end_s"], "rows": 512}
                    await socket.send(json.dumps({"do": "view", "id": touch["number"], **part}))
            last[document["type"]] = document
    return last, frames


def _page(
    source: str, enough: Callable[[dict[str, Any]], bool]
) -> tuple[dict[str, Any], list[bytes]]:
    with chdir(FOUR.parent), Live(source=source) as live:
        return asyncio.run(_messages(live, enough))


def _keys(value: Any, path: str = "") -> Iterator[str]:
    """Name each place of a document with the type of its value."""
    if isinstance(value, dict):
        for key, each in value.items():
            yield from _keys(each, f"{path}.{key}")
    elif isinstance(value, list):
        for each in value:
            yield from _keys(each, f"{path}[]")
    else:
        yield f"{path}: {type(value).__name__}"


def page(_: Path) -> str:
    """Return the messages of a page that shows a recording, and the form and the touches of those of a measurement."""
    shown, frames = _page(
        FOUR.name, lambda last: last["state"]["state"] == "ended" and "view4" in last
    )
    for file in shown["recordings"]["files"]:
        file["changed_s"] = 0.0  # of the checkout
    parts = [json.dumps(shown[name]) for name in sorted(shown)]
    parts.append(
        f"{len(frames)} frames of rows, crc32 {[zlib.crc32(frame[16:]) for frame in frames]}"
    )
    played, _frames = _page(
        f"{FOUR.name}?speed=60", lambda last: last["state"]["state"] == "ended" and "view4" in last
    )
    for name in sorted(played):
        parts += [name, *sorted(set(_keys(played[name])))]
    parts.append(json.dumps(played["touches"]))
    return "\n".join(parts).replace(palpate.__version__, "*") + "\n"


FROZEN: dict[str, Callable[[Path], str]] = {
    made.__name__: made
    for made in (
        replayed,
        written,
        repaired,
        foreign,
        advised,
        calibrated,
        converted,
        accepted,
        names,
        helps,
        page,
    )
}


def frozen(name: str) -> str:
    """Return one of the texts."""
    with tempfile.TemporaryDirectory() as folder:
        return _steady(FROZEN[name](Path(folder)), Path(folder))


if __name__ == "__main__":
    for name in sys.argv[1:] or FROZEN:
        (GOLDEN / f"{name}.txt").write_text(frozen(name), encoding="utf-8")
