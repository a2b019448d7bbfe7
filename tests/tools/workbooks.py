"""Workbooks by hand: what no program that writes .xlsx would write."""

import io
import zipfile
from collections.abc import Mapping
from pathlib import Path

_TYPE = "http://schemas.openxmlformats.org/officeDocument/2006/relationships"
_RELATIONS = '<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">{}</Relationships>'
_RELATION = '<Relationship Id="{}" Type="' + _TYPE + '/{}" Target="{}"/>'
_MAIN = 'xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main"'
_CONTENT = "application/vnd.openxmlformats-officedocument.spreadsheetml.{}+xml"
_KINDS = (
    '<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">'
    f'<Override PartName="/xl/workbook.xml" ContentType="{_CONTENT.format("sheet.main")}"/>{{}}</Types>'
)
_STRINGS = f'<Override PartName="/xl/sharedStrings.xml" ContentType="{_CONTENT.format("sharedStrings")}"/>'
_SHEET = f"<worksheet {_MAIN}><sheetData>{{}}</sheetData></worksheet>"

STYLES = """<styleSheet><numFmts><numFmt numFmtId="164" formatCode="[h]:mm:ss.000"/>
<numFmt numFmtId="165" formatCode="0.00&quot; days&quot;"/></numFmts>
<cellXfs><xf/><xf numFmtId="22"/><xf numFmtId="164"/><xf numFmtId="165"/><xf numFmtId="10"/></cellXfs></styleSheet>"""
"""Styles of cells: number, date and time, hours, days in words, percent."""


def by_hand(folder: Path, data: bytes) -> Path:
    """Write a workbook to a file."""
    path = folder / "hand.xlsx"
    path.write_bytes(data)
    return path


def workbook(
    rows: str, more: Mapping[str, str] | None = None, properties: str = "", method: int = zipfile.ZIP_DEFLATED
) -> bytes:
    """Return a workbook with one sheet of these rows (XML), and other parts by name in the folder xl."""
    more = dict(more or {})
    kinds = {"styles.xml": "styles", "sharedStrings.xml": "sharedStrings"}
    parts = _RELATION.format("r1", "worksheet", "worksheets/sheet1.xml")
    parts += "".join(_RELATION.format(name, kinds[name], name) for name in more if name in kinds)
    files = {
        "[Content_Types].xml": _KINDS.format(_STRINGS if "sharedStrings.xml" in more else ""),
        "_rels/.rels": _RELATIONS.format(_RELATION.format("r1", "officeDocument", "xl/workbook.xml")),
        "xl/workbook.xml": f'<workbook {_MAIN} xmlns:r="{_TYPE}">{properties}<sheets><sheet name="A" sheetId="1" r:id="r1"/></sheets></workbook>',
        "xl/_rels/workbook.xml.rels": _RELATIONS.format(parts),
        "xl/worksheets/sheet1.xml": _SHEET.format(rows),
    } | {f"xl/{name}": text.replace("<sst>", f"<sst {_MAIN}>") for name, text in more.items()}
    return zipped(files, method)


def zipped(files: Mapping[str, str], method: int = zipfile.ZIP_DEFLATED) -> bytes:
    """Return a zip file."""
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", method) as file:
        for name, text in files.items():
            file.writestr(name, text)
    return packed.getvalue()


def row(number: int, *values: str) -> str:
    """Return a row of numbers."""
    cells = "".join(f'<c r="{chr(65 + i)}{number}"><v>{value}</v></c>' for i, value in enumerate(values))
    return f'<row r="{number}">{cells}</row>'


def words(number: int, *values: str) -> str:
    """Return a row of texts."""
    cells = "".join(
        f'<c r="{chr(65 + i)}{number}" t="inlineStr"><is><t>{value}</t></is></c>' for i, value in enumerate(values)
    )
    return f'<row r="{number}">{cells}</row>'
