"""The example notebook: it runs, and each object in it shows itself."""

import asyncio
from pathlib import Path

import nbclient
import nbformat
from project import ROOT

NOTEBOOK = ROOT / "docs" / "examples" / "notebook.ipynb"
HTML = {
    "stream": "Stream of",
    "recording": "<strong>Recording</strong>",
    "touches": "<strong>4 touches</strong>",
    "touches[0]": "<strong>Touch</strong>",
    'palpate.touches(scenarios.run("not-level"))': "hold the probe upright",
    "calibration": "<strong>Calibration</strong>",
    "estimator": "<strong>HandoverRls</strong>",
    "page": "<iframe",
}
"""The last line of a cell, and what is in its HTML."""
MODULI = "[str(calibration.modulus(touch.ratio, touch.standard_error)) for touch in touches]"
DRAWN = ["recording.plot();", "recording[9.5:19.0].plot();", "touches.plot();", "calibration.plot();"]


def test_each_object_shows_itself_and_each_plot_is_a_picture(tmp_path: Path) -> None:
    document = nbformat.read(NOTEBOOK, as_version=4)
    assert not any(cell.get("outputs") for cell in document.cells)
    assert NOTEBOOK.stat().st_size < 20_000
    client = nbclient.NotebookClient(document, timeout=300, resources={"metadata": {"path": str(tmp_path)}})
    with asyncio.Runner() as runner:
        runner.run(client.async_execute())
    outputs = {cell.source.splitlines()[-1]: cell.outputs[-1] for cell in document.cells if cell.get("outputs")}
    for line, part in HTML.items():
        assert part in outputs[line].data["text/html"], line
    for line in DRAWN:
        assert outputs[line].output_type == "display_data"
        assert len(outputs[line].data["image/png"]) > 10_000
    assert outputs[MODULI].data["text/plain"].count("MPa") == 4
