"""The properties page: one row an algorithm, and a centre-biased one is called so."""

from pathlib import Path

import pandas as pd
import pytest
from refusals import refusal

from bench.studies.properties import AlgorithmProperties, write_properties


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("properties")
    write_properties(["gwo", "spso", "de"], folder)
    return folder


def test_the_table_has_translation_scale_noise_bounds_and_overhead_of_each_algorithm(written: Path) -> None:
    table = pd.read_csv(written / "properties.csv").set_index("algorithm")
    assert list(table.index) == ["gwo", "spso", "de"]
    assert table.loc["gwo", "translation"] > 0.1
    assert table.loc[["spso", "de"], "translation"].max() < 1e-12
    assert table["scale"].max() == 0.0
    assert table.loc["de", "on_bounds_clip"] > 0.1
    assert table["on_bounds_reflect"].max() == 0.0
    assert (table["overhead"] > 0).all()


def test_an_algorithm_that_is_drawn_to_the_origin_is_called_so_on_the_page(written: Path) -> None:
    lines = (written / "properties.md").read_text().splitlines()
    (gwo,) = [line for line in lines if line.startswith("| gwo ")]
    (spso,) = [line for line in lines if line.startswith("| spso ")]
    assert "depends on where the origin of coordinates lies" in gwo
    assert spso.endswith("| no bias seen |")


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({}, "no bias seen"),
        ({"translation": 0.1}, "depends on where the origin of coordinates lies"),
        ({"scale": 0.1}, "depends on the unit of its coordinates"),
        ({"noise_p_value_clip": 1e-9}, "piles up on clipped bounds"),
        (
            {"noise_p_value_clip": 1e-9, "noise_p_value_reflect": 1e-9},
            "favours some places of the search box even where the objective is pure noise",
        ),
    ],
)
def test_each_bias_has_its_words(changed: dict[str, float], said: str) -> None:
    fair = {"translation": 1e-13, "scale": 0.0, "noise_p_value_clip": 0.4, "noise_p_value_reflect": 0.6}
    facts = AlgorithmProperties(
        algorithm="mine", **{**fair, **changed}, on_bounds_clip=0.0, on_bounds_reflect=0.0, overhead=1.0
    )
    assert facts.verdict == said


def test_an_unknown_algorithm_is_told_in_one_line(tmp_path: Path) -> None:
    assert "did you mean 'spso'?" in refusal(write_properties, ["spsoo"], tmp_path)
