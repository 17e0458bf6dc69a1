"""Every refusal of a recording folder, with the file and the settings that cause it: clock, repairs and channels."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from recording_folders import POSITION, RATE_HZ, SETTINGS, TORQUE, folder_with, frame
from refusals import lines_passed, refusing_lines

import armlab.recordings
from armlab.common.errors import InputError
from armlab.recordings.load import load_recording

READERS = [Path(armlab.recordings.__file__).parent / name for name in ("clock.py", "repair.py", "channels.py")]
UNITS, COLUMNS = SETTINGS["units"], SETTINGS["columns"]


@dataclass(frozen=True)
class Refusal:
    """says: in the line. change: of a sound run. settings: beside those of a sound folder."""

    says: str
    change: Callable[[pd.DataFrame], pd.DataFrame] = lambda table: table
    settings: dict[str, Any] = field(default_factory=dict)


def shuffled(table: pd.DataFrame) -> pd.DataFrame:
    """The rows of two episodes in no order."""
    return pd.concat([table, frame(1)]).sample(frac=1.0, random_state=0)


def in_single_precision(table: pd.DataFrame) -> pd.DataFrame:
    return table.assign(t=(table["t"] + 1_767_225_600).astype("float32").astype(float))


def with_zeros(table: pd.DataFrame) -> pd.DataFrame:
    """Every fifth row holds zeros alone."""
    out = table.copy()
    out.loc[out.index % 5 == 2, [*POSITION, *TORQUE]] = 0.0
    return out


def with_gaps(table: pd.DataFrame) -> pd.DataFrame:
    """Half of the run in pieces of 40 rows, 0.2 s apart."""
    return table[(table["t"] < 4.0) | (table.index % 80 < 40)]


def in_turn(table: pd.DataFrame) -> pd.DataFrame:
    """Positions and torques in alternate rows."""
    odd = table.index % 2 > 0
    changed = {name: table[name].where(odd) for name in TORQUE} | {name: table[name].where(~odd) for name in POSITION}
    return table.assign(**changed)


def run_entry(**keys: Any) -> dict[str, Any]:
    return {"runs": [{"file": "run.csv", "role": "identify", **keys}]}


REFUSALS = (
    Refusal("do several logs or drivers share the file? Import them apart", shuffled),
    Refusal(
        "the time stands still at 3 s: which column holds the time, or has it too few digits?",
        lambda each: each.assign(t=3.0),
    ),
    Refusal("1592 of 1600 rows have the stamp of the row before", lambda each: each.assign(t=np.floor(each["t"]))),
    Refusal("more than a tenth", with_gaps),
    Refusal("49 samples in a row at most; at least 50 are needed", lambda each: each.iloc[:49]),
    Refusal("its signals stand in different rows: `armlab recording import` puts them on common stamps", in_turn),
    Refusal(
        "too many to repair; export the run again", lambda each: each.assign(q1=each["q1"].where(each.index % 5 > 0))
    ),
    Refusal("column tau2 (torque) holds no number in any row", lambda each: each.assign(tau2=np.nan)),
    Refusal("320 of 1600 rows hold zeros alone", with_zeros),
    Refusal("holds no row: its time runs from 0 s to 7.995 s", settings=run_entry(exclude=[[20.0, 30.0]])),
    Refusal("leaves no row: leave the run out", settings=run_entry(exclude=[[-1.0, 30.0]])),
    Refusal("single precision counts in steps of 128 s there", in_single_precision),
    Refusal("1600 of 1600 rows hold a value that is not", lambda each: each.assign(t=1e300 * (1 + each["t"]))),
    Refusal("unknown signal: did you mean 'torque'?", settings={"units": {**UNITS, "torqe": "N.m"}}),
    Refusal("is A or V: `gains` (N.m per A or V) are missing", settings={"units": {**UNITS, "torque": "A"}}),
    Refusal(
        "names 2 columns, but the robot has 3 joints",
        settings={"columns": {**COLUMNS, "link_position": ["l1", "l2"]}},
    ),
    Refusal("is revolute, so rad and N.m fit, not m", settings={"units": {**UNITS, "position": "m"}}),
    Refusal(
        "gains in",
        settings={"units": {**UNITS, "torque": "A"}, "gains": [1.0, 0.0, 1.0]},
    ),
    Refusal("but the robot has 3 joints: another robot, or is", settings={"columns": {**COLUMNS, "position": ["q1"]}}),
    Refusal(
        "transmission.position in",
        settings={"transmission": {"position": [[1.0, 0.0], [0.0, 1.0]]}},
    ),
    Refusal("should hold 3 numbers, not 2", settings={"transmission": {"offset": [0.0, 0.0]}}),
    Refusal(
        "timing.torque_delay should hold one number or 3, not 2", settings={"timing": {"torque_delay": [0.0, 0.1]}}
    ),
    Refusal("torque that is 9 s late leaves nothing of the run", settings={"timing": {"torque_delay": 9.0}}),
    Refusal("should be 1e+06 at most: another unit?", lambda each: each.assign(t=each["t"] / 1e6)),
    Refusal(
        "its stamps are in ms, give `units: {time: ms}`",
        lambda each: each.assign(t=each["t"] * 1e3),
        {"sample_rate_hz": RATE_HZ},
    ),
)


def refuse(case: Refusal, folder: Path) -> InputError:
    """The refusal of a folder."""
    alone = {"runs": SETTINGS["runs"][:1], **case.settings}
    with pytest.raises(InputError) as raised:
        load_recording(folder_with(folder, case.change(frame()), alone))
    return raised.value


@pytest.mark.parametrize("case", REFUSALS, ids=lambda case: case.says)
def test_a_folder_is_refused_in_one_line_that_names_the_cause(case: Refusal, tmp_path: Path) -> None:
    said = str(refuse(case, tmp_path))
    assert case.says in said
    assert "\n" not in said


def test_every_refusal_of_the_readers_is_caused_by_an_input_of_the_list(tmp_path: Path) -> None:
    known = refusing_lines(READERS)
    for number, case in enumerate(REFUSALS):
        for place in lines_passed(refuse(case, tmp_path / str(number))):
            known.pop(place, None)
    assert not known, "\n".join(f"{file}:{line}: {text}" for (file, line), text in known.items())
