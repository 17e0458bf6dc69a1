"""motion-truth/1: the answer to a case of motion only. Joints and links count from 1."""

from pathlib import Path
from typing import Any, Literal

from pydantic import Field

from armlab.common.settings import Settings

TRUTH_SCHEMA_FILE = Path(__file__).parents[1] / "schemas" / "motion-truth.schema.json"


class HiddenDifference(Settings):
    """One hidden difference between the arm and its simulation file.

    effect: its name. equivalent: names that no motion tells from it. part: a name that is a part of its law. joint:
    null for all joints; of a payload the link. size: in the unit of its kind. falling: whether a torque limit falls
    with speed and supply. parameters: true numbers, SI units. wanted, multiple: detection limits, as drawn and as it
    is.
    """

    kind: str
    effect: str
    equivalent: tuple[str, ...]
    part: str
    joint: int | None
    size: float
    falling: bool
    parameters: dict[str, float]
    wanted: float
    multiple: float


class MotionTruth(Settings):
    """The answer to one case.

    law: of the drives. knowledge: what the recording says of them. rate_hz, hold_hz: how often commands come, and are
    taken over. counts: of the encoder, a turn. jitter_s: standard deviation of late stamps. read_gap_s: between the
    readings of two joints. motions: family of each run. passed_over: kinds that could not be seen. drives: true numbers
    of each joint by effect and parameter, SI units.
    """

    schema_: Literal["motion-truth/1"] = Field(alias="schema")
    case: str
    kind: Literal["null", "one", "two"]
    law: Literal["pd", "pid", "cascade", "PI cascade"]
    knowledge: Literal["known", "partly", "unknown"]
    joints: int
    rate_hz: float
    hold_hz: float
    counts: int
    jitter_s: float
    read_gap_s: float
    motions: tuple[str, ...]
    injected: tuple[HiddenDifference, ...]
    passed_over: tuple[str, ...]
    drives: tuple[dict[str, dict[str, float]], ...]


def truth_schema() -> dict[str, Any]:
    """The JSON Schema of motion-truth/1, as shipped in `TRUTH_SCHEMA_FILE`."""
    schema = MotionTruth.model_json_schema(by_alias=True, mode="serialization")
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}
