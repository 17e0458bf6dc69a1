"""Every source that a text names by author and year stands in docs/references.bib."""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
NAME = r"[A-Z][\w’-]*[a-zé]"
NAMES = rf"{NAME}(?:, {NAME})*(?:,? and {NAME}| et al\.)?"
CITATION = re.compile(rf"\b({NAMES}) \(?((?:19|20)\d\d[a-z]?)\b")
NO_AUTHORS = {"Windows", "Version", "Since", "Seed"}


def citations(text):
    """Pairs of names and year, as `Shi and Eberhart 1998a` or `Huber (1964)`."""
    found = CITATION.findall(" ".join(text.split()))
    return [(re.findall(NAME, names), year) for names, year in found if names not in NO_AUTHORS]


def entries():
    """The fields of each entry by its key, accents left out."""
    text = (ROOT / "docs" / "references.bib").read_text(encoding="utf-8")
    plain = re.sub(r"\\.|[{}]", "", re.sub(r"\{\\([\"'~v])?\{?(\w)\}?\}", r"\2", text))
    keys = re.findall(r"^@\w+\{(\w+),$", text, re.MULTILINE)
    bodies = re.split(r"^@\w+", plain, flags=re.MULTILINE)[1:]
    return dict(zip(keys, bodies, strict=True))


def has_entry(names, year, known):
    letters = [plain(name) for name in names if name != "al"]
    return any(
        f"year = {year[:4]}" in body
        and (year[4:] == "" or key.endswith(year))
        and all(letter in plain(body) for letter in letters)
        for key, body in known.items()
    )


def plain(text):
    return text.replace("é", "e").replace("ä", "a").replace("š", "s").replace("’", "'").lower()


def docstrings_and_comments(path):
    source = path.read_text(encoding="utf-8")
    nodes = [
        node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef)
    ]
    comments = [line.split("#", 1)[1] for line in source.splitlines() if "#" in line]
    return [*(ast.get_docstring(node) or "" for node in nodes), *comments]


PYTHON_FILES = [
    path
    for folder in ("algorithms", "problem", "bench", "armlab", "templates")
    for path in (ROOT / folder).rglob("*.py")
]


def test_every_source_named_in_code_has_an_entry():
    known = entries()
    missing = {
        f"{path.relative_to(ROOT)}: {' '.join(names)} {year}"
        for path in PYTHON_FILES
        for text in docstrings_and_comments(path)
        for names, year in citations(text)
        if not has_entry(names, year, known)
    }
    assert not missing


@pytest.mark.parametrize("path", sorted((ROOT / "docs").glob("*.md")), ids=lambda path: path.name)
def test_every_source_named_in_the_documentation_has_an_entry(path):
    known = entries()
    missing = [each for each in citations(path.read_text(encoding="utf-8")) if not has_entry(*each, known)]
    assert not missing


def test_citations_are_seen_in_every_form_that_texts_use():
    text = (
        "as Shi and\nEberhart 1998b advise (Huber 1964); White (1980); Wensing, Kim and Slotine 2018; Gaz et al. 2019"
    )
    assert [(names[0], year) for names, year in citations(text)] == [
        ("Shi", "1998b"),
        ("Huber", "1964"),
        ("White", "1980"),
        ("Wensing", "2018"),
        ("Gaz", "2019"),
    ]


def test_a_source_without_an_entry_or_with_another_year_is_seen():
    known = entries()
    assert has_entry(["Storn", "Price"], "1997", known)
    assert not has_entry(["Storn", "Price"], "1996", known)
    assert not has_entry(["Storn", "Prize"], "1997", known)
    assert not has_entry(["Shi", "Eberhart"], "1998c", known)


def test_keys_are_unique_and_entries_that_have_an_author_and_a_year_are_named_by_them():
    text = (ROOT / "docs" / "references.bib").read_text(encoding="utf-8")
    keys = re.findall(r"^@\w+\{(\w+),$", text, re.MULTILINE)
    assert len(keys) == len(set(keys)) > 60
    assert text.count("{") == text.count("}")
    for key, body in entries().items():
        year = re.search(r"year = (\d{4})", body)
        assert year is None or year.group(1) in key
