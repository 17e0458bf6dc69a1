"""Pages of the file formats, of the keys of a configuration and of the algorithms' parameters, from their models."""

import inspect
import re
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import MISSING, fields
from typing import Any

from algorithms.registry import load, names, names_with_derivatives
from armlab.common.markdown import markdown_page, markdown_table
from armlab.common.settings import Settings
from armlab.diagnosis.tuning import tuning_page
from armlab.schemas import FORMATS
from bench.config import Experiment
from problem.registry import PRESETS
from tools.site.pages import Pages, toctree

TITLES = {
    "recording": "The file recording.yaml",
    "robot": "The robot file",
    "model": "The file model.yaml",
    "verdict": "The file verdict.json",
    "comparison": "The file comparison.json",
    "facts": "A file of facts",
}
FIRST_LINES = {
    "recording": "A recording is a folder with this file and its runs: [recordings](../recordings.md) has an example.",
    "robot": "An arm by D-H parameters: [the problem](../problem.md) has an example. A URDF or an MJCF serves, too.",
    "model": "Written by `identify` and `diagnose`; `predict`, `diagnose` and `model export` read it.",
    "verdict": "Written by `diagnose`. [Diagnosis](../diagnosis.md) says how it is found.",
    "comparison": "Written by `diagnose --compare`. [Changes](../changes.md) says how it is found.",
    "facts": "What is known of recordings, for `proof real --facts`: [recordings](../recordings.md) has an example.",
}
OTHER_PAGES = ("commands/index", "configuration", "parameters", "python", "tuning")


def format_pages() -> Pages:
    """Path and text of the index of the references, of each page of a format, and of keys and numbers."""
    pages: Pages = {f"reference/{name}.md": _format_page(name) for name in FORMATS}
    pages["reference/configuration.md"] = _configuration_page()
    pages["reference/parameters.md"] = _parameters_page()
    pages["reference/tuning.md"] = tuning_page()
    entries = (*OTHER_PAGES, *FORMATS)
    sentence = "All pages of this part are generated from the code of this version. [The glossary](../glossary.md) has "
    sentence += "the words, [the references](../references.md) have the sources."
    pages["reference/index.md"] = markdown_page("Reference", sentence, toctree(entries))
    return pages


def _format_page(name: str) -> str:
    schema = FORMATS[name].model_json_schema()
    stands = f"The JSON schema stands in `armlab/schemas/{name}.schema.json`."
    return markdown_page(TITLES[name], FIRST_LINES[name], stands, *_tables(schema))


def _configuration_page() -> str:
    parts = ["The keys of the YAML file that `armlab run` takes.", *_tables(Experiment.model_json_schema())]
    parts.append("## Problems\n\nKeys of an entry of `problem`, by its `preset`.")
    by_settings: dict[Any, list[str]] = {}
    for preset, settings in PRESETS.items():
        by_settings.setdefault(settings, []).append(preset)
    for settings, presets in by_settings.items():
        shown = ", ".join(f"`{name}`" for name in presets[:SHOWN_PRESETS])
        more = f" and {len(presets) - SHOWN_PRESETS} more" if len(presets) > SHOWN_PRESETS else ""
        parts += [f"### {presets[0]}", f"Presets: {shown}{more}.", *_tables(settings.model_json_schema(), level=4)]
    return markdown_page("Keys of a configuration", *parts)


SHOWN_PRESETS = 8


def _tables(schema: Mapping[str, Any], level: int = 2) -> Iterator[str]:
    """The keys of an object, then those of the objects that it holds."""
    yield from _object(schema)
    for name, inner in schema.get("$defs", {}).items():
        if inner.get("properties"):
            yield f"{'#' * level} {name}"
            yield from _object(inner)
        elif "enum" in inner:
            yield f"{'#' * level} {name}"
            yield f"One of {_type(inner)}."


def _object(schema: Mapping[str, Any]) -> Iterator[str]:
    """The description of an object and the table of its keys."""
    keys = schema.get("properties", {})
    text, own = split_description(schema.get("description", ""), list(keys))
    meanings = SHARED_MEANINGS | inherited_meanings(schema.get("title", ""), list(keys)) | own
    if text:
        yield _escape(text)
    rows = [
        (
            f"`{key}`",
            _type(value),
            "needed" if key in schema.get("required", ()) else _default(value),
            _escape(value.get("description", meanings.get(key, ""))),
        )
        for key, value in keys.items()
    ]
    if any(meaning for *_, meaning in rows):
        yield markdown_table(("key", "holds", "if left out", "meaning"), rows)
    elif rows:
        yield markdown_table(("key", "holds", "if left out"), [row[:3] for row in rows])


