"""Plug-ins that raise, hang, end their process or print trouble only who names them."""

import contextlib
import importlib
import os
import subprocess
import sys
from importlib.metadata import EntryPoint
from pathlib import Path

import numpy as np
import pytest
import yaml

from armlab.common import plug_ins
from armlab.common.plug_ins import BrokenPlugInError, load_plug_in

ROOT = Path(__file__).parents[2]
EXPERIMENT = {"name": "mine", "swarm_size": 5, "evaluations": 20, "repetitions": 1, "seed": 1}
ALGORITHM = """
from algorithms.random_search import RandomSearch

class Hostile(RandomSearch):
    name = "hostile-algorithm"
"""
PROBLEM = """
from typing import Literal

from armlab.common.settings import Settings
from problem.presets import FunctionSettings

class Problem:
    def __init__(self):
        self.inner = FunctionSettings(preset="sphere").build()

    def __getattr__(self, name):
        return getattr(self.inner, name)

    def evaluate(self, points):
        {evaluate}
        return self.inner.evaluate(points)

class Hostile(Settings):
    preset: Literal["hostile-problem"] = "hostile-problem"

    def build(self):
        {build}
        return Problem()
"""
EFFECT = """
from dataclasses import dataclass, replace

from armlab.effects.friction import COULOMB_FACTS, COULOMB_FRICTION, CoulombFriction

@dataclass(frozen=True)
class Law(CoulombFriction):
    facts = replace(COULOMB_FACTS, id="hostile_effect")

    def columns(self, scene):
        {columns}
        return super().columns(scene)

HOSTILE = type(COULOMB_FRICTION)(Law.facts, (Law,))
"""


@pytest.fixture
def site(tmp_path, monkeypatch):
    """Installs modules with their entry points, `GROUP: text of the module`, first on the path."""
    folder = tmp_path / "site"
    information = folder / "hostile-1.0.dist-info"
    information.mkdir(parents=True)
    (information / "METADATA").write_text("Metadata-Version: 2.1\nName: hostile\nVersion: 1.0\n")
    monkeypatch.setenv("PYTHONPATH", f"{ROOT}{os.pathsep}{folder}")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    names = {"algorithms": "Hostile", "problems": "Hostile", "effects": "HOSTILE"}

    def install(**texts):
        lines = []
        for group, text in texts.items():
            (folder / f"hostile_{group}.py").write_text(text)
            lines += [f"[armlab.{group}]", f"hostile-{group.removesuffix('s')} = hostile_{group}:{names[group]}"]
        (information / "entry_points.txt").write_text("\n".join(lines))

    return install


@pytest.fixture
def armlab(tmp_path):
    """Runs a command in an empty folder."""
    folder = tmp_path / "work"
    folder.mkdir()

    def run(*arguments):
        command = [sys.executable, "-m", "armlab.cli.main", *map(str, arguments)]
        return subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=300, check=False)

    return run


def experiment(tmp_path, **more):
    path = tmp_path / "mine.yaml"
    path.write_text(yaml.safe_dump(EXPERIMENT | {"problem": "sphere", "algorithms": ["de"]} | more))
    return path


@pytest.mark.parametrize(
    "command", [["run", "mine.yaml"], ["check", "de"], ["model", "base-parameters", "irb120-arm"], ["tools", "tuning"]]
)
def test_a_command_that_names_no_plug_in_imports_none(command, site, armlab, tmp_path):
    imported = tmp_path / "imported"
    text = f"open({str(imported)!r}, 'w').close(); import os; os._exit(7)"
    site(algorithms=text, problems=text, effects=text)
    experiment(tmp_path)
    done = armlab(*(str(tmp_path / word) if word.endswith(".yaml") else word for word in command))
    assert (done.returncode, done.stderr) == (0, "")
    assert not imported.exists()


@pytest.mark.parametrize(
    ("named", "texts", "line"),
    [
        (
            {"algorithms": ["hostile-algorithm", "de"]},
            {"algorithms": "import os; os._exit(0)"},
            "algorithm 'hostile-algorithm' (hostile_algorithms:Hostile) cannot be imported: its import ends",
        ),
        (
            {"problem": "hostile-problem"},
            {"problems": "raise KeyboardInterrupt"},
            "problem 'hostile-problem' (hostile_problems:Hostile) cannot be imported: KeyboardInterrupt",
        ),
        (
            {"problem": "hostile-problem"},
            {"problems": PROBLEM.format(build="raise SystemExit(0)", evaluate="pass")},
            "the plug-in of problem 'hostile-problem' (hostile_problems:Hostile) fails in hostile_problems.py:",
        ),
    ],
)
def test_a_command_that_names_a_plug_in_says_in_one_line_why_it_cannot_be_used(
    named, texts, line, site, armlab, tmp_path
):
    site(**texts)
    done = armlab("run", experiment(tmp_path, **named))
    assert done.returncode in (1, 2)
    assert len(done.stderr.splitlines()) == 1
    assert line in done.stderr
    assert done.stdout == ""


