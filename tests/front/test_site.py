"""The documentation site is built without a warning, and its generated pages say what the code says."""

import json
import re
import subprocess
import sys
from pathlib import Path

import click
import pytest

from armlab.cli.main import main
from armlab.effects.example import HIDDEN
from armlab.effects.library import BUILT_IN, WITHOUT_FAMILY
from tools.site.formats import format_pages
from tools.site.gallery import EXAMPLES

ROOT = Path(__file__).parents[2]
FACTS = [*(family.facts for family in BUILT_IN), *WITHOUT_FAMILY.values()]


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    pytest.importorskip("pydata_sphinx_theme", reason="needs the extra docs")
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "tools.site", str(folder / "site"), "--source", str(folder / "source")]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-3000:]
    return folder / "site"


def test_each_effect_has_a_page_with_its_law_and_its_picture(site):
    for effect in (each for each in FACTS if each.id != "unknown"):
        page = (site / "gallery" / f"{effect.id}.html").read_text(encoding="utf-8")
        assert "<math" in page
        assert effect.experiment[1:] in page.replace("’", "'")
        assert (f"{effect.id}.svg" in page) == (effect.id in EXAMPLES)


def test_each_command_has_a_page_with_all_its_options(site):
    context = click.Context(main)
    for name in main.list_commands(context):
        page = (site / "reference" / "commands" / f"{name}.html").read_text(encoding="utf-8")
        for option in main.get_command(context, name).params:
            assert isinstance(option, click.Argument) or option.opts[-1] in page


def test_no_page_leads_to_a_page_that_does_not_exist(site):
    for page in set(site.rglob("*.html")) - set((site / "_static").rglob("*")):
        links = re.findall(r'href="(?!https?:|#|mailto:)([^"#?]+)', page.read_text(encoding="utf-8"))
        assert [link for link in links if not (page.parent / link).exists()] == [], page.name


NOTEBOOKS = sorted((ROOT / "docs" / "notebooks").glob("*.ipynb"))


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_each_cell_of_a_notebook_is_run_at_the_build_and_shows_something(path, site):
    cells = [cell for cell in json.loads(path.read_text(encoding="utf-8"))["cells"] if cell["cell_type"] == "code"]
    page = (site / "notebooks" / f"{path.stem}.html").read_text(encoding="utf-8")
    silent = [cell for cell in cells if cell["source"][-1].startswith("check_algorithm(")]
    assert page.count('class="cell_output') == len(cells) - len(silent)


def test_the_notebook_of_a_diagnosis_shows_what_the_log_hides(site):
    page = (site / "notebooks" / "diagnosis.html").read_text(encoding="utf-8")
    verdict = next(table for table in _tables(page) if "<th>equation</th>" in table)
    assert set(re.findall(r"<td>([a-z_]+)</td>", verdict)) == {effect for effect, _, _ in HIDDEN}


def test_the_notebook_of_a_comparison_shows_its_experiment_as_a_table(site):
    page = (site / "notebooks" / "comparison.html").read_text(encoding="utf-8")
    assert "Experiment mine" in page
    assert {"spso", "l-shade", "random-search"} <= set(re.findall(r"<td>([a-z-]+)</td>", _tables(page)[0]))


def _tables(page):
    return re.findall(r"<table.*?</table>", page, re.DOTALL)


def test_each_key_of_a_configuration_has_a_meaning():
    page = format_pages()["reference/configuration.md"]
    rows = re.findall(r"^\| `(\w+)` \|(.*)\|$", page, re.MULTILINE)
    assert len(rows) > 60
    assert {key for key, cells in rows if not cells.rsplit("|", 1)[-1].strip() or cells.count("|") < 2} == set()


def test_each_effect_has_a_law_and_an_example():
    assert [each.id for each in FACTS if not each.law and each.id != "unknown"] == []
    assert set(EXAMPLES) == {family.effect for family in BUILT_IN}
