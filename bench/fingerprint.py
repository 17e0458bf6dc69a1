"""The hash of all code and data that can change the outcome of a trial, and of nothing else.

Code: the modules that the imports lead to from three roots, which are `bench.execute` (with the driver and the random
streams), the module of the algorithm and the module of the problem's settings. A Python module counts by its abstract
syntax without comments and docstrings, C by its bytes. Another package counts by its version: a peer's package is the
search itself, and numpy may change a random stream or a rounding with every release (NEP 19). Data: the robot files
that the settings name, the definition of a suite's problem, and the data files of a third party's package. Processor:
where an algorithm calls LAPACK (class attribute `calls_lapack`), the kernels of BLAS and the SIMD level, since its
decisions turn the last digit into another path; a third party's algorithm counts as one unless it says that it does
not. All other algorithms give the same numbers up to the last few digits on any processor.
"""

import ast
import hashlib
import sys
from collections import deque
from collections.abc import Iterable, Iterator
from functools import lru_cache
from importlib.machinery import EXTENSION_SUFFIXES
from importlib.metadata import PackageNotFoundError, entry_points, packages_distributions, version
from importlib.util import find_spec, resolve_name
from pathlib import Path
from typing import Any, NamedTuple

from algorithms.contract import AnyAlgorithm, AsksDerivatives
from algorithms.registry import is_our_code
from bench.execute import canonical
from bench.processor import processor_kernels
from problem.registry import ProblemSettings
from problem.robot_file import BUILT_IN_FOLDER
from problem.suite import InstanceSettings, definition_of

_ROOT = "bench.execute"
_SOURCE_FOLDER = Path(__file__).resolve().parents[1]
_OUR_PACKAGES = frozenset({"problem", "algorithms", "bench", "armlab"})
# these find code by its name; what they find is a root of its own
_LOOK_UPS = frozenset({"algorithms.registry", "problem.registry", "armlab"})
# this reads a robot file, which is part of the key itself, by a package that need not be there
_READERS = frozenset({"problem.mjcf"})
# these check settings, and what they make of them is part of the key already
_SETTINGS_PACKAGES = frozenset({"annotated_types", "pydantic", "pydantic_core", "yaml"})
# this computes derivatives, and runs only where an algorithm asks for them
_DERIVATIVES = "problem.smooth"
_CODE_SUFFIXES = (".py", ".pyc", *EXTENSION_SUFFIXES)


def fingerprint(algorithm: AnyAlgorithm, problem: ProblemSettings) -> str:
    """SHA-256 of the code and data that decide the trials of an algorithm on a problem, wherever the files stand."""
    classes = (algorithm, type(problem))
    parts = [f"root {code.__module__}:{code.__qualname__}" for code in classes]
    unused = () if issubclass(algorithm, AsksDerivatives) else (_DERIVATIVES,)
    parts += _code_parts([_ROOT, *(code.__module__ for code in classes)], unused)
    if calls_lapack(algorithm):
        parts.append(f"processor {canonical(processor_kernels())}")
    return _digest([*parts, *_data_parts(problem)])


def calls_lapack(algorithm: AnyAlgorithm) -> bool:
    """Whether the path of an algorithm depends on the kernels of BLAS and LAPACK."""
    return bool(getattr(algorithm, "calls_lapack", not is_our_code(algorithm.name)))


def module_fingerprint(module: str, problem: ProblemSettings) -> str:
    """The same of the code and data that decide what a module computes on a problem."""
    return _digest([*_code_parts([module, type(problem).__module__], ()), *_data_parts(problem)])


def algorithm_fingerprint(algorithm: AnyAlgorithm, measure: str) -> str:
    """The same of an algorithm alone, and of the module that measures it."""
    return _digest([f"root {algorithm.__qualname__}", *_code_parts([measure, algorithm.__module__], ())])


def _digest(parts: list[str]) -> str:
    return hashlib.sha256("\n".join(sorted(parts)).encode()).hexdigest()


def _code_parts(roots: Iterable[str], unused: Iterable[str]) -> Iterator[str]:
    """A line for each module and each package that the roots import, directly or through others but the unused ones."""
    queue = deque(roots)
    followed = _OUR_PACKAGES | {_top_package(name) for name in queue}
    for top in followed - _OUR_PACKAGES:
        yield from _package_data(top)
    found = {*unused, *_LOOK_UPS, *_READERS, *_SETTINGS_PACKAGES, *sys.stdlib_module_names}
    while queue:
        name = queue.popleft()
        top = _top_package(name)
        if top not in followed:
            name = top
        if name in found:
            continue
        found.add(name)
        release = None if top in followed else _package_version(top)
        if release is not None:
            yield f"package {name} {release}"
            continue
        module = _read_module(name)
        yield f"module {name} {module.digest}"
        followed |= {_top_package(plug_in) for plug_in in module.plug_ins}
        queue.extend((*module.imports, *module.plug_ins))


def _top_package(name: str) -> str:
    return name.partition(".")[0]


@lru_cache
def _package_version(top: str) -> str | None:
    """The release of a package; None where it was never released, so that its code has to be read."""
    try:
        return version(top)
    except PackageNotFoundError:
        distributions = packages_distributions().get(top, [])
    if distributions:
        return " ".join(sorted(f"{name} {version(name)}" for name in set(distributions)))
    return None if find_spec(top) else "not installed"


class _Module(NamedTuple):
    """imports: full names of the modules that it imports. plug_ins: of those that it loads by an entry-point group."""

    digest: str
    imports: tuple[str, ...] = ()
    plug_ins: tuple[str, ...] = ()


