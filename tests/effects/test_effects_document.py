"""docs/effects.md says of each effect and each of its forms what the library says."""

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from armlab.effects.contract import Effect
from armlab.effects.library import BUILT_IN
from armlab.effects.term import Term

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "docs" / "effects.md").read_text(encoding="utf-8")
FACTS = [family.facts for family in BUILT_IN]


def rows_under(heading: str) -> dict[str, str]:
    """Rows of the table that follows a heading row, by the effect in their first cell."""
    table = TEXT.split(heading)[1].split("\n\n")[0]
    rows = re.findall(r"^\| `(\w+)` \|.*$", table, re.MULTILINE)
    lines = [line for line in table.splitlines() if line.startswith("| `")]
    return dict(zip(rows, lines, strict=True))


def facts_row(effect: Effect) -> str:
    """The row that the facts of an effect have in the second table."""
    marks = ("usual", "dissipates", "sticks", "scanned", "single_event", "last_resort")
    kept = ", ".join(mark.replace("_", " ") for mark in marks if getattr(effect, mark))
    contained = ", ".join(f"`{name}`" for name in effect.contains)
    scale = "" if effect.prior_scale == float("inf") else f"{effect.prior_scale:g}"
    cells = (f"`{effect.id}`", effect.meaning, effect.where, kept, contained, effect.one_of, scale, effect.axis)
    return f"| {' | '.join((*cells, effect.experiment))} |"


def forms() -> Iterator[tuple[str, str]]:
    waiting = [Term]
    while waiting:
        term = waiting.pop()
        waiting += term.__subclasses__()
        if term.__module__.startswith("armlab.") and term.form:
            yield term.facts.id, term.form


LAWS = rows_under("| effect | law |")
KNOWN = rows_under("| effect | meaning |")


def test_each_effect_has_a_law_in_the_order_of_the_library() -> None:
    assert list(LAWS) == [each.id for each in FACTS]


@pytest.mark.parametrize("effect", FACTS, ids=lambda effect: effect.id)
def test_the_document_repeats_the_facts_of_each_effect(effect: Effect) -> None:
    assert KNOWN[effect.id] == facts_row(effect)


@pytest.mark.parametrize(("effect", "form"), sorted(set(forms())))
def test_each_form_of_an_effect_stands_beside_its_law(effect: str, form: str) -> None:
    assert f"*{form}*" in LAWS[effect]


@pytest.mark.parametrize("effect", FACTS, ids=lambda effect: effect.id)
def test_each_parameter_of_an_effect_stands_in_its_row(effect: Effect) -> None:
    assert [each.name for each in effect.parameters if each.name not in LAWS[effect.id]] == []
