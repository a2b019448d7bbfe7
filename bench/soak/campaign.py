"""What is promised while everything around a measurement fails: a campaign of faults, and what it lost.

    python -m bench.soak.campaign [--seconds 3600] [--seed 1] [--write]

Each open, write, sync and rename of a recording, and each print, fails in the C library at its first, middle and last call: once,
or for less time than the rows can wait. Each kind of fault of a USB transfer strikes a simulated board at the beginning, in the
middle and at the end; then, too, the computer sleeps, the program is stopped, the wall clock is set. Processes are killed. What time is left goes to random calls, durations and moments. Prints what was tried,
lost and ended; the samples are always the same, so the touches have to be those of a session without faults. Exit code 1: a
promise is broken. `--write` stores the figures in bench/results and SECURITY.md. Needs Linux, a C compiler, and the extra live.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass, field
from errno import EACCES, EBUSY, EIO, EMFILE, ENOSPC, EPIPE
from pathlib import Path
from random import Random

from palpate import check
from palpate.files import Json, write_file
from palpate.recording.sidecar import load_checked

from bench.results_age import RESULTS, about
from bench.soak import session

ROOT = Path(__file__).parents[2]
SHIM = Path(__file__).with_name("failing_calls.c")
ERRORS = {
    "open": (EACCES, EMFILE, EIO),
    "write": (ENOSPC, EIO),
    "sync": (EIO, ENOSPC),
    "rename": (EACCES, EBUSY),
}
PRINTED = ("stdout", "stderr")
DURATIONS_MS = (0, 400)  # 0: one call
USB_FAULTS = ("stall", "line-error", "no-answer", "late:0.05", "short:2", "unplug:0.5")
COMPUTER_FAULTS = ("sleep:30", "stop:30", "clock-set:3600")
MOMENTS_S = (0.05, 10.0, 40.0)  # the middle one is between two touches
SIMULATION = "sim:four-specimens?seed=1&idle=3"
LONGEST_S = 120.0  # a session that takes longer hangs
KILLED_AT_ORDERS = (1, 2, 3, 12, 13, 14, 22, 23, 24)  # notes, marks and titles
MARK = "<!-- campaign -->"
END = "<!-- end -->"


@dataclass(frozen=True)
class Trial:
    """A session or a `palpate record`, and what disturbs it."""

    family: str
    is_session: bool = True
    call: str = ""  # as in failing_calls.c: CALL TARGET NUMBER ERRNO MILLISECONDS
    fault: str = ""  # of the simulated board or computer: KIND:AMOUNT@SECONDS
    killed_after_s: float = 0.0
    killed_at_order: int = 0  # as soon as this many orders were answered; the first one is 1

    @property
    def is_killed(self) -> bool:
        """Whether the process is killed."""
        return self.killed_after_s > 0 or self.killed_at_order > 0


@dataclass
class Outcome:
    """What a trial has cost."""

    refused: int = 0  # at the beginning, in words: nothing was measured
    rows_lost: int = 0
    ended: int = 0  # measurements that ended before their source
    touches: int = 0  # that are not those without a fault
    orders_lost: int = 0  # notes, marks and titles that were answered
    unnoticed: int = 0  # a failure of a row or of the sidecar that is not counted
    files_left: int = 0
    unclean: int = 0  # recordings that `check` does not take for complete
    texts: list[str] = field(default_factory=list)

    @property
    def broken(self) -> int:
        """Number of broken promises."""
        lost = self.rows_lost + self.ended + self.touches + self.orders_lost
        return lost + self.unnoticed + self.files_left + self.unclean


@dataclass
class Run:
    """A process that has ended."""

    code: int
    rows: list[str]
    answers: list[Json]
    printed: str
    calls: dict[tuple[str, str], int]

    @property
    def end(self) -> Json:
        """The last answer: the result of the session."""
        return self.answers[-1] if self.answers else {}


class Campaign:
    """Runs trials in a folder, and compares each with a run without faults."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._shim = folder / "failing_calls.so"
        command = ["cc", "-shared", "-fPIC", "-O1", "-o", str(self._shim), str(SHIM), "-ldl"]
        subprocess.run(command, check=True)
        first = self._run("first", Trial("none"), SIMULATION)
        samples = folder / "samples.csv"
        for path in (samples, samples.with_suffix(".json")):
            (folder / "first" / "measured" / f"run{path.suffix}").rename(path)
        self._source = str(samples)
        self.session: Run = self._run("session", Trial("none"), self._source)
        self.printer: Run = self._run("printer", Trial("none", is_session=False), self._source)
        if not first.rows == self.session.rows == self.printer.rows:
            raise RuntimeError("two runs without faults differ")

    def try_one(self, number: int, trial: Trial) -> Outcome:
        """Run a trial; return what it has cost."""
        source = self._source
        if trial.fault:
            source = f"{SIMULATION}&fault={trial.fault}"
        run = self._run(f"trial-{number}", trial, source)
        path = self._folder / f"trial-{number}" / "measured" / "run.csv"
        if trial.is_killed:
            outcome = self._after_kill(path, run)
        elif run.code == 4 and not run.rows:
            outcome = Outcome(refused=1)
        elif trial.fault:
            outcome = self._after_simulated(path, run)
        else:
            outcome = self._after_fault(path, run, trial)
        left = [each.name for each in path.parent.iterdir() if each.name.startswith(".")]
        outcome.files_left = len(left)
        if outcome.broken:
            outcome.texts = [f"{trial}: {run.code} {run.printed[-400:]} {run.end} {left}"]
        return outcome

    def _run(self, name: str, trial: Trial, source: str) -> Run:
        folder = self._folder / name
        measured = folder / "measured"
        measured.mkdir(parents=True)
        counted = folder / "calls"
        environment = {
            **os.environ,
            "PYTHONPATH": f"{ROOT}{os.pathsep}{os.environ.get('PYTHONPATH', '')}",
            "LD_PRELOAD": str(self._shim),
            "COUNTED_CALLS": str(counted),
            "FAILING_CALL": trial.call,
        }
        words = ["palpate", "record", source, "-o", str(measured / "run.csv")]
        if trial.is_session:
            words = ["bench.soak.session", source, str(measured)]
        answers = folder / "answers"
        printed = folder / "printed"
        shell = ["sh", "-c", 'exec "$@" 3>"$0"', str(answers), sys.executable, "-m", *words]
        with printed.open("w") as output:
            process = subprocess.Popen(
                shell, env=environment, stdout=output, stderr=subprocess.STDOUT
            )
            _wait_or_kill(process, trial, answers)
        path = measured / "run.csv"
        lines = path.read_text().split("\n")[1:-1] if path.exists() else []
        calls = dict[tuple[str, str], int]()
        if counted.exists():
            for line in counted.read_text().splitlines():
                call, target, count = line.split()
                calls[call, target] = int(count)
        found = [json.loads(line) for line in answers.read_text().splitlines()]
        return Run(process.returncode, lines, found, printed.read_text(), calls)

    def _after_fault(self, path: Path, run: Run, trial: Trial) -> Outcome:
        clean = self.session if trial.is_session else self.printer
        outcome = Outcome(rows_lost=len(set(clean.rows) - set(run.rows)))
        call = trial.call.split()
        is_printed = call[1] in PRINTED
        allowed = (0, 1, 4) if is_printed else (0,)  # a print that fails is an error at the end
        outcome.ended = int(run.code not in allowed or bool(run.end.get("error")))
        outcome.unclean = int(not _is_clean(path))
        if trial.is_session:
            outcome.touches = int(run.end.get("touches") != clean.end["touches"])
            outcome.orders_lost = _orders_lost(path, run)
            has_struck = run.calls.get((call[0], call[1]), 0) >= int(call[2])
            must_count = call[0] in ("write", "rename") and call[1] in ("run.csv", "run.json")
            outcome.unnoticed = int(has_struck and must_count and not run.end.get("failures"))
        return outcome

    def _after_simulated(self, path: Path, run: Run) -> Outcome:
        """Count touches that are wrong without a flag; what the board never sent is no lost row."""
        outcome = Outcome(rows_lost=int(run.end.get("dropped", 1)))
        outcome.ended = int(run.code != 0 or bool(run.end.get("error")))
        outcome.unclean = int(not _is_clean(path))
        outcome.orders_lost = _orders_lost(path, run)
        expected = self.session.end["touches"]
        found = run.end.get("touches", [])
        outcome.touches = abs(len(found) - len(expected))
        for (_, _, ratio, error, _), (_, _, other, other_error, flags) in zip(
            expected, found, strict=False
        ):
            if not flags and abs(ratio - other) > 4 * (error**2 + other_error**2) ** 0.5:
                outcome.touches += 1
        return outcome

    def _after_kill(self, path: Path, run: Run) -> Outcome:
        write_file(path.with_name("next"), b"")  # the next program that writes in this folder
        if not path.exists():
            return Outcome()
        outcome = Outcome(orders_lost=_orders_lost(path, run))
        report = check(path)
        outcome.unclean = int(bool(check(path, repair=True).faults))
        outcome.rows_lost = int(run.rows != self.session.rows[: len(run.rows)])
        outcome.rows_lost += max(0, len(run.rows) - report.survey.rows)
        return outcome