def test_a_problem_that_ends_its_process_fails_with_its_trials_alone(site, armlab, tmp_path):
    site(problems=PROBLEM.format(build="pass", evaluate="__import__('os')._exit(0)"))
    done = armlab("run", experiment(tmp_path, problem=["hostile-problem", "sphere"]), "--workers", "1")
    assert done.returncode == 1
    assert "1 trial failed" in done.stderr
    assert "hostile-problem" in done.stderr


@pytest.mark.parametrize(
    ("statement", "reason"),
    [
        ("raise RuntimeError('no\\nlicence')", "RuntimeError: no licence"),
        ("raise SystemExit(3)", "it ends the program (sys.exit): 3"),
        ("raise KeyboardInterrupt", "KeyboardInterrupt"),
        ("import os; os._exit(0)", "its import ends the process (status 0)"),
        ("import os; os.abort()", "its import ends the process (signal 6)"),
        ("while True: pass", "its import takes longer than 2 s"),
    ],
)
def test_an_import_that_fails_is_told_in_one_line(statement, reason, tmp_path, monkeypatch):
    monkeypatch.setattr(plug_ins, "IMPORT_LIMIT_S", 2.0)
    with pytest.raises(BrokenPlugInError) as told:
        load_plug_in(entry_of(statement, tmp_path, monkeypatch))
    assert str(told.value) == reason


def test_an_import_leaves_nothing_behind(tmp_path, monkeypatch, capfd):
    statement = (
        "import os, sys, warnings, numpy; print('x'); print('x', file=sys.stderr); warnings.warn('x'); os.chdir('/')\n"
        "os.environ['HOSTILE'] = '1'; numpy.seterr(all='raise'); warnings.simplefilter('ignore')"
    )
    errors, folder = np.geterr(), Path.cwd()
    entry = entry_of(f"{statement}\nX = 3", tmp_path, monkeypatch)
    variables = dict(os.environ)
    assert load_plug_in(entry) == 3
    assert (np.geterr(), dict(os.environ), Path.cwd()) == (errors, variables, folder)
    assert capfd.readouterr() == ("", "")


def test_an_import_is_tried_again_only_where_the_files_have_changed_or_it_failed(tmp_path, monkeypatch):
    notes = tmp_path / "notes"
    note = f"open({str(notes)!r}, 'a').write('x')"

    def imports(text):
        entry = entry_of(f"{note}\n{text}", tmp_path, monkeypatch)
        notes.write_text("")
        with contextlib.suppress(BrokenPlugInError):
            load_plug_in(entry)
        return len(notes.read_text())

    assert [imports("X = 1"), imports("X = 1"), imports("X = 1  # new")] == [2, 1, 2]
    assert [imports("import os; os._exit(1)"), imports("import os; os._exit(1)")] == [1, 1]
    assert [imports("raise ValueError"), imports("raise ValueError")] == [1, 1]
    (tmp_path / "cache" / "armlab" / "plug-ins.json").write_text("{}")
    assert imports("X = 1") == 2


def entry_of(text, tmp_path, monkeypatch):
    """The entry point of a module with this text; what is known of an earlier one with the same text stays on disk."""
    site = tmp_path / "own"
    site.mkdir(exist_ok=True)
    module = site / "hostile_module.py"
    if not module.exists() or module.read_text() != text:
        module.write_text(text)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setattr(sys, "path", [str(site), *(each for each in sys.path if each != str(site))])
    monkeypatch.delitem(sys.modules, "hostile_module", raising=False)
    importlib.invalidate_caches()
    plug_ins._try_import.cache_clear()
    return EntryPoint("hostile", "hostile_module:X", "armlab.effects")


def test_an_effect_that_cannot_be_imported_is_left_out_of_a_diagnosis_in_one_line(
    site, armlab, recording_folder, tmp_path
):
    site(effects="print('hello'); import os; os._exit(0)")
    recording_folder(tmp_path / "rec")
    done = armlab("diagnose", tmp_path / "rec", "--out", "out")
    assert done.returncode == 0
    (line,) = done.stderr.splitlines()
    assert line.startswith("armlab: effect 'hostile-effect' (hostile_effects:HOSTILE) cannot be imported: its import")
    assert line.endswith("; left out")
    assert "hello" not in done.stdout


@pytest.mark.parametrize("columns", ["raise RuntimeError('no licence')", "scene.motion.velocity[:] = 0"])
def test_an_effect_that_fails_or_writes_into_a_scene_ends_a_diagnosis_in_one_line(
    columns, site, armlab, recording_folder, tmp_path
):
    site(effects=EFFECT.format(columns=columns))
    recording_folder(tmp_path / "rec")
    done = armlab("diagnose", tmp_path / "rec", "--out", "out")
    assert (done.returncode, done.stdout) == (1, "")
    (line,) = done.stderr.splitlines()
    assert "the plug-in of effect 'hostile-effect' (hostile_effects:HOSTILE) fails in hostile_effects.py:" in line
    assert not (tmp_path / "work" / "out").exists()
