"""`python -m tools.site.notebooks`: runs the notebooks of docs/notebooks/ and keeps their outputs in them.

The site runs them anew when it is built; the kept outputs are for readers of the repository.
"""

import os
import tempfile
from pathlib import Path

import nbformat
from nbclient import NotebookClient

NOTEBOOKS = Path(__file__).parents[2] / "docs" / "notebooks"
TIMEOUT_S = 600  # a cell


def run_notebook(path: Path) -> None:
    """Runs the cells of a notebook in a temporary folder and writes it with what they show."""
    notebook = nbformat.read(path, as_version=4)
    with tempfile.TemporaryDirectory() as folder:
        resources = {"metadata": {"path": folder}}
        NotebookClient(notebook, timeout=TIMEOUT_S, resources=resources, record_timing=False).execute()
    notebook.metadata["language_info"] = {"name": "python"}  # its version changes nothing that is shown
    nbformat.write(notebook, path)


if __name__ == "__main__":
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    for each in sorted(NOTEBOOKS.glob("*.ipynb")):
        print(each.name)
        run_notebook(each)