def _wait_or_kill(process: "subprocess.Popen[bytes]", trial: Trial, answers: Path) -> None:
    """Wait for the end of a process, and kill it at its moment, or if it hangs."""
    until_s = time.monotonic() + (trial.killed_after_s or LONGEST_S)
    while process.poll() is None and time.monotonic() < until_s:
        if trial.killed_at_order and answers.exists():
            if answers.read_bytes().count(b"\n") >= trial.killed_at_order:
                break
        time.sleep(0.001 if trial.killed_at_order else 0.02)
    process.kill()
    process.wait()


def _is_clean(path: Path) -> bool:
    return path.exists() and bool(check(path).clean)


def _orders_lost(path: Path, run: Run) -> int:
    """Return how many orders were answered that the sidecar does not have."""
    answered: list[int] = [entry["order"] for entry in run.answers if "order" in entry]
    found = load_checked(path)
    if found is None:
        return len(answered)
    has = {note.text for note in found.session.notes} | {mark.text for mark in found.marks}
    lost = [number for number in answered if number % 3 != 2 and f"order {number}" not in has]
    titles = [number for number in answered if number % 3 == 2]
    newest = int(found.session.title.rpartition(" ")[2] or -1)
    lost += [number for number in titles if number > newest]
    return len(lost)


def systematic(campaign: Campaign, random: Random) -> list[Trial]:
    """Return a trial for each call at its first, middle and last time, once and for a while; and for each fault of the board or computer."""
    trials = []
    for run, is_session in ((campaign.session, True), (campaign.printer, False)):
        for (call, target), count in run.calls.items():
            if is_session == (target in PRINTED):
                continue
            for number in sorted({1, (count + 1) // 2, count}):
                for ms in DURATIONS_MS:
                    trials.append(_failing(random, call, target, number, ms, is_session))
    for order in KILLED_AT_ORDERS:
        trials.append(Trial("kill", killed_at_order=order))
    for fault in (*USB_FAULTS, *COMPUTER_FAULTS):
        device = "computer" if fault in COMPUTER_FAULTS else "USB"
        for at_s in MOMENTS_S:
            trials.append(Trial(f"{device} {fault.partition(':')[0]}", fault=f"{fault}@{at_s}"))
    return trials


def _failing(
    random: Random, call: str, target: str, number: int, ms: int, is_session: bool
) -> Trial:
    error = random.choice(ERRORS[call])
    if target == "stdout":
        error = random.choice((ENOSPC, EPIPE))
    family = f"{call} {target.rstrip('~')}"
    if target in PRINTED:
        family = f"print to {target}"
    return Trial(family, is_session, f"{call} {target} {number} {error} {ms}")


def endless(campaign: Campaign, random: Random) -> Iterator[Trial]:
    """Yield kills at random moments, and failing calls at random numbers, for random times."""
    calls = [(key, count) for key, count in campaign.session.calls.items()]
    while True:
        yield Trial("kill", killed_after_s=random.uniform(0.5, 4.0))
        yield Trial("kill", killed_at_order=random.randint(1, session.ORDERS))
        (call, target), count = random.choice(calls)
        yield _failing(
            random, call, target, random.randint(1, count), random.randint(0, 1500), True
        )


def run_trials(campaign: Campaign, seconds: float, seed: int) -> dict[str, list[Outcome]]:
    """Run all trials for which there is time, two at a time; return the outcomes by family."""
    random = Random(seed)
    until_s = time.monotonic() + seconds
    listed = systematic(campaign, random)
    random.shuffle(listed)
    listed.insert(1, Trial("kill", killed_at_order=random.choice(KILLED_AT_ORDERS)))
    rest = endless(campaign, random)
    outcomes = dict[str, list[Outcome]]()
    number = 0
    with ThreadPoolExecutor(2) as pool:
        while time.monotonic() < until_s or number == 0:
            batch = [listed.pop(0) if listed else next(rest) for _ in range(2)]
            numbers = range(number, number + len(batch))
            number += len(batch)
            for trial, outcome in zip(
                batch, pool.map(campaign.try_one, numbers, batch), strict=True
            ):
                outcomes.setdefault(trial.family, []).append(outcome)
    return outcomes


def table(figures: dict[str, dict[str, int]]) -> str:
    """Return the figures as a table."""
    titles = (
        "tried | refused at the start | rows lost | measurements ended | other touches "
        "| answered orders lost | not counted, not clean, or a file left"
    )
    lines = [f"| fails | {titles} |", "|---|---|---|---|---|---|---|---|"]
    names = ("tried", "refused", "rows_lost", "ended", "touches", "orders_lost")
    for family in sorted(figures):
        row = figures[family]
        counts = [row[name] for name in names]
        counts.append(row["unnoticed"] + row["unclean"] + row["files_left"])
        cells = " | ".join(map(str, counts))
        lines.append(f"| {family} | {cells} |")
    return "\n".join(lines)


def summed(outcomes: dict[str, list[Outcome]]) -> dict[str, dict[str, int]]:
    """Return the sums of each family."""
    figures = {}
    for family, each in outcomes.items():
        rows = [asdict(outcome) for outcome in each]
        names = [name for name in rows[0] if name != "texts"]
        figures[family] = {"tried": len(rows)} | {
            name: sum(row[name] for row in rows) for name in names
        }
    return figures


def written(page: str, text: str) -> str:
    """Return a page with the text between the marks of the campaign."""
    before, _, rest = page.partition(MARK)
    return f"{before}{MARK}\n{text}\n{END}{rest.partition(END)[2]}"


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the campaign, and print what it found."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--seconds", type=float, default=3600)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--write", action="store_true")
    given = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as folder:
        outcomes = run_trials(Campaign(Path(folder)), given.seconds, given.seed)
    figures = summed(outcomes)
    shown = table(figures)
    print(shown)
    for each in outcomes.values():
        for outcome in each:
            for text in outcome.texts:
                print(text)
    tried = sum(row["tried"] for row in figures.values())
    broken = sum(outcome.broken for each in outcomes.values() for outcome in each)
    print(f"{tried} tried, {broken} promises broken, seed {given.seed}")
    if given.write:
        document = {**about(), "seconds": given.seconds, "seed": given.seed, "figures": figures}
        (RESULTS / "campaign.json").write_text(json.dumps(document, indent=1) + "\n")
        page = ROOT / "SECURITY.md"
        page.write_text(written(page.read_text(encoding="utf-8"), shown), encoding="utf-8")
    sys.exit(int(broken > 0))


if __name__ == "__main__":
    main()