def _read_module(name: str) -> _Module:
    path = _module_file(name)
    if path is None:  # a namespace package has no file
        return _Module("")
    if path.suffix == ".py":
        return _read_source(name, path, *_file_state(path))
    return _Module(_extension_digest(name.rpartition(".")[2], path))


def _module_file(name: str) -> Path | None:
    """The file of a module; imports nothing but the packages that it is in.

    Ours are looked for beside this package: where another folder of the path has one of their names, Python may take
    both for one namespace, which has no file.
    """
    if _top_package(name) in _OUR_PACKAGES:
        stem = _SOURCE_FOLDER.joinpath(*name.split("."))
        compiled = sorted(stem.parent.glob(f"{stem.name}.*.so"))
        places = (stem.with_suffix(".py"), stem / "__init__.py", *compiled)
        return next((place for place in places if place.is_file()), None)
    found = find_spec(name)
    return Path(found.origin) if found and found.origin else None


def _extension_digest(name: str, path: Path) -> str:
    """Of the sources of a compiled module `_NAME`, NAME.c and NAME_build.py, where they stand beside it."""
    own_name = name.removeprefix("_")
    source, build = path.with_name(f"{own_name}.c"), path.with_name(f"{own_name}_build.py")
    if source.exists() and build.exists():
        return f"{_file_digest(source)} {_read_source(own_name, build, *_file_state(build)).digest}"
    return _file_digest(path)


@lru_cache(maxsize=4096)
def _read_source(name: str, path: Path, *state: int) -> _Module:
    """A module in a state of its file: most modules decide all trials, and need to be read once."""
    tree = ast.parse(path.read_bytes())
    package = name if path.name == "__init__.py" else name.rpartition(".")[0]
    imports = dict.fromkeys(part for target in _import_targets(tree, package) for part in _with_parents(target))
    digest = hashlib.sha256(_syntax_text(tree).encode()).hexdigest()
    return _Module(digest, tuple(imports), tuple(_plug_ins(tree)))


def _import_targets(tree: ast.Module, package: str) -> Iterator[str]:
    """Full names of the imported modules, those within functions too."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            source = resolve_name(f"{'.' * node.level}{node.module or ''}", package)
            yield source
            if _top_package(source) in _OUR_PACKAGES | {_top_package(package)}:
                yield from (f"{source}.{alias.name}" for alias in node.names if _is_submodule(source, alias.name))


def _is_submodule(package: str, name: str) -> bool:
    """Whether a name that is taken from a package is a module in it; else the package's own code defines it."""
    path = _module_file(package)
    return path is not None and path.name == "__init__.py" and _module_file(f"{package}.{name}") is not None


def _with_parents(name: str) -> Iterator[str]:
    """A module and the packages that it is in, whose `__init__` runs before it."""
    parts = name.split(".")
    yield from (".".join(parts[:length]) for length in range(1, len(parts) + 1))


def _plug_ins(tree: ast.Module) -> Iterator[str]:
    """Modules that are registered in the group that the module names as ENTRY_POINT_GROUP."""
    for node in tree.body:
        match node:
            case ast.Assign(targets=[ast.Name(id="ENTRY_POINT_GROUP")], value=ast.Constant(value=str(group))):
                yield from (entry.module for entry in entry_points(group=group))


def _syntax_text(node: Any) -> str:
    """The abstract syntax as text, without docstrings, places, and fields that only some versions of Python have."""
    if isinstance(node, ast.AST):
        fields = [(name, value) for name, value in ast.iter_fields(node) if value not in (None, [])]
        return f"{type(node).__name__}({','.join(f'{name}={_syntax_text(value)}' for name, value in fields)})"
    if isinstance(node, list):
        return f"[{','.join(_syntax_text(item) for item in node if not _is_bare_text(item))}]"
    return repr(node)


def _is_bare_text(node: Any) -> bool:
    """A text that is a statement of its own: a docstring of a module, class, function or attribute."""
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)


def _data_parts(problem: ProblemSettings) -> Iterator[str]:
    """A line for each file that the settings name, and for the definition that a suite's problem stands for."""
    settings: list[Any] = [problem.model_dump(mode="json")]
    if isinstance(problem, InstanceSettings):
        settings.append(definition_of(problem.preset).model_dump(mode="json"))
        yield f"definition {canonical(settings[-1])}"
    for text in set(_nested_texts(settings)):
        built_in = BUILT_IN_FOLDER / f"{text}.yaml"
        path = built_in if "/" not in text and built_in.is_file() else Path(text)
        if path.is_file():
            yield f"file {path.name} {_file_digest(path)}"


def _package_data(package: str) -> Iterator[str]:
    """A line for each file of a third party's package that is no code: its code may read it."""
    path = _module_file(package)
    if path is not None and path.name == "__init__.py":
        files = (file for file in path.parent.rglob("*") if file.is_file() and not file.name.endswith(_CODE_SUFFIXES))
        yield from (f"file {file.relative_to(path.parent).as_posix()} {_file_digest(file)}" for file in files)


def _nested_texts(content: Any) -> Iterator[str]:
    """All texts in nested settings."""
    if isinstance(content, str):
        yield content
    elif isinstance(content, dict | list):
        for item in content.values() if isinstance(content, dict) else content:
            yield from _nested_texts(item)


def _file_digest(path: Path) -> str:
    return _digest_of_state(path, *_file_state(path))


@lru_cache(maxsize=4096)
def _digest_of_state(path: Path, *state: int) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _file_state(path: Path) -> tuple[int, int, int]:
    """Inode, size and time of the last change: another state where the file was written to."""
    found = path.stat()
    return found.st_ino, found.st_size, found.st_mtime_ns
