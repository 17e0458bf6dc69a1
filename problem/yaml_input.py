"""YAML files into plain data: no objects, no surprises, no bombs."""

import math
import re
from pathlib import Path
from typing import Any

import yaml

from problem.errors import InputError
from problem.settings import Settings, validate

__all__ = ["Settings", "read_yaml", "validate"]

MAX_BYTES = 1_000_000
MAX_NODES = 200_000
_FLOAT = "tag:yaml.org,2002:float"
_EXPONENT_WITHOUT_POINT = re.compile(r"^[-+]?[0-9]+[eE][-+]?[0-9]+$")


class _Loader(yaml.SafeLoader):
    """The safe loader, which also reads 1e-8 as a number (YAML 1.2); PyYAML takes it for text."""


_Loader.add_implicit_resolver(_FLOAT, _EXPONENT_WITHOUT_POINT, list("-+0123456789"))


def read_yaml(path: str | Path) -> Any:
    """The content of one YAML document as dicts, lists and scalars.

    Raises InputError, in one line, for a file that is missing, unreadable, empty, too big, not YAML, or
    that holds a key twice, a NaN or aliases that unfold without end.
    """
    text = _read_text(Path(path))
    try:
        return _parse(text, str(path))
    except yaml.MarkedYAMLError as error:
        line = error.problem_mark.line + 1 if error.problem_mark else 1
        hint = "; indent with spaces" if "'\\t'" in str(error.problem) else ""
        raise InputError(f"{path}, line {line}: not valid YAML: {error.problem}{hint}") from None
    except (yaml.YAMLError, ValueError) as error:
        raise InputError(f"{path}: not valid YAML: {' '.join(str(error).split())}") from None
    except RecursionError:
        raise InputError(f"{path}: nested too deeply to be a settings file") from None


def _read_text(path: Path) -> str:
    try:
        with path.open("rb") as file:
            content = file.read(MAX_BYTES + 1)
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror}") from None
    if len(content) > MAX_BYTES:
        raise InputError(f"{path} is larger than {MAX_BYTES} bytes: too big for a settings file")
    try:
        return content.decode("utf-8")
    except UnicodeDecodeError:
        raise InputError(f"{path} is not UTF-8 text: is it a YAML file?") from None


def _parse(text: str, where: str) -> Any:
    loader = _Loader(text)
    try:
        node = loader.get_single_node()
        if node is None:
            raise InputError(f"{where} is empty: it should hold at least one key")
        if _unfolded_size(node, {}, where) > MAX_NODES:
            raise InputError(f"{where}: its aliases unfold to more than {MAX_NODES} values: write them out")
        return loader.construct_document(node)
    finally:
        loader.dispose()


def _unfolded_size(node: yaml.Node, sizes: dict[int, float], where: str) -> float:
    """Number of values below a node with every alias written out; a circle counts as infinite."""
    if id(node) not in sizes:
        sizes[id(node)] = math.inf
        _check_node(node, where)
        sizes[id(node)] = 1 + sum(_unfolded_size(child, sizes, where) for child in _children(node))
    return sizes[id(node)]


def _children(node: yaml.Node) -> list[yaml.Node]:
    if isinstance(node, yaml.MappingNode):
        return [child for pair in node.value for child in pair]
    return list(node.value) if isinstance(node, yaml.SequenceNode) else []


def _check_node(node: yaml.Node, where: str) -> None:
    line = node.start_mark.line + 1
    if node.tag == _FLOAT and node.value.lower() == ".nan":
        raise InputError(f"{where}, line {line}: .nan is not a number to work with")
    if not isinstance(node, yaml.MappingNode):
        return
    seen: set[tuple[str, str]] = set()
    for key in (key for key, _ in node.value if isinstance(key, yaml.ScalarNode)):
        if (key.tag, key.value) in seen:
            raise InputError(f"{where}, line {key.start_mark.line + 1}: key {key.value!r} stands there twice")
        seen.add((key.tag, key.value))
