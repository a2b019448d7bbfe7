"""The example notebook: it runs, and each object in it shows itself."""

import asyncio
from pathlib import Path
from typing import Any

import nbclient
import nbformat
import pytest
from made_once import made_once
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
DRAWN = ["recording.plot();", "recording[9.5:19.0].plot();", "touches.plot();", "calibration.plot();"]


@pytest.fixture(scope="module")
def outputs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """Return the last output of each cell by the last line of the cell."""
    run = nbformat.read(made_once(tmp_path_factory, "example", run_in) / "notebook.ipynb", as_version=4)
    code = [cell for cell in run.cells if cell.cell_type == "code"]
    return {cell.source.splitlines()[-1]: cell.outputs[-1] for cell in code if cell.outputs}


def run_in(folder: Path) -> None:
    """Run the notebook in a folder, and write it there with its outputs."""
    document = nbformat.read(NOTEBOOK, as_version=4)
    assert not any(cell.get("outputs") for cell in document.cells)
    client = nbclient.NotebookClient(document, timeout=300, resources={"metadata": {"path": str(folder)}})
    with asyncio.Runner() as runner:
        runner.run(client.async_execute())
    nbformat.write(document, folder / "notebook.ipynb")


@pytest.mark.parametrize(("line", "part"), HTML.items())
def test_an_object_shows_itself(outputs: dict[str, Any], line: str, part: str) -> None:
    data = outputs[line].data
    assert part in data["text/html"]
    assert len(data["text/plain"].splitlines()[0]) < 130
    assert "http" not in data["text/html"].replace('xmlns="http://www.w3.org/2000/svg"', "").replace(
        "http://127.0.0.1:", ""
    )


@pytest.mark.parametrize("line", DRAWN)
def test_a_plot_is_a_picture(outputs: dict[str, Any], line: str) -> None:
    assert outputs[line].output_type == "display_data"
    assert len(outputs[line].data["image/png"]) > 10_000


def test_the_moduli_are_those_of_the_specimens(outputs: dict[str, Any]) -> None:
    shown = outputs["[str(calibration.modulus(touch.ratio, touch.standard_error)) for touch in touches]"].data[
        "text/plain"
    ]
    assert shown.count("MPa") == 4
    assert Path(NOTEBOOK).stat().st_size < 20_000
