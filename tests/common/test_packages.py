"""Packages that only some purposes need: each has an extra, and a missing one is told in one line that names it."""

import re
import sys
import tomllib
from pathlib import Path

import click
import pytest
from click.testing import CliRunner

from armlab.cli.main import main
from armlab.common.packages import EXTRA_OF_MODULE, MissingPackageError, import_package, missing_package

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
DISTRIBUTIONS = {"markdown_it": "markdown-it-py", "pinocchio": "pin", "sklearn": "scikit-learn"}  # named otherwise
COME_ALONG = {"zstandard"}  # with a package of the same extra
NO_PURPOSE = {"build", "fuzz", "dev"}
SOURCES = ("problem", "algorithms", "bench", "armlab")


def packages_of(lines):
    return {re.split(r"[\[<>=; ]", line)[0] for line in lines} - {"armlab"}


EXTRAS = {name: packages_of(lines) for name, lines in PROJECT["optional-dependencies"].items()}
PURPOSES = set(EXTRAS) - NO_PURPOSE


def test_each_package_stands_under_the_extra_that_the_message_names():
    wrong = {
        module: extra
        for module, extra in EXTRA_OF_MODULE.items()
        if module not in COME_ALONG and DISTRIBUTIONS.get(module, module) not in EXTRAS[extra]
    }
    assert wrong == {}


def test_each_package_of_an_extra_that_the_code_imports_has_its_message():
    named = {DISTRIBUTIONS.get(module, module) for module in EXTRA_OF_MODULE}
    assert set().union(*(EXTRAS[name] for name in PURPOSES - {"docs"})) - named == set()


def test_every_extra_that_a_message_or_a_page_names_exists():
    texts = [path for folder in SOURCES for path in (ROOT / folder).rglob("*.py")]
    texts += [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md"), *(ROOT / "configs").glob("*.yaml")]
    named = set()
    for path in texts:
        if path.name != "CHANGELOG.md":
            text = path.read_text(encoding="utf-8")
            named |= set(re.findall(r"armlab\[([\w-]+)\]|install_line\(['\"]([\w-]+)['\"]\)", text))
            named |= {(name, "") for name in re.findall(r"extra\s+`([\w-]+)`", text)}
    assert {one or other for one, other in named} - PURPOSES == set()


def test_a_missing_package_is_one_line_with_its_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "rosbags", None)
    with pytest.raises(MissingPackageError) as raised:
        import_package("rosbags", "--mcap")
    assert str(raised.value) == "--mcap needs the package 'rosbags': pip install 'armlab[recordings]'"


def test_an_import_that_fails_for_another_reason_is_not_excused():
    assert missing_package(ModuleNotFoundError(name="bench.nowhere"), "this") is None
    assert missing_package(ValueError("optuna"), "this") is None


def test_a_command_whose_package_is_missing_ends_with_one_line(monkeypatch):
    def fail(**_options):
        raise ModuleNotFoundError("No module named 'optuna'", name="optuna")

    tune = main.get_command(click.Context(main), "bench").get_command(click.Context(main), "tune")
    monkeypatch.setattr(tune, "callback", fail)
    done = CliRunner().invoke(main, ["bench", "tune"])
    assert done.exit_code == 2
    assert done.stderr == "armlab: this command needs the package 'optuna': pip install 'armlab[peers]'\n"
