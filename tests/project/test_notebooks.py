"""Notebooks run as written, on a few metres of track, in a kernel of their own."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[2] / "docs" / "notebooks"
SHORTER = {
    "first_look": {"distance = 20.0": "distance = 6.0"},
    "small_study": {"distance, seeds = 20.0, 8": "distance, seeds = 3.0, 2"},
    "data_set": {"distance, seeds = 40.0, 10": "distance, seeds = 6.0, 6"},
}


@pytest.mark.parametrize("path", sorted(FOLDER.glob("*.py")), ids=lambda path: path.stem)
@pytest.mark.filterwarnings("ignore")  # those of the kernel's own packages
def test_notebook(path, tmp_path, monkeypatch):
    """Every cell, with its figures as pictures."""
    jupytext, nbclient = pytest.importorskip("jupytext"), pytest.importorskip("nbclient")
    pytest.importorskip("ipykernel")
    text = path.read_text(encoding="utf-8")
    for long, short in SHORTER[path.stem].items():
        assert long in text
        text = text.replace(long, short)
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(FOLDER.parents[1]), os.environ.get("PYTHONPATH", "")]))
    notebook = jupytext.reads(text, fmt="py:percent")
    nbclient.NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(tmp_path)}}).execute()
    outputs = [output.get("data", {}) for cell in notebook.cells for output in cell.get("outputs", [])]
    assert sum("image/png" in data for data in outputs) == {"first_look": 2, "small_study": 2, "data_set": 0}[path.stem]
    if path.stem == "first_look":
        assert any("train.distance" in data.get("text/html", "") for data in outputs)
        assert any("<progress" in data.get("text/html", "") for data in outputs)
