"""The names that a diagnosis weighed in random cases of real recordings, and which are right."""

import json
from pathlib import Path

from armlab.common.errors import InputError
from armlab.proof.blind.real.real_score import TIER
from armlab.proof.blind.score.weighed_names import WeighedFinding, check_development

WEIGHED_FILE = "weighed.json"


def read_weighed_real(folder: Path) -> tuple[str, list[tuple[str, WeighedFinding]]]:
    """What a development set is, and its weighed findings, each with the name of its recording.

    folder: of the tables of `armlab proof run --tier real`. Raises InputError for one without
    them, or of a set that judges.
    """
    try:
        content = json.loads((folder / WEIGHED_FILE).read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise InputError(f"{folder} has no {WEIGHED_FILE}: `armlab proof run --tier real` writes it") from None
    seed = int(content["seed"])
    check_development(seed, folder)
    found = [
        (
            each["recording"],
            WeighedFinding(
                case=f"{seed} {each['recording']} {each['case']}",
                tier=TIER,
                names=tuple(each["numbers"]),
                right=tuple(each["right"]),
                background=each["background"],
            ),
        )
        for each in content["findings"]
    ]
    cases = {each.case for _, each in found}
    return f"real recordings, seed {seed}: {len(cases)} cases", found
