"""The tree of joints of a robot file, before it is an arm: where arms end, and what to lock so that one is left."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from armlab.common.errors import InputError, UndecidedError
from armlab.common.settings import suggest_name


@dataclass(frozen=True)
class Follower:
    """A joint that moves with another one: position = multiplier * that of the leader + offset."""

    leader: str
    multiplier: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True)
class TreeJoint:
    """A joint between two links. moves: false for a fixed one. limits: of its position, rad or m."""

    name: str
    parent: str
    child: str
    moves: bool = True
    limits: tuple[float, float] = (-np.inf, np.inf)
    follows: Follower | None = None

    @property
    def free(self) -> bool:
        """Whether it moves on its own."""
        return self.moves and self.follows is None


@dataclass(frozen=True)
class KinematicTree:
    """All joints of a robot file; where: the file, for messages."""

    where: str
    joints: tuple[TreeJoint, ...]

    def locked_positions(self, tip: str | None, given: Mapping[str, float]) -> dict[str, float]:
        """The joints to lock, each with its position, rad or m.

        tip: the link where the arm ends: all moving joints that are not on the way from the base to it are locked, at
        zero or at the limit next to it where nothing else is given. given: positions of joints to lock by name. A joint
        that follows a locked one is locked with it, and one that leads it stands where it has to. Raises InputError for
        unknown names and for positions out of limits.
        """
        positions = {name: self._checked(name, position) for name, position in given.items()}
        followers = {joint.name: joint.follows for joint in self.joints if joint.follows is not None}
        if tip is not None:
            way = self._way_to(tip)
            beside = {joint.name: joint for joint in self.joints if joint.moves and joint not in way}
            for name, follows in followers.items():
                if name in given and follows.leader in beside and follows.multiplier:
                    leader = (given[name] - follows.offset) / follows.multiplier
                    positions.setdefault(follows.leader, self._checked(follows.leader, leader))
            for joint in beside.values():
                if joint.free:
                    positions.setdefault(joint.name, float(np.clip(0.0, *joint.limits)))
        for _ in followers:  # one that follows may lead another one
            for name, follows in followers.items():
                if follows.leader in positions:
                    positions.setdefault(name, follows.multiplier * positions[follows.leader] + follows.offset)
        if tip is not None:
            self._refuse_branches_that_move(tip, positions)
        return positions

    def _refuse_branches_that_move(self, tip: str, positions: Mapping[str, float]) -> None:
        """Raises InputError for a joint beside the way to a link that a joint on the way leads, so nothing holds it."""
        way = self._way_to(tip)
        behind = [each for last in self.joints if last.parent == tip for each in self._joints_from(last)]
        for joint in self.joints:
            beside = joint.moves and joint not in (*way, *behind)
            if beside and joint.follows is not None and joint.name not in positions:
                raise InputError(
                    f"{self.where}: joint '{joint.name}', beside the way to {tip}, moves with "
                    f"'{joint.follows.leader}': branches that move with the arm are not supported; "
                    f"--lock {joint.name}=VALUE holds it still"
                )

    @cached_property
    def ends(self) -> dict[str, int]:
        """Links where an arm may end, each with its number of moving joints, most joints first.

        An arm ends where several branches move, unless more joints come behind that place than before it. A joint that
        follows another one is a part of it where that one lies before it.
        """
        children = {joint.child for joint in self.joints}
        roots = dict.fromkeys(joint.parent for joint in self.joints if joint.parent not in children)
        found = [end for root in roots for end in self._ends_behind(root, 0)]
        return dict(sorted(found, key=lambda end: -end[1]))

    def refuse(self, message: str, tied: tuple[str, str] | None = None) -> InputError:
        """The error for a tree that is no single chain, with the links that --tip may name.

        tied: two links that are held together, so only those ends help behind which neither moves against the other.
        """
        helping = {link: count for link, count in self.ends.items() if tied is None or self.is_rigid(*tied, tip=link)}
        if not helping:
            return InputError(message)
        ends = ", ".join(f"{link} ({count} joint{'s' * (count > 1)})" for link, count in helping.items())
        return UndecidedError(
            f"{message}: say with --tip of `armlab recording import` or `armlab model lock-joints` where the arm ends, "
            f"and the joints beside it are locked: {ends}",
            "tip",
            tuple(helping),
        )

    def is_rigid(self, one: str, other: str, tip: str | None = None) -> bool:
        """Whether no joint moves two links against each other; tip: where the arm ends, so what is beside is locked."""
        moving = [joint for joint in (self.joints if tip is None else self._joints_to(tip)) if joint.moves]
        first, second = ([joint for joint in self._joints_to(link) if joint in moving] for link in (one, other))
        return first == second

    def _checked(self, name: str, position: float) -> float:
        known = {joint.name: joint for joint in self.joints if joint.moves}
        if name not in known:
            raise InputError(f"--lock: {self.where} has no moving joint '{name}': {suggest_name(name, tuple(known))}")
        low, high = known[name].limits
        if not low <= position <= high:
            raise InputError(f"--lock {name}={position:g} should lie within the joint's limits, {low:g} to {high:g}")
        return position

    def _way_to(self, tip: str) -> tuple[TreeJoint, ...]:
        """The joints from the base to a link."""
        before = {joint.child: joint for joint in self.joints}
        links = (*dict.fromkeys(joint.parent for joint in self.joints), *before)
        if tip not in links:
            raise InputError(
                f"--tip: {self.where} has no link '{tip}': {suggest_name(tip, tuple(dict.fromkeys(links)))}"
            )
        way = self._joints_to(tip)
        if not any(joint.moves for joint in way):
            raise InputError(f"--tip {tip}: no moving joint of {self.where} lies before this link")
        return way

    def _joints_to(self, link: str) -> tuple[TreeJoint, ...]:
        """The joints from the base to a link; none to the base."""
        before, way = {joint.child: joint for joint in self.joints}, list[TreeJoint]()
        while link in before and before[link] not in way:
            way.append(before[link])
            link = before[link].parent
        return tuple(reversed(way))

    def _ends_behind(self, link: str, before: int) -> list[tuple[str, int]]:
        """Ends of arms behind a link that has some moving joints before it."""
        behind = {joint: self._longest_from(joint) for joint in self.joints if joint.parent == link}
        moving = [joint for joint in behind if any(each.moves for each in self._joints_from(joint))]
        free = [joint for joint in moving if behind[joint]]
        if not free or (len(moving) > 1 and before >= max(behind.values())):
            return [(link, before)] if before else []
        return [end for joint in free for end in self._ends_behind(joint.child, before + joint.free)]

    def _longest_from(self, joint: TreeJoint, seen: Sequence[TreeJoint] = ()) -> int:
        """The most free joints in one chain from a joint on, itself included; none behind one led from elsewhere."""
        if joint in seen or (joint.follows is not None and not self._is_led_on_its_way(joint)):
            return 0
        lengths = [self._longest_from(each, (*seen, joint)) for each in self.joints if each.parent == joint.child]
        return joint.free + max(lengths, default=0)

    def _is_led_on_its_way(self, joint: TreeJoint) -> bool:
        """Whether a joint follows one that lies between the base and it."""
        leader = "" if joint.follows is None else joint.follows.leader
        return any(each.name == leader for each in self._joints_to(joint.parent))

    def _joints_from(self, joint: TreeJoint) -> list[TreeJoint]:
        """A joint and all behind it."""
        found = [joint]
        for each in found:
            found += [other for other in self.joints if other.parent == each.child and other not in found]
        return found