SHARED_MEANINGS = {"preset": "the name of the problem"}


def inherited_meanings(title: str, keys: Sequence[str]) -> dict[str, str]:
    """What the settings that a model inherits from say of its keys; the nearest one counts."""
    named = [each for each in _subclasses(Settings) if each.__name__ == title]
    bases = [base for each in named for base in reversed(each.__mro__[1:]) if issubclass(base, Settings)]
    said = [split_description(inspect.getdoc(base) or "", keys)[1] for base in bases if base is not Settings]
    return {name: text for meanings in said for name, text in meanings.items()}


def _subclasses(model: type) -> Iterator[type]:
    for each in model.__subclasses__():
        yield each
        yield from _subclasses(each)


def split_description(text: str, keys: Sequence[str]) -> tuple[str, dict[str, str]]:
    """What a docstring says in general, and what it says of each key: `key: meaning.` or `one, other: meaning.`"""
    if not keys:
        return text, {}
    key = "`?(?:" + "|".join(sorted(map(re.escape, keys), key=len, reverse=True)) + ")`?"
    parts = re.split(rf"(?:^|(?<=[.;])\s+|(?<=\n))({key}(?:,\s+{key})*):\s+", text)
    said = zip(parts[1::2], parts[2::2], strict=True)
    return parts[0].strip(), {
        name.strip("` \n"): " ".join(meaning.split()).rstrip(";")
        for names, meaning in said
        for name in names.split(",")
    }


def _default(value: Mapping[str, Any]) -> str:
    given = value.get("default")
    return "" if given is None or isinstance(given, dict | list | tuple) else f"`{_plain(given)}`"


def _plain(value: Any) -> str:
    return {True: "true", False: "false"}.get(value, str(value)) if isinstance(value, bool) else str(value)


def _type(value: Mapping[str, Any]) -> str:
    """A type in words: what a key may hold."""
    if "$ref" in value:
        return value["$ref"].rsplit("/", 1)[-1]
    if "anyOf" in value or "oneOf" in value:
        kinds = [_type(each) for each in value.get("anyOf", value.get("oneOf", ()))]
        return " or ".join(each for each in dict.fromkeys(kinds) if each != "null")
    if "const" in value:
        return f"`{_plain(value['const'])}`"
    if "enum" in value:
        return ", ".join(f"`{_plain(each)}`" for each in value["enum"])
    if value.get("type") == "array":
        return _array_type(value)
    if value.get("type") == "object":
        inner = value.get("additionalProperties")
        return f"keys, each with {_type(inner)}" if isinstance(inner, dict) else "keys"
    return {"integer": "whole number", "null": "null", "string": "text", "boolean": "true or false"}.get(
        value.get("type", ""), value.get("type", "anything")
    ) + _range(value)


def _array_type(value: Mapping[str, Any]) -> str:
    if "prefixItems" in value:
        inside = [_type(each) for each in value["prefixItems"]]
        return f"list of {len(inside)}: {', '.join(dict.fromkeys(inside))}"
    return f"list of {_type(value.get('items', {}))}"


def _range(value: Mapping[str, Any]) -> str:
    bounds = {"minimum": "at least", "exclusiveMinimum": "above", "maximum": "at most", "exclusiveMaximum": "below"}
    said = [f"{words} {value[key]:g}" for key, words in bounds.items() if key in value]
    return f", {', '.join(said)}" if said else ""


def _escape(text: str) -> str:
    return text.replace("<", r"\<").replace("*", r"\*")


def _parameters_page() -> str:
    """Parameters of each algorithm with their defaults, and the file's docstring with its equations."""
    parts = [
        "Each algorithm with the keys that `params:` of a configuration takes, their defaults, and the update rule as "
        "its file has it. [The algorithms](../algorithms.md) says which form each is."
    ]
    for name in (*names(), *names_with_derivatives()):
        algorithm = load(name)
        rows = [(f"`{each.name}`", _field_default(each)) for each in fields(algorithm.Params)]
        parts += [f"## {name}"]
        if algorithm.Params.__doc__ and not algorithm.Params.__doc__.startswith(algorithm.Params.__name__):
            parts.append(_escape(inspect.cleandoc(algorithm.Params.__doc__)))
        parts.append(markdown_table(("parameter", "default"), rows) if rows else "No parameters.")
        parts.append(f"```text\n{inspect.getdoc(sys.modules[algorithm.__module__])}\n```")
    return markdown_page("Parameters of the algorithms", *parts)


def _field_default(each: Any) -> str:
    if each.default is not MISSING:
        return f"`{each.default}`"
    return f"`{each.default_factory()}`" if each.default_factory is not MISSING else "needed"
