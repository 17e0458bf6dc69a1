"""The JSON Schemas that the package ships, to hold files against."""

import json
from typing import Any

import jsonschema

from armlab.schemas import schema_path


def check_against_schema(content: Any, name: str) -> None:
    """Raises jsonschema.ValidationError where the content of a file breaks the schema of its format."""
    jsonschema.validate(json.loads(json.dumps(content)), json.loads(schema_path(name).read_text(encoding="utf-8")))
