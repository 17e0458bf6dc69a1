"""Typed settings and the YAML files that hold them.

Settings are pydantic models whose error messages are one line that a person can act on. YAML is read as plain data:
no objects, no duplicate keys, no NaN, a limited size.
"""

import difflib
import json
import math
import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, TypeVar

import yaml
from pydantic import BaseModel, ConfigDict, TypeAdapter, ValidationError, model_validator
from pydantic_core import ErrorDetails, PydanticCustomError

from armlab.common.errors import InputError, in_one_line

T = TypeVar("T")
_UNKNOWN_KEY = "unknown_key"
_KEY = re.compile(r"(?!(float|int|str|bool|none|\w+Settings)$)[A-Za-z_]\w*")


class Settings(BaseModel):
    """Base of every model that is read from a file: frozen, strict numbers, all finite, no unknown key."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)

    @model_validator(mode="before")
    @classmethod
    def _name_nearest_key(cls, data: Any) -> Any:
        known = [field.alias or name for name, field in cls.model_fields.items()]
        if isinstance(data, dict):
            for key in data:
                if key not in known:
                    context = {"key": key, "hint": suggest_name(str(key), known)}
                    raise PydanticCustomError(_UNKNOWN_KEY, "unknown key '{key}'", context)
        return data


def suggest_name(name: str, known: Sequence[str]) -> str:
    """The tail of an error message: the right name that was probably meant, or all of them."""
    close = difflib.get_close_matches(name, known, n=1)
    return f"did you mean '{close[0]}'?" if close else f"known: {', '.join(known) or 'none'}"


def validate(model_type: type[T], data: Any, where: str) -> T:
    """Plain data (as read_yaml gives it) as a checked model.

    where: what the data is for the reader, e.g. the path of its file.
    Raises InputError, in one line, that names the key, what it holds and what it should hold.
    """
    try:
        return TypeAdapter(model_type).validate_python(_lists_to_tuples(data))
    except ValidationError as error:
        details = sorted(error.errors(), key=lambda detail: detail["type"] != _UNKNOWN_KEY)
        more = f" (and {len(details) - 1} more)" if len(details) > 1 else ""
        raise InputError(_error_sentence(details[0], where) + more) from None


def _lists_to_tuples(data: Any) -> Any:
    """The data with tuples for lists: the settings are frozen, and strict about it."""
    if isinstance(data, dict):
        return {key: _lists_to_tuples(value) for key, value in data.items()}
    return tuple(_lists_to_tuples(item) for item in data) if isinstance(data, list | tuple) else data


def _error_sentence(detail: ErrorDetails, where: str) -> str:
    path = _key_path(detail["loc"])
    context = detail.get("ctx", {})
    if detail["type"] == _UNKNOWN_KEY:
        place = f"{where} at {path}" if path else where
        return f"unknown key '{context['key']}' in {place}: {context['hint']}"
    if detail["type"] == "missing":
        return f"missing key '{path}' in {where}"
    reason = str(context["error"]) if detail["type"] == "value_error" else _error_reason(detail)
    place = f"'{path}' in {where}" if path else where
    given = "" if isinstance(detail["input"], dict) else f", not {_shorten(detail['input'])}"
    return f"{place}: {reason}{given}"


def _error_reason(detail: ErrorDetails) -> str:
    if detail["type"] in ("model_type", "dict_type"):
        return "should hold keys"
    if detail["type"] == "tuple_type":
        return "should be a list"
    return _PYDANTIC_WORDS.get(detail["type"], _translate)(detail)


def _translate(detail: ErrorDetails) -> str:
    return detail["msg"].replace("Input should", "should").replace("tuple", "list")


_PYDANTIC_WORDS: dict[str, Callable[[ErrorDetails], str]] = {
    "too_short": lambda detail: f"should hold {detail['ctx']['min_length']} or more entries",
    "too_long": lambda detail: f"should hold {detail['ctx']['max_length']} entries or fewer",
    "string_too_short": lambda detail: "should not be empty",
    "string_pattern_mismatch": lambda detail: f"should have the form {detail['ctx']['pattern']}",
}


def _key_path(location: tuple[int | str, ...]) -> str:
    """Keys and places; pydantic adds the tried members of a union, which are no keys of the file."""
    places = (part for part in location if isinstance(part, int) or _KEY.fullmatch(part))
    parts = (f"[{part}]" if isinstance(part, int) else f".{part}" for part in places)
    return "".join(parts).removeprefix(".")


def _shorten(value: Any) -> str:
    shown = list(value) if isinstance(value, tuple) else value
    text = " ".join(repr(shown).split())
    return text if len(text) <= 60 else f"{text[:57]}..."


MAX_JSON_BYTES = 100_000_000


def read_json(path: str | Path) -> Any:
    """The content of a JSON file.

    Raises InputError, in one line, for a file that is missing, unreadable, too big, nested too deeply or not JSON.
    """
    text = _read_text(Path(path), MAX_JSON_BYTES)
    try:
        return json.loads(text)
    except ValueError as error:
        raise InputError(f"{path}: not valid JSON: {error}") from None
    except RecursionError:
        raise InputError(f"{path}: nested too deeply") from None


MAX_YAML_BYTES = 1_000_000
MAX_YAML_NODES = 200_000
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
    text = _read_text(Path(path), MAX_YAML_BYTES)
    try:
        return _parse_yaml(text, str(path))
    except yaml.MarkedYAMLError as error:
        line = error.problem_mark.line + 1 if error.problem_mark else 1
        hint = "; indent with spaces" if "'\\t'" in str(error.problem) else ""
        raise InputError(f"{path}, line {line}: not valid YAML: {error.problem}{hint}") from None
    except (yaml.YAMLError, ValueError) as error:
        raise InputError(f"{path}: not valid YAML: {in_one_line(error)}") from None
    except RecursionError:
        raise InputError(f"{path}: nested too deeply to be a settings file") from None


def find_shipped(path: Path) -> Path:
    """The path; a configuration `configs/...` that the working folder lacks is the one that comes with armlab."""
    shipped = Path(__file__).parents[2] / path
    return shipped if path.parts[:1] == ("configs",) and not path.exists() and shipped.is_file() else path


def _read_text(path: Path, max_bytes: int) -> str:
    try:
        with find_shipped(path).open("rb") as file:
            content = file.read(max_bytes + 1)
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror}") from None
    if len(content) > max_bytes:
        raise InputError(f"{path} is larger than {max_bytes} bytes: too big for a settings file")
    try:
        return content.decode("utf-8")
    except UnicodeDecodeError:
        raise InputError(f"{path} is not UTF-8 text") from None


def _parse_yaml(text: str, where: str) -> Any:
    loader = _Loader(text)
    try:
        node = loader.get_single_node()
        if node is None:
            raise InputError(f"{where} is empty: it should hold at least one key")
        if _unfolded_size(node, {}, where) > MAX_YAML_NODES:
            raise InputError(f"{where}: its aliases unfold to more than {MAX_YAML_NODES} values: write them out")
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


def settings_to_yaml(settings: Settings) -> str:
    """The full settings as YAML text."""
    text: str = yaml.safe_dump(settings.model_dump(mode="json"), sort_keys=False, allow_unicode=True)
    return text


def to_plain_data(data: Any) -> Any:
    """The data with lists for tuples, as YAML writes them."""
    if isinstance(data, dict):
        return {key: to_plain_data(value) for key, value in data.items()}
    return [to_plain_data(item) for item in data] if isinstance(data, list | tuple) else data
