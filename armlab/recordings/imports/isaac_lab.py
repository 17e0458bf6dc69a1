"""Actuators of an Isaac Lab configuration as the drive of a recording: read as text, nothing of it is run.

Of each call of an actuator's configuration class (isaaclab, `actuators/actuator_base_cfg.py`, `actuator_pd_cfg.py`)

    torque = clip(stiffness (q* - q) - damping qd, -effort_limit, effort_limit)

are read: joint_names_expr (names or regular expressions), stiffness, damping, and the limit of the effort, which is
called actuator_effort_limit or joint_effort_limit since 3.0, effort_limit or effort_limit_sim before. A number stands
for all joints of the group, a dictionary has numbers by expression.
"""

import ast
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from armlab.common.errors import InputError, in_one_line

IDEAL_CLASSES = ("ImplicitActuatorCfg", "IdealPDActuatorCfg", "DelayedPDActuatorCfg")
OTHER_CLASSES = ("DCMotorCfg", "RemotizedPDActuatorCfg", "ActuatorNetMLPCfg", "ActuatorNetLSTMCfg", "BamActuatorCfg")
LIMITS = ("actuator_effort_limit", "joint_effort_limit", "effort_limit", "effort_limit_sim")
NO_LIMIT = 1e9  # N m: what stands for no limit there


@dataclass(frozen=True)
class ActuatorGroup:
    """The fields of one configuration of actuators, as they are written."""

    name: str
    fields: Mapping[str, Any]

    def number(self, joint: str, keys: Sequence[str]) -> float | None:
        """What the first of the fields that is given says of a joint; None where none is."""
        for key in keys:
            value = self.fields.get(key)
            if isinstance(value, dict):
                value = next((own for expression, own in value.items() if re.fullmatch(expression, joint)), None)
            if value is not None:
                return float(value)
        return None

    def has(self, joint: str) -> bool:
        """Whether a joint belongs to the group."""
        given = self.fields["joint_names_expr"]
        expressions = [given] if isinstance(given, str) else given
        return any(re.fullmatch(expression, joint) for expression in expressions)


def read_isaac_lab(path: Path, joints: Sequence[str]) -> dict[str, list[float | None]]:
    """kp, kd and torque_limit by joint, SI units.

    Raises InputError for a file without such actuators, for a joint without one or with several, and for actuators
    with another law: a motor's limit that falls with speed, a network.
    """
    groups = tuple(_read_groups(path))
    if not groups:
        raise InputError(f"{path} has no actuators of Isaac Lab, such as {IDEAL_CLASSES[0]}(joint_names_expr=[...])")
    own = [_group_of(joint, groups, path) for joint in joints]
    pairs = list(zip(joints, own, strict=True))
    limits = [group.number(joint, LIMITS) for joint, group in pairs]
    return {
        "kp": [group.number(joint, ("stiffness",)) for joint, group in pairs],
        "kd": [group.number(joint, ("damping",)) for joint, group in pairs],
        "torque_limit": [None if limit is None or limit >= NO_LIMIT else limit for limit in limits],
    }


def _group_of(joint: str, groups: Sequence[ActuatorGroup], path: Path) -> ActuatorGroup:
    found = [group for group in groups if group.has(joint)]
    if len(found) != 1:
        raise InputError(f"{path} has {len(found) or 'no'} actuators for joint '{joint}': it should have one")
    if found[0].name in OTHER_CLASSES:
        raise InputError(f"{path}: the law of {found[0].name} of joint '{joint}' is no PD with a fixed limit")
    return found[0]


def _read_groups(path: Path) -> Iterator[ActuatorGroup]:
    try:
        tree = ast.parse(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, SyntaxError, RecursionError) as error:
        raise InputError(f"cannot read {path} as Python: {in_one_line(error)}") from None
    for node in ast.walk(tree):
        name = _called_name(node)
        if isinstance(node, ast.Call) and name in (*IDEAL_CLASSES, *OTHER_CLASSES):
            fields = {each.arg: _literal(each.value, each.arg, path) for each in node.keywords if each.arg in _FIELDS}
            if "joint_names_expr" not in fields:
                raise InputError(f"{path}, line {node.lineno}: {name} has no joint_names_expr")
            yield ActuatorGroup(name, {str(key): value for key, value in fields.items()})


_FIELDS = ("joint_names_expr", "stiffness", "damping", *LIMITS)


def _called_name(node: ast.AST) -> str:
    """The class that a call makes; empty for what is no call of a name."""
    if not isinstance(node, ast.Call):
        return ""
    function = node.func
    return function.attr if isinstance(function, ast.Attribute) else getattr(function, "id", "")


def _literal(value: ast.expr, key: str | None, path: Path) -> Any:
    """A number, a list or a dictionary that is written out."""
    try:
        found = ast.literal_eval(value)
        numbers = list(found.values()) if isinstance(found, dict) else [found]
        if key != "joint_names_expr":
            [float(number) for number in numbers if number is not None]
        return found
    except (ValueError, TypeError):
        raise InputError(f"{path}, line {value.lineno}: {key} should be written out as numbers") from None
