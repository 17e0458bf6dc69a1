"""Names that were weighed in random cases of real recordings, as the calibration reads them."""

import json
from pathlib import Path

import pytest

from armlab.common.errors import InputError
from armlab.proof.blind.real.real_names import read_weighed_real


def _write(folder: Path, seed: int) -> Path:
    names = {"numbers": [{"is payload": 1.0}, {"found none": 1.0}], "right": [True, False], "background": False}
    content = {"schema": "weighed/1", "seed": seed, "findings": [{"recording": "emps", "case": 3, **names}]}
    (folder / "weighed.json").write_text(json.dumps(content))
    return folder


def test_a_finding_has_its_recording_and_its_names(tmp_path: Path) -> None:
    about, ((recording, finding),) = read_weighed_real(_write(tmp_path, 1002))
    assert about == "real recordings, seed 1002: 1 cases"
    assert (recording, finding.case, finding.tier) == ("emps", "1002 emps 3", "real")
    assert finding.names == ({"is payload": 1.0}, {"found none": 1.0})
    assert (finding.right, finding.background) == ((True, False), False)


def test_nothing_is_learnt_from_a_set_that_judges(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="take a development set"):
        read_weighed_real(_write(tmp_path, 46_000))


def test_a_folder_without_the_file_is_told_what_writes_it(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"weighed\.json: `armlab proof run --tier real` writes it"):
        read_weighed_real(tmp_path)
