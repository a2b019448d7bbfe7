"""The drawing of the wiring, for docs/wiring.md. ``python -m palpate.figures.wiring FILE.svg`` writes it."""

import sys
from pathlib import Path
from typing import NamedTuple

from palpate.files import replacing

_STYLE = """
  svg { background: #ffffff; font: 14px system-ui, sans-serif }
  text { fill: #1b1f24 } .small { font-size: 12px } .title { font-weight: 600 }
  .box { fill: #f3f5f7; stroke: #57606a; stroke-width: 1.5 } .part { fill: #ffffff; stroke: #57606a; stroke-width: 1.5 }
  .line { fill: none; stroke: #57606a; stroke-width: 1.5 } .missing { stroke-dasharray: 4 3 }
  .exc { fill: none; stroke: #b3450b; stroke-width: 3 } .hard { fill: none; stroke: #0b5cad; stroke-width: 3 }
  .soft { fill: none; stroke: #1a7f4b; stroke-width: 3 } .remove { stroke: #cf222e; stroke-width: 3 }
  .warn { fill: #cf222e } .dot { fill: #b3450b }
  @media (prefers-color-scheme: dark) {
    svg { background: #16191d } text { fill: #e6e9ec } .box { fill: #22272e; stroke: #9aa4ae }
    .part { fill: #16191d; stroke: #9aa4ae } .line { stroke: #9aa4ae } .exc { stroke: #ff9b5e } .dot { fill: #ff9b5e }
    .hard { stroke: #6cb2ff } .soft { stroke: #56d08b } .remove { stroke: #ff7b72 } .warn { fill: #ff7b72 }
  }
"""
_TITLE = "Wiring of the probe to the evaluation kit with the default options"
_BOARD_END, _PROBE = 400, 640  # x of the board's edge, and of the probe's


class _Socket(NamedTuple):
    """A pin of the chip that is led to the edge of the board."""

    y: int
    pin: str
    place: str
    populated: bool = True


_SOCKETS = (
    _Socket(80, "CIN1+", "P4"),
    _Socket(120, "CIN1-", "P3"),
    _Socket(180, "EXCB", "P2"),
    _Socket(220, "EXCA", "P1"),
    _Socket(280, "CIN2+", "P6", populated=False),
    _Socket(320, "CIN2-", "P5", populated=False),
)


def drawing() -> str:
    """Return the drawing as SVG: board, sockets, R1 and R2, and the two bumps, for the default options.

    Returns
    -------
    str
        It follows the reader's choice of light or dark.

    Examples
    --------
    >>> drawing().count("remove R1 and R2")
    1
    """
    parts = [*_board(), *_sockets(), *_demo(), *_probe()]
    return "\n".join([
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 860 480" role="img" aria-label="{_TITLE}">',
        f"<title>{_TITLE}</title>",
        f"<style>{_STYLE}</style>",
        *parts,
        "</svg>",
        "",
    ])  # fmt: skip


def _text(x: float, y: float, text: str, css: str = "", anchor: str = "start") -> str:
    return f'<text x="{x:g}" y="{y:g}" text-anchor="{anchor}" class="{css}">{text}</text>'


def _path(css: str, *points: tuple[float, float]) -> str:
    return f'<path class="{css}" d="M{" L".join(f"{x:g} {y:g}" for x, y in points)}"/>'


def _box(css: str, x: float, y: float, width: float, height: float) -> str:
    return f'<rect class="{css}" x="{x:g}" y="{y:g}" width="{width:g}" height="{height:g}" rx="4"/>'


def _board() -> list[str]:
    return [
        _box("box", 20, 20, _BOARD_END - 20, 440),
        _text(34, 44, "EVAL-AD7746EB", "title"),
        _box("part", 60, 64, 110, 274),
        _text(115, 205, "AD7746", "title", "middle"),
    ]


def _sockets() -> list[str]:
    parts = []
    for y, pin, place, populated in _SOCKETS:
        css = "part" if populated else "part missing"
        parts += [
            _path("line", (170, y), (_BOARD_END - 10, y)),
            _text(178, y - 6, pin, "title"),
            f'<circle class="{css}" cx="{_BOARD_END}" cy="{y}" r="11"/>',
            _text(_BOARD_END - 18, y - 6, place, "small", "end"),
        ]
    return [*parts, _text(_BOARD_END + 20, 344, "P5, P6: pads only, no sockets", "small")]


def _demo() -> list[str]:
    """Draw the length sensor at CIN2+ and EXCA, with R1 and R2 taken off."""
    parts = [_box("part missing", 190, 392, 180, 50), _text(280, 412, "length sensor", "small", "middle")]
    parts += [_text(280, 430, "of the board, 1.4 pF", "small", "middle")]
    for x, y, name in ((250, 220, "R1"), (310, 280, "R2")):
        parts += [
            _path("line", (x, y), (x, 352)),
            _path("line", (x, 374), (x, 392)),
            f'<circle cx="{x}" cy="{y}" r="3" class="line"/>',
            _path("remove", (x - 8, 355), (x + 8, 371)),
            _path("remove", (x - 8, 371), (x + 8, 355)),
            _text(x + 14, 368, name, "title warn"),
        ]
    return [*parts, _text(34, 368, "remove R1 and R2", "warn")]


def _probe() -> list[str]:
    """Draw the bumps as capacitors: one plate at an input, the other at EXCB."""
    parts = [_box("box", _PROBE, 50, 200, 290), _text(_PROBE + 14, 74, "probe", "title")]
    for name, socket, plate, other in (("hard", 80, 120, 132), ("soft", 280, 240, 228)):
        parts += [
            _path(name, (_BOARD_END + 11, socket), (540, socket), (540, plate), (715, plate)),
            _path("exc", (685, other), (715, other)),
            _text(730, (plate + other) / 2 + 5, f"{name} bump"),
        ]
    return [
        *parts,
        _path("exc", (_BOARD_END + 11, 180), (700, 180)),
        _path("exc", (700, 132), (700, 228)),
        '<circle class="dot" cx="700" cy="180" r="4"/>',
        _text(425, 70, "hard: CIN1+", "small"),
        _text(425, 170, "both: EXCB", "small"),
        _text(425, 270, "soft: CIN2+", "small"),
    ]


if __name__ == "__main__":
    with replacing(Path(sys.argv[1])) as target:
        target.write(drawing().encode())
