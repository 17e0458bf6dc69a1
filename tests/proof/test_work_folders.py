"""A work folder belongs to one set, and to nothing else."""

from dataclasses import dataclass
from pathlib import Path

import pytest

from armlab.common.errors import InputError
from armlab.proof.blind.folders import claim_folder


@dataclass(frozen=True)
class Settings:
    seed: int


def test_a_folder_is_claimed_again_by_its_own_set_alone(tmp_path: Path) -> None:
    claim_folder(Settings(1), tmp_path / "work", ("truth",))
    claim_folder(Settings(1), tmp_path / "work", ("truth",))
    assert (tmp_path / "work" / "truth").is_dir()
    with pytest.raises(InputError, match="another set"):
        claim_folder(Settings(2), tmp_path / "work")


def test_a_folder_with_files_of_somebody_is_not_taken(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("mine")
    with pytest.raises(InputError, match="holds no set"):
        claim_folder(Settings(1), tmp_path)
    assert [each.name for each in tmp_path.iterdir()] == ["thesis.tex"]
