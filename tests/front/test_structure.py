"""The layout of the source: names that a reader can tell apart."""

import ast
from pathlib import Path

from tools.structure import longest_chain, names_twice, read_sources


def test_no_class_name_and_no_file_name_stands_twice_in_a_package() -> None:
    sources = read_sources(Path(__file__).parents[2])
    assert names_twice({path: ast.parse(text) for path, text in sources.items()}) == {}


def test_a_name_is_found_where_it_stands_twice() -> None:
    study, other_study = Path("bench/studies/a/study.py"), Path("bench/studies/b/study.py")
    assert names_twice({study: ast.parse(""), other_study: ast.parse("")}) == {"bench: study.py": [study, other_study]}

    one, other = Path("armlab/proof/a/page.py"), Path("armlab/proof/b/page.py")
    elsewhere = Path("armlab/report/plan.py")
    trees = {one: ast.parse("class Plan: ..."), other: ast.parse(""), elsewhere: ast.parse("class Plan: ...")}
    assert names_twice(trees) == {"armlab/proof: page.py": [one, other]}
    assert names_twice(trees | {other: ast.parse("class Plan: ...")}).keys() == {
        "armlab/proof: page.py",
        "armlab/proof: Plan",
    }


def test_the_longest_chain_counts_modules_of_a_package() -> None:
    importers = {"a.low": {"a.middle", "a.high"}, "a.middle": {"a.high"}, "b.other": {"a.low"}}
    assert longest_chain(importers, "a.") == ["a.high", "a.middle", "a.low"]
