"""JSON Schemas of the file formats, generated from the models that read and write the files.

`python -m armlab.schemas` writes the schemas anew after a model has changed.
"""

import json
from pathlib import Path

from pydantic import BaseModel
from pydantic.json_schema import GenerateJsonSchema

from armlab.diagnosis.formats import ComparisonFile, VerdictFile
from armlab.identification.model_file import ModelFile
from armlab.proof.open.real_folders.facts import FactsFile
from armlab.recordings.recording_file import RecordingFile
from problem.robot_file import RobotFile

SCHEMA_FOLDER = Path(__file__).parent
FORMATS: dict[str, type[BaseModel]] = {
    "robot": RobotFile,
    "recording": RecordingFile,
    "model": ModelFile,
    "verdict": VerdictFile,
    "comparison": ComparisonFile,
    "facts": FactsFile,
}


def schema_path(name: str) -> Path:
    """Where the schema of a format stands; name: a key of FORMATS."""
    return SCHEMA_FOLDER / f"{name}.schema.json"


def generate_schema(name: str) -> str:
    """The text of a format's schema; name: a key of FORMATS."""
    model = FORMATS[name]
    content = {"$schema": GenerateJsonSchema.schema_dialect, **model.model_json_schema()}
    return json.dumps(content, indent=1, ensure_ascii=False) + "\n"


def write_schemas() -> list[Path]:
    """Writes all schemas into the package and returns their paths."""
    for name in FORMATS:
        schema_path(name).write_text(generate_schema(name), encoding="utf-8")
    return [schema_path(name) for name in FORMATS]
