"""`names.json`: what each finding was weighed against, and what was not probable enough for a finding."""

import json
from collections.abc import Sequence
from dataclasses import asdict
from typing import Final

from armlab.diagnosis.result import Weighed
from armlab.diagnosis.settings import Settings
from armlab.diagnosis.torque.names.decide import with_probabilities

NAMES_SCHEMA: Final = "names/1"
NAMES_FILE: Final = "names.json"


def names_texts(findings: Sequence[Weighed], settings: Settings) -> dict[str, str]:
    """The file: of each finding its names, with what speaks for each and its probability; nothing without findings."""
    entries = [
        {"names": [{**asdict(name), "probability": chance} for name, chance in with_probabilities(weighed, settings)]}
        for weighed in findings
    ]
    content = {"schema": NAMES_SCHEMA, "findings": entries}
    return {NAMES_FILE: json.dumps(content, indent=1) + "\n"} if entries else {}
