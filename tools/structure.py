"""Figures of the structure of a source tree: `python tools/structure.py [TREE]`; TREE is this repository if left out.

Files and lines without tests, modules that only one other module imports, the longest chain of imports within the
diagnosis, modules that a diagnosis loads, functions that are named by a participle, names of classes and of files that
stand twice in a package, and files outside the library of effects that name an effect.
"""

import ast
import os
import re
import subprocess
import sys
from collections import defaultdict
from pathlib import Path

ROOTS = ("problem", "algorithms", "bench", "armlab")
IRREGULAR = {
    "begun",
    "bent",
    "bound",
    "broken",
    "built",
    "bought",
    "cast",
    "caught",
    "chosen",
    "cut",
    "dealt",
    "drawn",
    "driven",
    "fed",
    "felt",
    "fitted",
    "found",
    "given",
    "gone",
    "grown",
    "held",
    "hidden",
    "kept",
    "known",
    "laid",
    "led",
    "left",
    "lent",
    "let",
    "lost",
    "made",
    "meant",
    "met",
    "paid",
    "put",
    "read",
    "risen",
    "run",
    "said",
    "seen",
    "sent",
    "set",
    "shown",
    "shut",
    "spent",
    "split",
    "spoken",
    "stood",
    "sunk",
    "taken",
    "taught",
    "thrown",
    "told",
    "understood",
    "withdrawn",
    "won",
    "worn",
    "written",
}
NOT_PARTICIPLES = {"cut", "put", "read", "run", "set", "split", "let", "left", "bound", "seed", "speed", "need", "feed"}
LIBRARIES = ("armlab/effects/", "armlab/proof/blind/")


def main() -> None:
    """Prints the figures."""
    tree = Path(sys.argv[1] if len(sys.argv) > 1 else Path(__file__).resolve().parents[1])
    sources = read_sources(tree)
    trees = {path: ast.parse(text) for path, text in sources.items()}
    print(f"files: {len(sources)}")
    for part in ("", "armlab/", "armlab/diagnosis/", "armlab/proof/"):
        lines = sum(text.count("\n") for path, text in sources.items() if path.as_posix().startswith(part))
        print(f"lines{f' of {part}' if part else ''}: {lines}")
    importers = importers_of(trees)
    print(f"modules with one importer: {sum(len(each) == 1 for each in importers.values())}")
    print(f"longest chain of imports in the diagnosis: {len(longest_chain(importers, 'armlab.diagnosis'))}")
    names = names_twice(trees)
    print(f"names that stand twice in a package: {', '.join(names) or 'none'}")
    print(f"functions named by a participle: {sum(count_participles(each) for each in trees.values())}")
    naming = files_naming_an_effect(sources)
    print(f"files outside the library (and the truth machine) that name an effect: {len(naming)}")
    print(f"modules that a diagnosis loads: {modules_of_a_diagnosis(tree)}")


def read_sources(tree: Path) -> dict[Path, str]:
    """The text of every module, by its path from the top."""
    files = sorted(path for root in ROOTS for path in (tree / root).rglob("*.py"))
    return {path.relative_to(tree): path.read_text(encoding="utf-8") for path in files}


def module_name(path: Path) -> str:
    """The dotted name of a source file."""
    return ".".join(path.with_suffix("").parts).removesuffix(".__init__")


def importers_of(trees: dict[Path, ast.Module]) -> dict[str, set[str]]:
    """The modules that import each module, package files left out."""
    names = {module_name(path) for path in trees if path.name != "__init__.py"}
    found: dict[str, set[str]] = defaultdict(set)
    for path, tree in trees.items():
        for node in ast.walk(tree):
            if isinstance(node, ast.ImportFrom) and node.module:
                targets = {f"{node.module}.{alias.name}" for alias in node.names} | {node.module}
                for target in targets & names:
                    found[target].add(module_name(path))
    return found


def longest_chain(importers: dict[str, set[str]], package: str) -> list[str]:
    """The longest chain of modules of a package of which each imports the next one; imports go no circles."""
    above = {
        name: {each for each in found if each.startswith(package)}
        for name, found in importers.items()
        if name.startswith(package)
    }
    chains: dict[str, list[str]] = {}

    def chain_to(name: str) -> list[str]:
        if name not in chains:
            longest = max((chain_to(each) for each in above.get(name, ())), key=len, default=[])
            chains[name] = [*longest, name]
        return chains[name]

    return max((chain_to(name) for name in above), key=len, default=[])


def names_twice(trees: dict[Path, ast.Module]) -> dict[str, list[Path]]:
    """Names of classes, and of files, that stand in more than one place of a package: `armlab/proof: Plan`.

    The packages are those of armlab, and each other folder of `ROOTS` as a whole.
    """
    places: dict[str, list[Path]] = defaultdict(list)
    for path, tree in trees.items():
        package = "/".join(path.parts[: 2 if path.parts[0] == "armlab" else 1])
        if path.name != "__init__.py":
            places[f"{package}: {path.name}"].append(path)
        for node in tree.body:
            if isinstance(node, ast.ClassDef):
                places[f"{package}: {node.name}"].append(path)
    return {name: sorted(found) for name, found in sorted(places.items()) if len(found) > 1}


def count_participles(tree: ast.Module) -> int:
    """Functions and methods whose name is one word, a participle."""
    names = [node.name.strip("_") for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]
    return sum(is_participle(name) for name in names)


def is_participle(name: str) -> bool:
    """Whether a name is one word that is a participle."""
    if "_" in name or name in NOT_PARTICIPLES:
        return False
    return name in IRREGULAR or name.endswith("ed")


def files_naming_an_effect(sources: dict[Path, str]) -> list[Path]:
    """Files that hold the id of an effect as text."""
    ids = effect_ids(sources)
    pattern = re.compile(r"[\"'](" + "|".join(ids) + r")[\"']")
    outside = [path for path in sources if not str(path).startswith(LIBRARIES)]
    return [path for path in outside if pattern.search(sources[path])]


def effect_ids(sources: dict[Path, str]) -> list[str]:
    """Ids of two words and more: those of one word are words of other things, too."""
    text = "\n".join(text for path, text in sources.items() if str(path).startswith(LIBRARIES))
    return sorted(set(re.findall(r"Effect\(\s*\"(\w+_\w+)\"", text)))


def modules_of_a_diagnosis(tree: Path) -> int:
    """Modules of the project that `armlab diagnose` loads, its report included, package files left out."""
    place = "armlab.report.torque.write" if (tree / "armlab").is_dir() else "diagnosis.command"
    code = (
        f"import sys, {place}; from collections import Counter; "
        f"print(sum(name.split('.')[0] in {ROOTS!r} and hasattr(module, '__file__') "
        "and not str(module.__file__).endswith('__init__.py') for name, module in sys.modules.items()))"
    )
    environment = {**os.environ, "PYTHONPATH": str(tree)}
    done = subprocess.run([sys.executable, "-c", code], cwd=tree, env=environment, capture_output=True, text=True)
    return int(done.stdout) if done.returncode == 0 else -1


if __name__ == "__main__":
    main()
