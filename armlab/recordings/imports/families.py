"""Columns of a log in families: one signal, one column a joint. What their names say of it, and which are not used."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from os.path import commonprefix

import numpy as np

from armlab.recordings.imports.recognition import STEMS, owners_of, split_name
from armlab.recordings.table import Table

MAX_LISTED_COLUMNS = 3  # of a signal; of more, numbered in a row, the first and the last are named
MAX_LISTED_FAMILIES = 12  # of columns that are not used
TORQUE_WORDS = frozenset(("tau", "tor", "torque", "torques", "trq", "effort", "moment"))
VELOCITY_WORDS = frozenset(("v", "vel", "velocity", "velocities", "speed", "qd", "dq", "omega"))
MEASURED_WORDS = frozenset(
    ("act", "actual", "meas", "measured", "msr", "sensor", "cur", "current", "fb", "feedback", "raw")
)
OTHER_WORDS = frozenset(
    (
        *("c", "cmd", "command", "commanded", "d", "des", "desired", "ref", "reference", "target", "goal", "set"),
        *("setpoint", "cmptd", "computed", "est", "estimated", "hat", "model", "predicted", "sim", "simulated", "ext"),
        *("external", "err", "error", "ff", "feedforward", "nom", "nominal", "grav", "gravity"),
    )
)  # of what a controller wants or a model computes


@dataclass(frozen=True)
class Family:
    """Columns whose names differ in the joint alone, in the order of the file."""

    names: tuple[str, ...]

    @property
    def words(self) -> frozenset[str]:
        """Words of the first name, in small letters: `tor`, `kd`, `est` of `torKdEst`."""
        return words_of(self.names[0])

    @property
    def text(self) -> str:
        """The columns as they are listed."""
        return list_columns(self.names)


def words_of(name: str) -> frozenset[str]:
    """The words of a column's name, in small letters."""
    return frozenset(word.lower() for word in re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+", name))


def find_families(names: Sequence[str], joints: Sequence[str]) -> tuple[Family, ...]:
    """The families of a log's columns; of a robot with one joint each column is one."""
    groups: dict[str, list[str]] = {}
    for name, owner in zip(names, owners_of(names, joints), strict=True):
        numbered = re.fullmatch(r"(.*?)\d+(\D*)", name)
        if len(joints) == 1:
            label = name
        elif owner:
            label = name.replace(owner, "*")
        else:
            label = f"{numbered[1]}*{numbered[2]}" if numbered else name
        groups.setdefault(label, []).append(name)
    return tuple(Family(tuple(group)) for group in groups.values())


def rival_torques(table: Table, taken: Sequence[str], joints: Sequence[str]) -> tuple[Family, ...]:
    """The torques, one a joint, that a log may have been meant to give: those taken first, then others.

    Empty where the names taken are those of a driver, and where the others never change, or a controller or a model
    made them, by their names.
    """
    known = STEMS.get(split_name(taken[0]).stem)
    if known is not None and known.writer is not None:
        return ()
    own = set(taken)
    families = find_families(table.filled, joints)
    others = [
        each
        for each in families
        if len(each.names) == len(joints)
        and not own & set(each.names)
        and each.words & TORQUE_WORDS
        and not each.words & OTHER_WORDS
        and np.any(np.nanmax(table.view(each.names, "torque"), axis=0) > np.nanmin(table.view(each.names, "torque"), 0))
    ]
    return (Family(tuple(taken)), *others) if others else ()


def choose_measured(names: Sequence[str], count: int) -> tuple[str, ...]:
    """The names without those of what a controller wants or a model computes; of too many, those called measured."""
    kept = [name for name in names if not words_of(name) & OTHER_WORDS] or list(names)
    measured = [name for name in kept if words_of(name) & MEASURED_WORDS]
    return tuple(measured if measured and len(kept) > count else kept)


def describe_unused(names: Sequence[str], joints: Sequence[str]) -> str:
    """The columns that are not used, family by family, with the option that uses a velocity."""
    families = find_families(names, joints)
    texts = [each.text for each in families[:MAX_LISTED_FAMILIES]]
    hidden = sum(len(each.names) for each in families[MAX_LISTED_FAMILIES:])
    more = [f"and {hidden} more"] if hidden else []
    speeds = [each for each in families if each.words & VELOCITY_WORDS and not each.words & OTHER_WORDS]
    fitting = [each for each in speeds if len(each.names) == len(joints)]
    hint = f"; --velocity {_pattern_of(fitting[0].names, names)} compares a velocity with positions" if fitting else ""
    return ", ".join([*texts, *more]) + hint


def _pattern_of(family: Sequence[str], names: Sequence[str]) -> str:
    """`'Velocity*'` where it names these columns of all and no others, else their names.

    The pattern has the common start and the common end: columns that are in use may start alike.
    """
    first = commonprefix(family)  # noqa: RUF071 - of names, not of paths
    last = commonprefix([name[len(first) :][::-1] for name in family])[::-1]  # noqa: RUF071 - of names too
    pattern = f"{first}*{last}"
    found = [name for name in names if fnmatchcase(name, pattern)]
    return f"'{pattern}'" if len(family) > 1 and found == list(family) else ",".join(family)


def list_columns(names: Sequence[str]) -> str:
    """All names, or the first and the last of names that differ in a number that counts up alone."""
    parts = [re.fullmatch(r"(.*?)(\d+)(\D*)", name) for name in names]
    found = [part.groups() for part in parts if part]
    if len(names) > MAX_LISTED_COLUMNS and len(found) == len(names):
        counts = [int(number) for _, number, _ in found]
        is_alike = len({(stem, end) for stem, _, end in found}) == 1
        if is_alike and counts == list(range(counts[0], counts[0] + len(counts))):
            return f"{names[0]} ... {names[-1]}"
    return ", ".join(names)
