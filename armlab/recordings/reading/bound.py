"""The bound that a reading mistake has to reach, as `armlab calibrate-reading` computed it on real arms."""

import json
from pathlib import Path
from typing import Final

BOUND_FILE: Final = "bound.json"
BOUND_SCHEMA: Final = "reading-bound/1"


def learnt_bound() -> float:
    """What a mistake has to explain beyond chance, nats."""
    content = json.loads((Path(__file__).parent / BOUND_FILE).read_text(encoding="utf-8"))
    return float(content["bound"])
