"""Cost of the headers on a microcontroller: bytes, instructions and stack of each scene, estimator and stage.

    python -m bench.embedded.size [--target m4f ...] [--json FILE] [--worst]

Compiles each subject of subjects.hpp separately, in float, with -Os and -O2, links and runs the -Os image in QEMU,
and compares its results with those of this machine. --worst: only the table of docs/embedded.md, with -Os. Needs arm-none-eabi-g++ with libstdc++ and newlib,
qemu-system-arm, a C++ compiler; for rv32imafc, which is compiled only, riscv64-unknown-elf-g++.
"""

import argparse
import json
import tempfile
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

from bench.embedded import firmware
from bench.embedded.firmware import TARGETS, Cost, Target

# Symbols that compiled code may use: memory functions, which every C library has, and single-precision arithmetic.
MEMORY = {"memcpy", "memset", "memmove"}
HELPERS = (
    "__aeabi_f",
    "__aeabi_i2f",
    "__aeabi_ui2f",
    "__aeabi_uldiv",
    "__aeabi_idiv",
    "__aeabi_uidiv",
    "__gnu_thumb1",
)


def foreign(symbols: list[str]) -> list[str]:
    """Return the symbols that no scene may use: heap, unwinder, double arithmetic, and all unknown ones."""
    return [s for s in symbols if s not in MEMORY and not s.startswith(HELPERS)]


def measure(target: Target, host: list[str]) -> dict[str, Any]:
    """Return bytes, symbols and costs of each subject on a target, and whether the results are those of the host."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        compiled = {o: firmware.compile_subjects(target, o, folder) for o in ("-Os", "-O2")}
        rows: dict[str, dict[str, Any]] = {
            subject: {
                "text": {
                    o: firmware.text_bytes(target, objects[subject])
                    for o, objects in compiled.items()
                },
                "foreign": sorted(
                    {
                        s
                        for made in compiled.values()
                        for s in foreign(firmware.undefined(target, made[subject]))
                    }
                ),
                "memory": sorted(
                    MEMORY & set(firmware.undefined(target, compiled["-Os"][subject]))
                ),
            }
            for subject in firmware.subjects()
        }
        if not target.machine:
            return {"subjects": rows}
        lines = firmware.run_firmware(
            target, firmware.link_firmware(target, "-Os", list(compiled["-Os"].values()), folder)
        )
        for subject, cost in firmware.costs(target, lines).items():
            rows[subject] |= asdict(cost)
        return {
            "subjects": rows,
            "results": firmware.results(lines),
            "same_bits": firmware.results(lines) == host,
        }


def cells(row: dict[str, Any]) -> str:
    """Print one subject."""
    bytes_ = f"{row['text']['-Os']:8d} {row['text']['-O2']:8d}"
    if "mean" not in row:
        return bytes_
    cost = Cost(*(row[f.name] for f in fields(Cost)))
    instructions = f"{cost.mean:9.1f} {cost.worst:8.0f} {cost.dearest:8d} {cost.idle:7.0f}"
    return f"{bytes_} {cost.state:6d} {cost.stack:6d} {instructions}"


# What a stage adds: its name, a scene without it, and the same scene with it.
PRICES = (
    ("MatchedPair for Align", "Handheld", "HandheldMatched"),
    ("drift, wrong baseline", "HandheldMatched", "HandheldUnfitted"),
    ("Fit, revision, confirmation", "HandheldUnfitted", "HandheldTilted"),
    ("level ratio", "HandheldTilted", "HandheldFull"),
)


def prices(rows: dict[str, Any]) -> list[str]:
    """Return a line for each stage: what the scene with it costs more than the one without it."""
    lines = ["a stage more             text  state  stack    mean   worst"]
    for stage, without, with_it in PRICES:
        a = rows[without]
        b = rows[with_it]
        more = [
            b["text"]["-Os"] - a["text"]["-Os"],
            *(b[key] - a[key] for key in ("state", "stack", "mean", "worst")),
        ]
        lines.append("{:22} {:6d} {:6d} {:6d} {:7.0f} {:7.0f}".format(stage, *more))
    return lines


def show(name: str, table: dict[str, Any]) -> str:
    """Print the table of a target."""
    costs = "  state  stack      mean    worst  dearest    idle" if "results" in table else ""
    lines = [f"{name:18} text -Os      -O2{costs}  needs"]
    for subject, row in table["subjects"].items():
        needs = ", ".join([*row["memory"], *row["foreign"]]) or "-"
        lines.append(f"{subject:18} {cells(row)}  {needs}")
    if "results" in table:
        lines += prices(table["subjects"])
        lines.append(
            f"results: {'the same bits as' if table['same_bits'] else 'NOT THE BITS OF'} this machine"
        )
    return "\n".join(lines)


# The rows of the table of worst cases: the class that the documentation shows first comes first.
WORST_CASES = {
    "HandheldFull": "`FullHandheldTracker`",
    "Handheld": "`HandheldTracker`",
    "Sliding": "`SlidingTracker`",
    "PaperScene": "`PaperTracker`",
    "HandoverEstimator": "`Handover`",
    "WindowEstimator": "`AdaptiveWindow`, 10 levels",
    "PaperSafe": "`AdaptiveRls`",
    "Paper": "`PaperRls`",
    "Fixed": "`FixedRls`",
    "SlopeAndIntercept": "`VectorRls<float, 1, true>`",
    "SlopeWindow16": "the same, `Window` 16",
    "SlopeWindow8": "the same, `Window` 8",
    "SlopeAlarmed": "the same, `Window` 32, `alarmed` 0.9",
}
WORST_TARGETS = {"m0": "M0, M0+", "m3": "M3", "m4f": "M4F"}
WORST_HEAD = (
    "| class | processor | flash, text + data | RAM | stack | instructions, mean | worst | worst at 48 MHz, ms | at 168 MHz, ms |",
    "|---|---|---|---|---|---|---|---|---|",
)


def worst_case(target: Target) -> dict[str, tuple[int, Cost]]:
    """Return the bytes of code of each row of the table, and its costs."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        compiled = firmware.compile_subjects(target, "-Os", folder)
        image = firmware.link_firmware(target, "-Os", list(compiled.values()), folder)
        costs = firmware.costs(target, firmware.run_firmware(target, image))
        return {
            subject: (firmware.text_bytes(target, compiled[subject]), costs[subject])
            for subject in WORST_CASES
        }


