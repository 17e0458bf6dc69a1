"""The notebook runs from top to bottom, and shows what it showed when it was saved."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

NOTEBOOK = Path(__file__).parents[2] / "notebooks" / "comparison.ipynb"


@pytest.fixture(scope="module")
def cells() -> list[dict[str, Any]]:
    cells: list[dict[str, Any]] = json.loads(NOTEBOOK.read_text(encoding="utf-8"))["cells"]
    return [cell for cell in cells if cell["cell_type"] == "code"]


def test_every_cell_was_run_in_order_and_none_failed(cells: list[dict[str, Any]]) -> None:
    assert [cell["execution_count"] for cell in cells] == list(range(1, len(cells) + 1))
    assert not [output for cell in cells for output in cell["outputs"] if output["output_type"] == "error"]


def test_its_code_runs_and_finds_the_same_table(cells: list[dict[str, Any]], tmp_path: Path) -> None:
    script = "\n\n".join("".join(cell["source"]) for cell in cells)
    table = next(cell for cell in cells if "summary_table(frame)" in "".join(cell["source"]))
    shown = "".join(table["outputs"][0]["data"]["text/plain"])
    expression = "".join(table["source"]).strip().splitlines()[-1]
    as_saved = "pd.set_option('display.width', 80, 'display.max_columns', 20)"
    ending = f"{as_saved}\nprint('table:')\nprint({expression})\n"
    (tmp_path / "notebook.py").write_text(f"{script}\n\n{ending}", encoding="utf-8")
    environment = {**os.environ, "MPLBACKEND": "Agg", "OPENBLAS_NUM_THREADS": "1", "TMPDIR": str(tmp_path)}
    command = [sys.executable, "notebook.py"]
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.split("table:\n")[1].strip() == shown.strip()
