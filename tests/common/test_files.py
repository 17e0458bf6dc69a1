"""Files are whole or not at all."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from armlab.common.errors import InputError
from armlab.common.files import write_texts, write_whole


def test_a_write_that_breaks_off_leaves_the_old_file_and_nothing_else(tmp_path: Path) -> None:
    def pieces() -> Iterator[bytes]:
        yield b"half of the new one"
        raise KeyboardInterrupt

    path = tmp_path / "table.csv"
    write_whole(path, "old")
    with pytest.raises(KeyboardInterrupt):
        write_whole(path, pieces())
    assert [(file.name, file.read_text()) for file in tmp_path.iterdir()] == [("table.csv", "old")]


@pytest.mark.parametrize("content", ["über\n", "über\n".encode(), [b"\xc3", b"\xbcber\n"]])
def test_text_bytes_and_pieces_give_the_same_file(content: str | bytes | list[bytes], tmp_path: Path) -> None:
    write_whole(tmp_path / "file", content)
    assert (tmp_path / "file").read_bytes() == b"\xc3\xbcber\n"


def test_texts_are_written_all_or_none_and_other_files_stay(tmp_path: Path) -> None:
    folder = tmp_path / "out"
    assert write_texts({"a.txt": "1", "sub/b.txt": "2"}, folder) == (folder / "a.txt", folder / "sub" / "b.txt")
    (folder / "other").write_text("kept")
    (folder / "c.txt").mkdir()
    with pytest.raises(InputError, match=r"c\.txt is a folder, where a file should be written"):
        write_texts({"a.txt": "3", "c.txt": "4"}, folder)
    assert (folder / "a.txt").read_text() == "1"
    assert sorted(path.name for path in folder.iterdir()) == ["a.txt", "c.txt", "other", "sub"]
    write_texts({"a.txt": "5"}, folder)
    assert ((folder / "a.txt").read_text(), (folder / "other").read_text()) == ("5", "kept")


def test_a_place_below_a_file_is_refused_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("kept")
    with pytest.raises(InputError, match=r"cannot write .*file/table\.csv: Not a directory"):
        write_whole(tmp_path / "file" / "table.csv", "new")