def worst_table() -> list[str]:
    """Return the lines of the table of worst cases. An instruction counts as one cycle: multiply by the wait states of a flash."""
    costs = {name: worst_case(TARGETS[name]) for name in WORST_TARGETS}
    lines = list(WORST_HEAD)
    for subject, shown in WORST_CASES.items():
        for name, processor in WORST_TARGETS.items():
            text, cost = costs[name][subject]
            worst = max(cost.worst, cost.idle)
            times = " | ".join(f"{worst / (mhz * 1000):.2g}" for mhz in (48, 168))
            lines.append(
                f"| {shown} | {processor} | {text} + {cost.state} | {cost.state} | {cost.stack} "
                f"| {cost.mean:.0f} | {worst:.0f} | {times} |"
            )
            shown = ""  # once for a class
    return lines


def main() -> int:
    """Print the tables."""
    parser = argparse.ArgumentParser(description="What the headers cost on a microcontroller.")
    parser.add_argument("--target", nargs="*", choices=TARGETS, default=list(TARGETS))
    parser.add_argument("--json", type=Path)
    parser.add_argument("--host", default="c++", help="compiler for this machine")
    parser.add_argument("--worst", action="store_true", help="only the table of worst cases")
    arguments = parser.parse_args()
    if arguments.worst:
        arguments.target = list(WORST_TARGETS)
    if missing := firmware.missing([TARGETS[name] for name in arguments.target], arguments.host):
        parser.exit(
            2,
            "\n".join(
                ["not installed:", *missing, "or leave out the targets that need it: --target\n"]
            ),
        )
    if arguments.worst:
        print("\n".join(worst_table()))
        return 0
    with tempfile.TemporaryDirectory() as folder:
        host = firmware.host_results(arguments.host, Path(folder))
    print(
        "Bytes; instructions a reading with -Os: mean, worst of a touch and which reading that is, worst without touch\n"
    )
    tables = {}
    for name in arguments.target:
        tables[name] = measure(TARGETS[name], host)
        print(show(name, tables[name]) + "\n", flush=True)
    if arguments.json:
        arguments.json.write_text(json.dumps(tables, indent=1) + "\n")
    return 0 if all(t.get("same_bits", True) for t in tables.values()) else 1


if __name__ == "__main__":
    raise SystemExit(main())
