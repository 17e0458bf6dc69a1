"""Typed settings: pydantic models whose complaints are one line that a person can act on."""

import difflib
import re
from collections.abc import Sequence
from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict, TypeAdapter, ValidationError, model_validator
from pydantic_core import ErrorDetails, PydanticCustomError

from problem.errors import InputError

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
                    context = {"key": key, "hint": nearest(str(key), known)}
                    raise PydanticCustomError(_UNKNOWN_KEY, "unknown key '{key}'", context)
        return data


def nearest(name: str, known: Sequence[str]) -> str:
    """The tail of an error message: the right name that was probably meant, or all of them."""
    close = difflib.get_close_matches(name, known, n=1)
    return f"did you mean '{close[0]}'?" if close else f"known: {', '.join(known) or 'none'}"


def validate(model_type: type[T], data: Any, where: str) -> T:
    """Plain data (as read_yaml gives it) as a checked model.

    where: what the data is for the reader, e.g. the path of its file.
    Raises InputError, in one line, that names the key, what it holds and what it should hold.
    """
    try:
        return TypeAdapter(model_type).validate_python(_tuples(data))
    except ValidationError as error:
        details = sorted(error.errors(), key=lambda detail: detail["type"] != _UNKNOWN_KEY)
        more = f" (and {len(details) - 1} more)" if len(details) > 1 else ""
        raise InputError(_sentence(details[0], where) + more) from None


def _tuples(data: Any) -> Any:
    """The data with tuples for lists: the settings are frozen, and strict about it."""
    if isinstance(data, dict):
        return {key: _tuples(value) for key, value in data.items()}
    return tuple(_tuples(item) for item in data) if isinstance(data, list | tuple) else data


def _sentence(detail: ErrorDetails, where: str) -> str:
    path = _path(detail["loc"])
    context = detail.get("ctx", {})
    if detail["type"] == _UNKNOWN_KEY:
        place = f"{where} at {path}" if path else where
        return f"unknown key '{context['key']}' in {place}: {context['hint']}"
    if detail["type"] == "missing":
        return f"missing key '{path}' in {where}"
    reason = str(context["error"]) if detail["type"] == "value_error" else _reason(detail)
    place = f"'{path}' in {where}" if path else where
    given = "" if isinstance(detail["input"], dict) else f", not {_short(detail['input'])}"
    return f"{place}: {reason}{given}"


def _reason(detail: ErrorDetails) -> str:
    if detail["type"] in ("model_type", "dict_type"):
        return "should hold keys"
    if detail["type"] == "tuple_type":
        return "should be a list"
    return detail["msg"].replace("Input should", "should").replace("tuple", "list")


def _path(location: tuple[int | str, ...]) -> str:
    """Keys and places; pydantic adds the tried members of a union, which are no keys of the file."""
    places = (part for part in location if isinstance(part, int) or _KEY.fullmatch(part))
    parts = (f"[{part}]" if isinstance(part, int) else f".{part}" for part in places)
    return "".join(parts).removeprefix(".")


def _short(value: Any) -> str:
    shown = list(value) if isinstance(value, tuple) else value
    text = " ".join(repr(shown).split())
    return text if len(text) <= 60 else f"{text[:57]}..."
