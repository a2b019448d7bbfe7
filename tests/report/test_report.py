"""The report of real runs: what is in it, that it stands alone, and that it is the same each time."""

import hashlib
import re
import shutil
import subprocess
import sys
from pathlib import Path

import jinja2
import palpate
import pytest
from bs4 import BeautifulSoup
from command_lines import document, run
from faulty_tables import jumped
from palpate import report
from palpate.calibration.specimen_files import write_session
from palpate.display.markup import LEFT_OUT, NONE
from palpate.materials import shore_a_of_modulus
from palpate.recording.session import Entry, Plan
from palpate.report.report_html import _render
from palpate.samples import Status
from palpate.simulation import hand
from project import FOUR, copied, made_once
from report_session import HOSTILE, change, recorded, specimens, with_session


class Page:
    """The sections of a report by their titles: their text, and the rows of their tables and lists."""

    def __init__(self, path: Path) -> None:
        page = BeautifulSoup(path.read_text(encoding="utf-8"), "html.parser")
        every = page.find_all(True)
        self.tags = {tag.name for tag in every}
        self.refers = [
            name
            for tag in every
            for name in tag.attrs
            if re.match(r"on|(src|href|srcset|data|action)$", name)
        ]
        self.text, self.rows, section = {"": ""}, dict[str, list[list[str]]]({"": []}), ""
        for part in page.select("body > *"):
            if part.name == "h2":
                section = part.text
                self.text[section] = ""
                self.rows[section] = []
            self.text[section] += part.get_text(" ")
            self.rows[section] += [[cell.text for cell in row(["td", "th"])] for row in part("tr")]
            self.rows[section] += [
                [name.text, value.text] for name, value in zip(part("dt"), part("dd"), strict=True)
            ]

    def row(self, section: str, first: str) -> list[str]:
        """Return the only row of a section that begins with a text."""
        [found] = [row for row in self.rows[section] if row and row[0] == first]
        return found


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Ten specimens, an eleventh object, their calibration; and a session in one recording."""
    return made_once(tmp_path_factory, "report", recorded)


@pytest.fixture(scope="module")
def ten(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Page:
    """Return the report of all of them."""
    path = tmp_path_factory.mktemp("ten") / "ten.html"
    made = run(
        "report", *specimens(folder), folder / "gel" / "gel.csv", "--moduli", folder / "ten" / "moduli.csv",
        "--calibration", folder / "probe.toml", "-o", path, "--operator", "A. Bee", "--note", "left hand",
    )  # fmt: skip
    assert made.exit_code == 0, made.output
    assert made.stdout.splitlines()[0] == str(path)
    return Page(path)


def test_the_results_are_those_of_replay(folder: Path, ten: Page) -> None:
    replayed = document(
        "replay", folder / "gel" / "gel.csv", "--calibration", folder / "probe.toml"
    )
    value, _, interval = replayed["modulus_of_mean"]["text"].partition(" (")
    row = ten.row("Results", "gel")
    assert row[:3] == ["gel", value.removesuffix(" MPa"), interval.rstrip(")")]
    assert row[8:] == ["4", NONE]
    assert f"gel: {value} (95 %: {interval}" in ten.text[""]
    assert row[5] == palpate.number_format.number(
        replayed["agreement"]["ratio"], replayed["agreement"]["standard_error"]
    )


def test_every_touch_and_every_specimen_is_there(ten: Page) -> None:
    rows = ten.rows["Results"][1:]
    assert [row[4] for row in rows] == ["yes"] * 10 + [""]
    assert ten.row("Results", "30 OO")[3] == "0.143"
    assert "10 of 10 known moduli are in the 95 % interval." in ten.text[""]
    assert "40 of these touches are data of the calibration itself" in ten.text[""]
    numbers = [row[0] for row in ten.rows["Every touch"] if row and row[0].isdigit()]
    assert numbers == [str(number) for number in range(1, 45)]
    reasons = [row[1] for row in ten.rows["Every touch"] if len(row) == 2]
    assert not [reason for reason in reasons if reason.startswith(LEFT_OUT)]
    # One has the flag "offset" because of .2 %, far below the scatter of a hand.
    assert len([reason for reason in reasons if "offset: " in reason]) == 1
    assert "44 of 44 touches are kept" in ten.text[""]
    *parts, whole, of_modulus = map(float, ten.row("Uncertainty, in words", "gel")[1:])
    assert sum(part**2 for part in parts) ** 0.5 == pytest.approx(whole, rel=0.05)
    assert parts[2] == pytest.approx(2.9 / 2, rel=0.05)  # of four touches
    # at a ratio of 4.2, by eq. (2) with 10, 2 MPa and 1
    assert of_modulus == pytest.approx(2.04 * whole, rel=0.1)


def test_repeatability_of_the_session(folder: Path, ten: Page, tmp_path: Path) -> None:
    """The simulated hand scatters by 3 %: with 30 degrees of freedom by 2.2 to 3.8 %, with a probability of 95 %."""
    found = document("report", folder / "session.csv", "-o", tmp_path / "x.html")["repeatability"]
    assert found["icc"] is None  # a touch each
    percent = float(ten.row("Repeatability", "From touch to touch (CV)")[1].partition(" %")[0])
    assert 2.2 < percent < 3.8
    change_, _, told = ten.row("Repeatability", "Minimal detectable change")[1].partition(" %")
    assert float(change_) == pytest.approx(1.96 * 2**0.5 * percent, rel=0.03)
    assert "Means of 4 touches" in told
    icc, _, told = ten.row("Repeatability", "ICC(1,1)")[1].partition(", ")
    assert 0.98 < float(icc) < 1
    assert "random effects: no touch of one specimen belongs to a touch of another" in told


def test_the_calibration_is_shown_with_its_data(
    folder: Path, ten: Page, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In the report of recordings, and in the report of `calibrate`, which needs no matplotlib."""
    assert "Eq. (2)" in ten.text["Calibration"]
    assert "The curve fits. 10 specimens, 40 values." in ten.text["Calibration"]
    found = palpate.Calibration.load(folder / "probe.toml")
    values = [
        value for row in ten.rows["Calibration"] if len(row) == 7 for value in row[6].split(", ")
    ][1:]
    assert sorted(map(float, values)) == pytest.approx(sorted(found.ratios), rel=1e-3)
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    given: list[str | Path] = [
        *specimens(folder),
        "--moduli",
        folder / "ten" / "moduli.csv",
        "-o",
        tmp_path / "p.toml",
    ]
    assert run("calibrate", *given, "--report", tmp_path / "p.html").exit_code == 0
    own = Page(tmp_path / "p.html")
    assert [row[:2] for row in own.rows["Calibration"]] == [
        row[:2] for row in ten.rows["Calibration"]
    ]
    assert ({"svg"} <= own.tags, own.refers) == (True, [])


