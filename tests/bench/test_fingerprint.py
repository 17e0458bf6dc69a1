"""The fingerprint of code changes with whatever can change an outcome, and with nothing else."""

import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Mapping
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any

import pytest

import bench.fingerprint
from algorithms.registry import load
from bench.fingerprint import fingerprint
from problem.registry import parse_problem

ROOT = Path(__file__).parents[2]
SPHERE = {"preset": "sphere", "dimension": 3}
ARM = {"preset": "paper"}
SUITE = {"preset": "suite-1/irb120-joint-h5-t10-origin"}

Edit = Callable[[str], str]


def _print(algorithm: str, problem: Mapping[str, Any]) -> str:
    return fingerprint(load(algorithm), parse_problem(problem, "test"))


@pytest.fixture
def tree(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy of the project's code, which the fingerprint reads in place of the code that runs."""
    for package in ("problem", "algorithms", "bench", "armlab"):
        shutil.copytree(ROOT / package, tmp_path / package, ignore=shutil.ignore_patterns("__pycache__"))
    find = bench.fingerprint._module_file

    def find_copy(name: str) -> Path | None:
        stem = tmp_path / name.replace(".", "/")
        places = (stem.with_suffix(".py"), stem / "__init__.py", stem.with_suffix(".abi3.so"))
        return next((place for place in places if place.is_file()), None) if stem.parent.is_dir() else find(name)

    ours = bench.fingerprint._OUR_PACKAGES
    monkeypatch.setattr(
        "bench.fingerprint._module_file",
        lambda name: find_copy(name) if name.partition(".")[0] in ours else find(name),
    )
    monkeypatch.setattr("bench.fingerprint.BUILT_IN_FOLDER", tmp_path / "problem" / "robots")
    return tmp_path


def _edit(path: Path, old: str, new: str) -> None:
    text = path.read_text()
    assert old in text, f"{path} has no {old!r}"
    path.write_text(text.replace(old, new))
    state = path.stat()
    os.utime(path, ns=(state.st_atime_ns, state.st_mtime_ns + 1))  # two edits may come within one tick of its clock


def test_the_copy_is_read_as_the_code_that_runs(tmp_path: Path, request: pytest.FixtureRequest) -> None:
    before = [_print("mupso", ARM), _print("cma-es", SPHERE)]
    request.getfixturevalue("tree")
    assert [_print("mupso", ARM), _print("cma-es", SPHERE)] == before


@pytest.mark.parametrize(
    ("file", "old", "new"),
    [
        ("algorithms/de.py", "import numpy as np\n", "import numpy as np  # arrays\n\n\n"),
        ("algorithms/de.py", '"""Differential evolution', '"""The differential evolution'),
        ("algorithms/contract.py", '        """Learn the fitness', '        """Take the fitness'),
        ("bench/execute.py", '"""One trial:', '"""A trial:'),
        ("problem/kernel.py", "from typing import Any\n", "from typing import (\n    Any,\n)\n"),
    ],
    ids=["comment", "docstring of a module", "docstring of a method", "docstring of the execution", "layout"],
)
def test_a_comment_a_docstring_or_a_layout_changes_nothing(tree: Path, file: str, old: str, new: str) -> None:
    before = _print("de", ARM)
    _edit(tree / file, old, new)
    assert _print("de", ARM) == before


@pytest.mark.parametrize(
    ("file", "old", "new"),
    [
        ("algorithms/woa.py", "import numpy as np", "import numpy as np\nFACTOR = 2"),
        ("algorithms/registry.py", '"woa": "algorithms.woa:WOA",', '"woa": "algorithms.other:Other",'),
        ("problem/registry.py", '"paper": PaperSettings,', '"paper": PaperSettings,\n        "same": PaperSettings,'),
        ("problem/gradient.py", "import numpy as np", "import numpy as np\nFACTOR = 2"),
        ("problem/robots/emps.yaml", "name:", "comment:"),
        ("bench/tables.py", "import numpy as np", "import numpy as np\nFACTOR = 2"),
        ("bench/dispatch.py", "import os", "import os\nFACTOR = 2"),
        ("armlab/diagnosis/torque/search/search.py", "import numpy as np", "import numpy as np\nFACTOR = 2"),
    ],
    ids=lambda value: value if "/" in value else "",
)
def test_what_the_trial_does_not_use_changes_nothing(tree: Path, file: str, old: str, new: str) -> None:
    before = _print("de", ARM)
    _edit(tree / file, old, new)
    assert _print("de", ARM) == before


@pytest.mark.parametrize(
    ("file", "old", "new"),
    [
        ("algorithms/mupso.py", "import numpy as np", "import numpy as np\nFACTOR = 2"),
        ("algorithms/spso.py", "import numpy as np", "import numpy as np\nFACTOR = 2"),
        ("algorithms/driver.py", "return np.minimum(np.maximum(X, box.lower), box.upper)", "return X"),
        ("bench/execute.py", 'kind="stable"', 'kind="heapsort"'),
        ("bench/seeds.py", '"first population"', '"population"'),
        ("problem/transforms.py", "import numpy as np", "import numpy as np\nFACTOR = 2"),
        ("problem/kernel.c", "0", "1"),
        ("problem/kernel_build.py", "-O", "-g -O"),
        ("problem/robots/irb120-arm.yaml", "alpha:", "alpha: "),
    ],
    ids=lambda value: value if "/" in value else "",
)
def test_whatever_can_change_the_outcome_changes_the_fingerprint(tree: Path, file: str, old: str, new: str) -> None:
    before = _print("mupso", ARM)
    _edit(tree / file, old, new)
    assert _print("mupso", ARM) != before


def test_code_that_moves_to_another_file_stays_in_the_fingerprint(tree: Path) -> None:
    driver, moved = tree / "algorithms" / "driver.py", tree / "algorithms" / "horizon.py"
    formula = "    return max(evaluations // swarm_size - 1, 0)\n"
    _edit(driver, formula, "    from algorithms import horizon\n\n    return horizon.count(evaluations, swarm_size)\n")
    moved.write_text(f"def count(evaluations, swarm_size):\n{formula}")
    before = _print("de", SPHERE)
    _edit(moved, "- 1", "- 2")
    assert _print("de", SPHERE) != before


def test_a_name_that_means_another_class_of_the_same_file_is_another_algorithm() -> None:
    problem = parse_problem(SPHERE, "test")
    assert fingerprint(load("cma-es"), problem) != fingerprint(load("ipop-cma-es"), problem)


def test_a_problem_of_a_suite_is_its_definition_and_its_arm_and_no_other(
    tree: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = _print("de", SUITE)
    _edit(tree / "problem" / "suites" / "suite-1.yaml", "instances:", "others:")
    _edit(tree / "problem" / "robots" / "kuka-kr300.yaml", "alpha:", "alpha: ")
    assert _print("de", SUITE) == before
    own = bench.fingerprint.definition_of(SUITE["preset"])
    with monkeypatch.context() as patch:
        patch.setattr("bench.fingerprint.definition_of", lambda name: own.model_copy(update={"duration": 1.0}))
        assert _print("de", SUITE) != before
    _edit(tree / "problem" / "robots" / f"{own.arm}.yaml", "alpha:", "alpha: ")
    assert _print("de", SUITE) != before


@pytest.mark.parametrize(
    ("package", "algorithm", "matters"),
    [
        ("numpy", "de", True),  # NEP 19: another release may draw other numbers
        ("cmaes", "cma-es", True),
        ("cmaes", "de", False),
        ("scipy", "scipy-de", True),
        ("scipy", "de", False),
        ("pydantic", "de", False),
        ("joblib", "de", False),
    ],
)
def test_the_release_of_a_package_counts_where_it_computes(
    package: str, algorithm: str, matters: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = _print(algorithm, SPHERE)
    read = bench.fingerprint._package_version
    monkeypatch.setattr("bench.fingerprint._package_version", lambda name: "another" if name == package else read(name))
    assert (_print(algorithm, SPHERE) != before) == matters


SCRIPT = """
from algorithms.registry import load
from bench.fingerprint import fingerprint
from problem.registry import parse_problem
print(fingerprint(load("de"), parse_problem({"preset": "sphere", "dimension": 3}, "test")))
"""


def test_a_process_that_finds_other_folders_first_sees_the_same_code() -> None:
    there = subprocess.run([sys.executable, "-c", SCRIPT], capture_output=True, text=True, check=True).stdout.strip()
    assert _print("de", SPHERE) == there


THEIRS = {
    "__init__.py": "",
    "inner/__init__.py": "",
    "inner/preset.py": "from armlab.common.settings import Settings\nfrom ..law import FACTOR\n\n\n"
    "class TheirSettings(Settings):\n    preset: str\n\n    def build(self):\n        return FACTOR\n",
    "law.py": "from their_problems import table\n\nFACTOR = 1\n",
    "table.py": "ROWS = 3\n",
    "unused.py": "FACTOR = 1\n",
    "law.csv": "1,2\n",
}


@pytest.mark.parametrize(
    ("file", "text", "matters"),
    [
        ("law.py", "from their_problems import table\n\nFACTOR = 2.0\n", True),
        ("law.py", "from their_problems import table\n\nFACTOR = 1  # as measured\n", False),
        ("table.py", "ROWS = 4.0\n", True),
        ("law.csv", "1,2.5\n", True),
        ("unused.py", "FACTOR = 2.0\n", False),
    ],
)
def test_a_problem_of_a_third_party_is_the_code_that_it_imports_and_its_data(
    file: str, text: str, matters: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    package = tmp_path / "their_problems"
    (package / "inner").mkdir(parents=True)
    for name, content in THEIRS.items():
        (package / name).write_text(content)
    monkeypatch.syspath_prepend(str(tmp_path))
    for name in [name for name in sys.modules if name.startswith("their_problems")]:
        monkeypatch.delitem(sys.modules, name)  # that of another test
    entry = EntryPoint("theirs", "their_problems.inner.preset:TheirSettings", "armlab.problems")
    monkeypatch.setattr("problem.registry.plug_ins", lambda: [entry])
    before = _print("de", {"preset": "theirs"})
    assert _print("de", {"preset": "theirs"}) == before
    (package / file).write_text(text)
    assert (_print("de", {"preset": "theirs"}) != before) == matters


@pytest.mark.parametrize("file", ["problem/smooth.py", "problem/gradient.py"])
def test_derivatives_decide_only_the_trials_that_ask_for_them(tree: Path, file: str) -> None:
    before = [_print(name, ARM) for name in ("spso", "sqp")]
    _edit(tree / file, "import numpy as np", "import numpy as np\nFACTOR = 2")
    after = [_print(name, ARM) for name in ("spso", "sqp")]
    assert (after[0] == before[0], after[1] == before[1]) == (True, False)
