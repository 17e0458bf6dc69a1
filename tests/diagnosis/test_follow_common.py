"""Changes are looked for again with columns that follow what the recordings have in common."""

from types import SimpleNamespace
from typing import Any

import pytest

from armlab.diagnosis.changes import comparison
from armlab.diagnosis.changes.comparison import ChangeLook, _followed
from armlab.diagnosis.changes.soundness import SoundChanges

TABLE: Any = SimpleNamespace(model=slice(None))


def changes(*groups: int) -> SoundChanges:
    named: Any = tuple(SimpleNamespace(group=each) for each in groups)
    return SoundChanges(named)


@pytest.mark.parametrize(
    ("found", "kept"),
    [
        ([(), ()], ()),
        ([(1,), (1,)], (1,)),
        ([(1,), (2,), (2,)], (2,)),
        ([(1,), (2,), (3,), (4,), (5,)], (2,)),
        ([(1,), ()], ()),
        ([(1,), (1, 2), ()], ()),
    ],
    ids=["none", "it stays", "another that stays", "they come and go", "it is gone", "both are gone"],
)
def test_a_change_lasts_beside_what_is_common_or_is_none(
    monkeypatch: pytest.MonkeyPatch, found: list[tuple[int, ...]], kept: tuple[int, ...]
) -> None:
    looks = iter(changes(*groups) for groups in found)
    first = ChangeLook(TABLE, TABLE, next(looks))
    monkeypatch.setattr(comparison, "follow_levels", lambda pooled, values: pooled)
    monkeypatch.setattr(comparison, "common_values", lambda table, named: [None])
    monkeypatch.setattr(comparison, "find_sound_changes", lambda pooled, table: next(looks))
    assert tuple(sorted(_followed(first, lambda pooled: TABLE).groups)) == kept