def test_the_report_of_a_calibration_has_a_head_and_reasons(folder: Path, tmp_path: Path) -> None:
    """Of ten recordings and an oblique one without a session, and of sessions in four recordings."""
    path = tmp_path / "p.html"
    table = folder / "ten" / "moduli.csv"
    words: list[str | Path] = ["--moduli", table, "--ratio", "hold", "--report", path, "-o"]
    oblique = hand.session(5, hand=hand.Hand(oblique=0.0, tilt_deg=0.5), moduli={"40 A": 1.54})
    write_session(tmp_path / "oblique", {"40 A": oblique["40 A"].block()}, {"40 A": 1.54})
    [extra] = (tmp_path / "oblique").glob("40A*.csv")
    extra = copied(tmp_path / "40A-2.csv", extra)
    made = run("calibrate", *specimens(folder), extra, *words, tmp_path / "p.toml")
    assert made.exit_code == 0
    page = Page(path)
    assert page.text[""].strip().startswith("Calibration of a probe")
    assert "Simulated data: no probe was used." in page.text[""]
    assert page.row("", "Recordings")[1] == "11 recordings"
    assert page.row("", "Check")[1] == "complete, clean end"
    left_out = page.rows["Touches that are left out"][1:]
    assert len(left_out) >= 2
    for row in left_out:
        assert row[1:3] == ["40A-2.csv", "40 A"]
        assert re.match("offset: the (hard|soft) bump is reached ", row[3])
    for file in (specimens(folder)[0], table):
        assert page.row("Sources", file.name)[1].split() == [
            "sha256",
            hashlib.sha256(file.read_bytes()).hexdigest(),
        ]
    svg = path.read_text(encoding="utf-8").partition("<svg")[2]
    assert ">Ratio of the capacitance changes</text>" in svg
    assert ">Young&#x27;s modulus, MPa</text>" in svg
    sessions = []
    for file in specimens(folder)[:4]:
        own = copied(tmp_path / file.name, file)
        touches = palpate.touches(palpate.read(own))
        entries = [Entry(touch.start_s, file.stem) for touch in touches]
        entries[1] = Entry(touches[1].start_s, file.stem, "slipped")
        entries[2] = Entry(touches[2].start_s, "unknown")
        plan = Plan("bench 2", "A. Bee", (), tuple(entries))
        change(own, {"session": plan.as_dict()})
        sessions.append(own)
    assert run("calibrate", *sessions, "--force", *words, tmp_path / "s.toml").exit_code in (0, 5)
    page = Page(path)
    assert page.text[""].strip().startswith("Calibration of a probe: bench 2")
    assert page.row("", "Operator")[1] == "A. Bee"
    reasons = [row[3] for row in page.rows["Touches that are left out"][1:]]
    assert reasons.count("slipped") == 4
    assert reasons.count("no modulus of its specimen is known") == 4


