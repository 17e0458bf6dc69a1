"""The documents name files, commands and links that exist, and the examples of the README run."""

import ast
import json
import re
import sys
import tempfile
from pathlib import Path

import click
import pytest
import yaml

from armlab.cli.main import main
from tools.site.examples import read_steps, run_step

ROOT = Path(__file__).parents[2]
DOCUMENTS = [
    ROOT / "README.md",
    ROOT / "CONTRIBUTING.md",
    ROOT / "docs" / "architecture.md",
    ROOT / "docs" / "plugins.md",
    ROOT / "docs" / "running.md",
    ROOT / "results" / "README.md",
]
WITH_EXAMPLES = [ROOT / "docs" / name for name in ("tutorials/csv.md", "tutorials/algorithm.md", "python.md")]
GENERATED = re.compile(r"(?:\.\./)?(?:gallery|reference)/")  # pages of the site that come from the code
PAGES = [*(ROOT / "docs").glob("*.md"), *(ROOT / "docs").glob("tutorials/*.md")]
FOLDERS = "problem|algorithms|bench|armlab|tests|docs|configs|results|templates"


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: path.name)
def test_every_file_that_a_document_names_exists(path):
    named = re.findall(rf"`((?:{FOLDERS})/[\w./-]*)`", path.read_text(encoding="utf-8"))
    assert named
    assert [name for name in named if not (ROOT / name).exists()] == []


@pytest.mark.parametrize("path", [*DOCUMENTS, *PAGES], ids=lambda path: path.name)
def test_every_link_between_documents_leads_somewhere(path):
    links = re.findall(r"\]\(([^)#:]+)\)", path.read_text(encoding="utf-8"))
    assert [link for link in links if not GENERATED.match(link) and not (path.parent / link).exists()] == []


def test_every_module_that_a_flow_names_is_in_the_layers_picture():
    text = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    picture = text.split("```mermaid")[1].split("```")[0]
    packages = {name.replace("/", ".") for name in re.findall(r"`((?:armlab/)?\w+)/[\w/]+\.py`", text)}
    assert {name for name in packages if name not in picture} == set()


def pictured_layers():
    """Packages of the picture, and for each the packages that a path of arrows leads to."""
    text = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    picture = text.split("```mermaid")[1].split("```")[0]
    package = {node: label.split("<br/>")[0] for node, label in re.findall(r'(\w+)\["([^"]*)"\]', picture)}
    arrows = re.findall(r'(\w+)(?:\["[^"]*"\])? --> (\w+)', picture)
    below = {name: {package[end] for start, end in arrows if package[start] == name} for name in package.values()}
    for _ in below:
        below = {name: found.union(*(below[other] for other in found)) for name, found in below.items()}
    return below


def test_the_layers_picture_allows_every_import():
    below = pictured_layers()
    packages = sorted((name for name in below if not name.startswith("users")), key=len, reverse=True)

    def package_of(module):
        if module in ("armlab", "armlab.experiments", "armlab.flows") or module.startswith("armlab.schemas"):
            return "armlab"
        return next((name for name in packages if name != "armlab" and f"{module}.".startswith(f"{name}.")), None)

    crossing = set()
    for folder in ("problem", "algorithms", "bench", "armlab"):
        for path in (ROOT / folder).rglob("*.py"):
            module = ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                if isinstance(node, ast.ImportFrom) and node.module and package_of(node.module):
                    crossing.add((package_of(module), package_of(node.module)))
    assert len(crossing) > 20
    assert {(upper, lower) for upper, lower in crossing if upper != lower and lower not in below[upper]} == set()


def test_commands_of_the_documents_exist():
    """A word after `armlab` is a command of the first screen; after a noun, a command of that noun."""
    text = "\n".join(path.read_text(encoding="utf-8") for path in [*DOCUMENTS[:2], *PAGES])
    blocks = re.findall(r"^```([^\n]*)\n(.*?)^```$", text, re.DOTALL | re.MULTILINE)
    commands = "\n".join(block for language, block in blocks if language in ("", "bash"))
    noun = "|".join(name for name, place in main.places.items() if not place)
    command = rf"armlab (?:({noun}) )?([a-z][a-z0-9-]*)"
    named = {*re.findall(f"^{command}", commands, re.MULTILINE), *re.findall(f"(?:^ {{4}}|`){command}", text, re.M)}
    assert len(named) > 40
    known = {(group, name) for group in ("", *noun.split("|")) for name in commands_of(group)}
    assert named - known == set()


def commands_of(noun):
    table = main.get_command(click.Context(main), noun) if noun else main
    return table.places


def test_make_targets_of_the_readme_exist():
    targets = set(re.findall(r"^([a-z0-9-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE))
    for path in (ROOT / "README.md", ROOT / "CONTRIBUTING.md", *PAGES):
        assert set(re.findall(r"(?:^|`)make ([a-z0-9-]+)", path.read_text(encoding="utf-8"), re.MULTILINE)) <= targets


NOTEBOOKS = sorted((ROOT / "docs" / "notebooks").glob("*.ipynb"))
MAX_NOTEBOOK_BYTES = 400_000


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_keeps_what_its_cells_showed_in_a_small_file(path):
    text = path.read_text(encoding="utf-8")
    cells = [cell for cell in json.loads(text)["cells"] if cell["cell_type"] == "code"]
    assert [cell["execution_count"] for cell in cells] == list(range(1, len(cells) + 1))
    silent = [cell for cell in cells if not cell["outputs"]]
    assert all(cell["source"][-1].startswith("check_algorithm(") for cell in silent)
    kinds = {output["output_type"] for cell in cells for output in cell["outputs"]}
    assert kinds <= {"execute_result", "display_data"}  # no error, no warning
    assert len(text) < MAX_NOTEBOOK_BYTES
    assert tempfile.gettempdir() not in text


def test_what_the_readme_quotes_about_the_paper_stands_in_the_results():
    quoted = re.findall(r'Measured here: "(.*)"', (ROOT / "README.md").read_text(encoding="utf-8"))
    assert len(quoted) == 1
    assert quoted[0] in (ROOT / "results" / "paper" / "replication.md").read_text(encoding="utf-8")


def test_the_installation_of_a_diagnosis_is_small():
    page = (ROOT / "docs" / "installation.md").read_text(encoding="utf-8")
    rows = dict(re.findall(r"^\| `([\w,]+)` \| \d+ \| (\d+) \|", page, re.MULTILINE))
    assert {"diagnose", "harness", "motion"} <= set(rows)
    assert int(rows["diagnose"]) <= 450  # MB


def test_the_examples_of_readme_tutorials_and_python_run(tmp_path, monkeypatch):
    """All in one folder; a command that another document has, too, is run once."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))
    steps = dict.fromkeys(step for path in (*WITH_EXAMPLES, ROOT / "README.md") for step in read_steps(path))
    assert {step.kind for step in steps} == {"file", "command", "script"}
    printed = {step.text: run_step(step) for step in steps}
    verdict = json.loads(Path("verdict/verdict.json").read_text(encoding="utf-8"))
    hidden = yaml.safe_load(Path("log/hidden.yaml").read_text(encoding="utf-8"))
    found = {(each["effect"], each["joint"]) for each in verdict["findings"]}
    assert found == {(each["effect"], each["joints"][0]) for each in hidden}
    assert "shrinking-search keeps its promises" in printed["armlab check shrinking-search"]
    assert Path("corrected.xml").is_file()
    assert Path("figures/comparison_ends.svg").is_file()
    assert any(text.endswith("True\n") for text in printed.values())  # what was read is what was found
