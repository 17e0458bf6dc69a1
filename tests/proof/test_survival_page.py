"""The page of names that survive: how many are right, by how often they return."""

from pathlib import Path

import pandas as pd

from armlab.proof.blind.score.survival import COLUMNS, survival_rows, write_survival

NAMES = pd.DataFrame(
    [
        ("a", "clean", "backlash", 1, 0.95, 8, 8, 0, 4, True),
        ("a", "clean", "payload", 3, 0.97, 8, 8, 2, 4, True),
        ("b", "clean", "time_delay", None, 0.6, 3, 8, 0, 0, False),
    ],
    columns=COLUMNS,
)


def test_names_are_counted_by_how_often_they_return_appear_and_by_their_probability() -> None:
    counts = {name: count for name, count, _ in survival_rows(NAMES)}
    assert list(counts.values()) == ["2", "0", "1", "1", "1", "2", "1"]
    rights = {name: right.split(" ")[0] for name, _, right in survival_rows(NAMES)}
    assert rights["returns in 0.9 to 1"] == "100%"
    assert rights["returns in 0 to 0.5"] == "0%"


def test_the_page_says_where_no_name_is_wrong(tmp_path: Path) -> None:
    said = {}
    for own in (NAMES, NAMES[NAMES["right"]]):
        _, page = write_survival(own, "2 cases", tmp_path)
        said[len(own)] = "No name of them is wrong" in page.read_text(encoding="utf-8")
    assert said == {3: False, 2: True}