def test_sources_settings_and_commands(folder: Path, ten: Page) -> None:
    text = ten.text["Sources, and how to do it again"]
    files = [
        *specimens(folder),
        folder / "gel" / "gel.csv",
        folder / "probe.toml",
        folder / "ten" / "moduli.csv",
    ]
    for file in [*files, folder / "gel" / "gel.json"]:
        assert hashlib.sha256(file.read_bytes()).hexdigest() in text, file.name
    [command] = [line for line in text.splitlines() if line.strip().startswith("palpate report")]
    assert (
        "--calibration probe.toml --moduli moduli.csv --operator 'A. Bee' --note 'left hand'"
        in command
    )
    assert f"palpate {palpate.__version__}" in ten.text["Device and settings"]
    assert "simulated probe" in ten.text["Device and settings"]
    assert "Simulated data: no probe was used." in ten.text[""]
    assert {row[-1] for row in ten.rows["Recordings"][1:]} == {"complete, clean end"}


def test_a_session_is_told(folder: Path, tmp_path: Path) -> None:
    copied(tmp_path / "session.csv", folder / "session.csv")
    shutil.copy(folder / "probe.toml", tmp_path)
    words = ["report", "session.csv", "--calibration", "probe.toml"]
    subprocess.run(
        [sys.executable, "-m", "palpate", *words], cwd=tmp_path, check=True, capture_output=True
    )
    page = Page(tmp_path / "session-report.html")
    made = run(
        "report",
        tmp_path / "session.csv",
        *words[2:3],
        tmp_path / "probe.toml",
        "-o",
        tmp_path / "again.html",
    )
    assert made.exit_code == 0, made.output
    assert (tmp_path / "again.html").read_bytes() == (tmp_path / "session-report.html").read_bytes()
    assert "gel series" in page.text[""]
    assert "operator 2" in page.text[""]
    assert "fingerprint 66 cc 5c 90" in page.text[""]
    assert page.row("Results", "30 OO")[8:] == ["1", "1"]
    assert page.row("Results", "30 OO")[3] == "0.143"
    reasons = [
        row[1] for row in page.rows["Every touch"] if len(row) == 2 and row[1].startswith(LEFT_OUT)
    ]
    assert reasons[0] == f"{LEFT_OUT} left out. discarded"
    marks = [page.row("Every touch", number)[-1] for number in "1234"]
    assert marks == ["", "slipped", "", ""]
    happened = {(row[2], row[3]) for row in page.rows["Recordings"] if len(row) == 4}
    assert {("mark", "slipped"), ("tare", "tare"), ("gap", "unplugged for 2 s"), ("note", "bench 2"), ("note", "bumps wiped")} <= happened  # fmt: skip
    assert "1 touch without a specimen" in page.text["Results"]
    settings = page.rows["Device and settings"]
    assert [
        ["smallest_shift", "1.5"] in settings,
        ["temperature_C", "25.00 to 25.00"] in settings,
    ] == [
        True,
        True,
    ]


