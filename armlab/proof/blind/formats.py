"""The files that seal a concealed set: truth/1, the answer to one case, and manifest/1, the seal of all files.

Every reader and writer of these files goes through the models of this module. Joints and links count from 1.
"""

import json
from pathlib import Path
from typing import Any, Literal, TypeVar

from pydantic import Field

from armlab.common.settings import Settings, read_json, validate

TRUTH_SCHEMA_FILE = Path(__file__).parent / "schemas" / "truth.schema.json"
Tier = Literal["clean", "realistic"]
EngineName = Literal["mujoco", "sticking"]
CaseKind = Literal["single", "pair", "triple", "outside", "decoy", "null"]
SetKind = Literal["mixed", "nulls"]
SetTier = Literal["clean", "realistic", "both"]


class TrueParameter(Settings):
    """One parameter of an effect. comparable: whether it means the same in the law that a diagnosis fits."""

    value: float | tuple[float, ...]
    unit: str
    comparable: bool


class TrueEffect(Settings):
    """One effect that was simulated.

    joint: its joint or link, null for the whole robot. joints: where its torque appears, and where the motion is.
    outside: whether it has no name in the library. form: its law. obvious_form: whether anyone would fit this law
    first. equivalent: names that together, at the same joint, say the same. size: in the unit of its main
    parameter. shape: the other numbers of its law.
    """

    effect: str
    joint: int | None
    joints: tuple[int, ...]
    outside: bool
    form: str
    obvious_form: bool
    equivalent: tuple[str, ...]
    parameters: dict[str, TrueParameter]
    size: float
    shape: dict[str, float]


class InjectedEffect(TrueEffect):
    """A hidden effect. target, multiple: its size in detection limits, as aimed at and as simulated."""

    target: float
    multiple: float


class LinkDeviation(Settings):
    """A link that differs from the nominal arm by a relative error."""

    effect: Literal["inertial_parameter_error"]
    joint: int
    relative: float


class TrueNoise(Settings):
    """Noise of the torque channels. white, coloured: standard deviation at each joint, N m. corner_hz: of coloured."""

    kind: str
    white: tuple[float, ...]
    coloured: tuple[float, ...]
    corner_hz: float


class Truth(Settings):
    """The answer to one case.

    engine: which simulated it. joints: number of joints. motions: family of motions of each run. injected: hidden
    effects. passed_over: effects that were drawn first and could not be seen. background: friction and offsets that
    stand beside the hidden effects. cad_errors: links that differ from the nominal arm. absorbed_rotors: joints whose
    rotor no motion separates from the links. noise_floor: RMS of the recorded noise at each joint, N m.
    """

    schema_: Literal["truth/1"] = Field(alias="schema")
    case: str
    tier: Tier
    kind: CaseKind
    engine: EngineName = "mujoco"
    arm: str
    joints: int
    rate_hz: int
    motions: tuple[str, ...]
    injected: tuple[InjectedEffect, ...]
    passed_over: tuple[str, ...]
    background: tuple[TrueEffect, ...]
    cad_errors: tuple[LinkDeviation, ...]
    absorbed_rotors: tuple[int, ...]
    noise: TrueNoise
    noise_floor: tuple[float, ...]

    @property
    def beside(self) -> tuple[TrueEffect | LinkDeviation, ...]:
        """What differs from the nominal arm beside the hidden effects."""
        return (*self.background, *self.cad_errors)

    @property
    def present(self) -> tuple[TrueEffect | LinkDeviation, ...]:
        """Everything that differs from the nominal arm."""
        return (*self.injected, *self.beside)


class Manifest(Settings):
    """The seal of a set. cases: names, sorted. files: SHA-256 by path from the set's folder."""

    schema_: Literal["manifest/1"] = Field(alias="schema")
    cases: tuple[str, ...]
    seed: int
    files: dict[str, str]


class SetManifest(Manifest):
    """The seal of a torque set."""

    tier: SetTier
    kind: SetKind
    development: bool


FileModel = TypeVar("FileModel", bound=Settings)


def read_model(model: type[FileModel], path: Path) -> FileModel:
    """The checked content of a JSON file; InputError, in one line, for a file that is missing or not of the model."""
    return validate(model, read_json(path), str(path))


def write_model(content: Truth | Manifest, path: Path) -> None:
    """Writes a file of this module as JSON."""
    path.write_text(json.dumps(content.model_dump(mode="json", by_alias=True), indent=1) + "\n", encoding="utf-8")


def truth_schema() -> dict[str, Any]:
    """The JSON Schema of truth/1, as shipped in `TRUTH_SCHEMA_FILE`."""
    schema = Truth.model_json_schema(by_alias=True, mode="serialization")
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}
