"""YAML files are read into plain data, and every mistake in one is told in one line."""

from pathlib import Path
from typing import Any

import pytest

from armlab.common.errors import InputError
from armlab.common.settings import MAX_YAML_BYTES, read_yaml


def _written(tmp_path: Path, content: str | bytes) -> Path:
    path = tmp_path / "file.yaml"
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


def _complaint(path: Path) -> str:
    with pytest.raises(InputError) as caught:
        read_yaml(path)
    message = str(caught.value)
    assert "\n" not in message
    assert path.name in message
    return message


@pytest.mark.parametrize(
    ("text", "content"),
    [
        ("a: 1e-8", {"a": 1e-8}),
        ("a: -2E5", {"a": -2e5}),
        ("a: 1e", {"a": "1e"}),
        ("a: .inf", {"a": float("inf")}),
        ("a: &x [1, 2]\nb: *x", {"a": [1, 2], "b": [1, 2]}),
        ("a: &x {b: 1}\nc: {<<: *x, b: 2}", {"a": {"b": 1}, "c": {"b": 2}}),
    ],
)
def test_yaml_is_read_with_its_numbers_and_aliases(tmp_path: Path, text: str, content: Any) -> None:
    assert read_yaml(_written(tmp_path, text)) == content


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("", "is empty"),
        ("# a comment only\n", "is empty"),
        ("a: 1\n\tb: 2", "line 2: not valid YAML"),
        ("a: 1\n\tb: 2", "indent with spaces"),
        ("a: [1", "not valid YAML"),
        ("a: 1\nb: 2\na: 3", "line 3: key 'a' stands there twice"),
        ("a: {b: .nan}", "line 1: .nan is not a number"),
        ("a: !!python/object/apply:os.getcwd []", "not valid YAML"),
        ("a: 1\n---\nb: 2", "line 2: not valid YAML"),
        ("{[1]: 2}", "unhashable key"),
        ("a: 2024-99-99", "not valid YAML"),
        ("a: \x01", "not valid YAML"),
        (b"\xff\xfe\x00", "not UTF-8"),
        ("[" * 10_000, "nested too deeply"),
        ("a" * (MAX_YAML_BYTES + 1), "larger than"),
        ("a: &a [*a]", "aliases unfold"),
    ],
)
def test_a_broken_file_is_refused_in_one_line(tmp_path: Path, content: str | bytes, said: str) -> None:
    assert said in _complaint(_written(tmp_path, content))


@pytest.mark.parametrize("layer", ["[*a{}, *a{}]", "{{<<: [*a{}, *a{}]}}"])
def test_a_bomb_of_aliases_is_refused_before_it_unfolds(tmp_path: Path, layer: str) -> None:
    layers = [f"a{k + 1}: &a{k + 1} {layer.format(k, k)}" for k in range(60)]  # 2**60 values
    assert "aliases unfold" in _complaint(_written(tmp_path, "\n".join(["a0: &a0 {x: 1}", *layers])))


def test_a_missing_file_and_a_folder_are_refused_in_one_line(tmp_path: Path) -> None:
    assert "No such file" in _complaint(tmp_path / "missing.yaml")
    assert "directory" in _complaint(tmp_path)