def test_the_epoch_of_the_clock_is_the_begin(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    assert run("convert", FOUR, "-o", path).exit_code == 0
    zero = 1_763_733_731_000_000_000  # 2025-11-21 14:02:11 UTC
    change(path, {"clock": {"zero_utc_ns": zero, "zero_monotonic_ns": 0}})
    first_s = float(palpate.read(path).t_hard_s[0])
    report.write_report(tmp_path / "r.html", [path])
    page = Page(tmp_path / "r.html")
    assert f"2025-11-21 14:02:{int(11 + first_s)} UTC" in page.rows["Recordings"][1]


def test_unit_shore_zone_and_heads(folder: Path, tmp_path: Path) -> None:
    """A report in kPa has the digits of one in MPa; the begin is in the zone that the recording says."""
    path = copied(tmp_path / "gel.csv", folder / "gel" / "gel.csv")
    zero = 1_763_733_731_000_000_000 - round(float(palpate.read(path).t_hard_s[0]) * 1e9)
    change(
        path,
        {
            "clock": {"zero_utc_ns": zero, "zero_monotonic_ns": 0},
            "started": "2025-11-21T16:02:11+02:00",
        },
    )
    given: list[str | Path] = [path, "--calibration", folder / "probe.toml"]
    more = ["--unit", "kPa", "--shore", "--probe", "P3", "--site", "Lab 2"]
    for words, name in (([], "a.html"), (more, "b.html")):
        assert run("report", *given, *words, "-o", tmp_path / name).exit_code == 0
    mega = Page(tmp_path / "a.html")
    kilo = Page(tmp_path / "b.html")
    assert "2025-11-21 16:02:11 UTC+02:00" in mega.rows["Recordings"][1]
    value = float(mega.row("Results", "gel")[1])
    row = kilo.row("Results", "gel")
    assert float(row[1]) == pytest.approx(1000 * value, rel=1e-12)
    # of a rounded modulus
    assert float(row[2]) == pytest.approx(shore_a_of_modulus(value), abs=0.6)
    assert kilo.rows["Every touch"][0][2:4] == ["kPa", "Shore A"]
    assert ["Probe", "P3"] in kilo.rows[""]
    assert "palpate report gel.csv --calibration probe.toml --probe P3 --site 'Lab 2' --unit kPa --shore" in kilo.text["Sources, and how to do it again"]  # fmt: skip


def test_rows_without_a_value_are_in_the_head(tmp_path: Path) -> None:
    path = copied(tmp_path / "run.csv", FOUR)
    lines = path.read_text().splitlines()
    lines[100:120] = [line[:-1] + str(int(Status.EXCITATION)) for line in lines[100:120]]
    path.write_text("\n".join(lines) + "\n")
    report.write_report(tmp_path / "r.html", [path])
    page = Page(tmp_path / "r.html")
    assert re.search(r"Of [\d,]+ rows 20 are without a value\.", page.text[""])
    assert page.row("", "Rows")[1].endswith(" 0 missing, 20 without a value")


def test_what_is_judged_is_in_the_head_and_among_the_events(tmp_path: Path) -> None:
    """With its time, and not a second time in the remarks."""
    report.write_report(tmp_path / "r.html", [jumped(tmp_path)])
    page = Page(tmp_path / "r.html")
    text = "the hard channel jumped by +1.1 pF at 19.9 s"
    assert f"jumped.csv: {text}." in page.text[""]
    assert ["jumped.csv", "19.9 s", "judged", text] in page.rows["Recordings"]
    assert page.text["Recordings"].count(text) == 1


def test_hostile_texts_are_only_shown(tmp_path: Path) -> None:
    name = "gel<img src=x onerror=alert(1)>&'-1.csv" if sys.platform != "win32" else "gel&'-1.csv"
    path = with_session(tmp_path / name, odd=HOSTILE)
    options = report.ReportOptions(title=f"T {HOSTILE}", operator=HOSTILE, notes=[HOSTILE])
    made = report.write_report(tmp_path / "r.html", [path], options)
    page = Page(tmp_path / "r.html")
    assert page.tags <= {
        "html", "head", "meta", "title", "style", "body", "h1", "h2", "p", "b", "i", "sub", "div", "dl", "dt", "dd", "table",
        "thead", "tbody", "tr", "th", "td", "span", "svg", "line", "path", "polygon", "circle", "text", "code", "pre", "details", "summary",
    }  # fmt: skip
    assert page.refers == []
    text = (tmp_path / "r.html").read_text(encoding="utf-8")
    assert not re.search(r"url\(|@import|https?:", text.replace("http-equiv", ""))
    assert "default-src 'none'" in text
    assert text.count("<style>") == text.count("</style>") == 1
    assert f"T {HOSTILE}" in page.text[""]
    assert f"slipped{HOSTILE}" in page.text["Every touch"]
    assert made.results["touches"] == 4


def test_a_name_that_the_template_lacks() -> None:
    with pytest.raises(jinja2.UndefinedError, match="has no attribute 'calibration'"):
        _render("title", section="no section", head=report.CalibrationHead())  # type: ignore[arg-type]


def test_exit_codes(folder: Path, tmp_path: Path) -> None:
    one = specimens(folder)[0]
    out = tmp_path / "r.html"
    cases: list[tuple[list[str | Path], int, str]] = [
        ([one, one], 2, "got one twice"),
        ([one, "--calibration", one], 4, "not a calibration"),
        ([tmp_path / "table.csv"], 2, "palpate convert"),
        (
            [folder / "session.csv", tmp_path / "other.csv"],
            4,
            "30 OO: got 0.2 MPa, allowed: 0.143 MPa",
        ),
    ]
    (tmp_path / "table.csv").write_text("a,b,c\n" + "1,2,3\n" * 20)
    other = copied(tmp_path / "other.csv", folder / "session.csv")
    change(other, {"session": {"specimens": [{"name": "30 OO", "modulus_MPa": 0.2}]}})
    for words, code, said in cases:
        result = run("report", *words, "-o", out)
        assert (result.exit_code, said in result.stderr, out.exists()) == (code, True, False), (
            result.stderr
        )
    idle = tmp_path / "idle.csv"
    assert run("record", "sim:four-specimens?speed=1", "-o", idle, "--seconds", "1").exit_code in (
        0,
        5,
    )
    none = run("report", idle, "-o", out)
    assert (none.exit_code, "no touch was found" in none.stderr) == (5, True)
    assert "No touch was found." in out.read_text(encoding="utf-8")
    changed = copied(tmp_path / "changed.csv", one)
    changed.write_bytes(changed.read_bytes().replace(b",0\n", b",1\n", 1))
    doubtful = run("report", changed, "-o", out, "--force")
    assert (doubtful.exit_code, "the rows were changed" in doubtful.stderr) == (5, True)
    assert "Results may be wrong" in out.read_text(encoding="utf-8")


def test_without_a_calibration_there_are_ratios(folder: Path, tmp_path: Path) -> None:
    """Of two recordings of the same name, which are told apart."""
    paths = [
        copied(tmp_path / day / "gel.csv", folder / "gel" / "gel.csv")
        for day in ("monday", "tuesday")
    ]
    report.write_report(tmp_path / "r.html", paths)
    page = Page(tmp_path / "r.html")
    assert "Calibration" not in page.text
    assert page.rows["Results"][0] == [
        "Specimen",
        "Ratio",
        "± (k = 1)",
        "CV, %",
        "Kept",
        "Left out",
    ]
    assert page.row("Results", "gel")[4] == "8"
    assert all(path.as_posix() in page.text["Recordings"] for path in paths)
    assert "No calibration was given" in page.text[""]
    assert (
        "% a touch, by the repeated touches of this session:" in page.text["Uncertainty, in words"]
    )


def test_touches_that_differ_have_no_mean(folder: Path, tmp_path: Path) -> None:
    report.write_report(tmp_path / "r.html", [FOUR], report.ReportOptions(folder / "probe.toml"))
    page = Page(tmp_path / "r.html")
    cells = page.row("Results", "four-specimens")[1:6]
    assert cells[:4] == [NONE] * 4
    assert "four-specimens: the 4 touches differ" in page.text["Results"]
