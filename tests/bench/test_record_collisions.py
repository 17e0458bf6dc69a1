"""Records with collisions keep limits and distances between their samples, by an engine that took no part."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from bench.studies.best_known.records import RECORDS_FILE, build_excitation, parse_record, read_records
from bench.studies.best_known.search import record_point
from bench.studies.best_known.verify import LIMIT_TOLERANCE, limit_use_of_point
from problem.arm import Arm
from problem.safe_motion import SafeConstraints, SafetyRules
from problem.suite import instances
from problem.trajectories import sample_instants

pin = pytest.importorskip("pinocchio")
coal = pytest.importorskip("coal")

FILE = Path(__file__).parents[2] / "results" / RECORDS_FILE
RECORDS = {name: record for name, record in read_records(FILE).items() if name.startswith("suite-4/")}
INSTANTS = 2_001  # 5 ms apart in ten seconds


class CapsuleArm:
    """The arm as capsules from joint to joint in Pinocchio, on a floor, with the pairs of parts that rules name."""

    def __init__(self, arm: Arm, rules: SafetyRules, radius: float) -> None:
        self.model, self.geometry = pin.Model(), pin.GeometryModel()
        names, parent, placement = ["the base"], 0, np.eye(4)
        self.parts: list[list[int]] = [self._add_capsules(0, [np.eye(4), arm.joints[0].before], radius)]
        for number, joint in enumerate(arm.joints):
            place = pin.SE3(placement @ joint.before)
            parent = self.model.addJoint(parent, pin.JointModelRZ(), place, joint.name)
            following = arm.joints[number + 1].before if number + 1 < len(arm) else np.eye(4)
            corners = [np.eye(4), joint.after, joint.after @ following]
            self.parts.append(self._add_capsules(parent, corners, radius))
            names.append(f"the link of {joint.name}")
            placement = joint.after
        floor = pin.GeometryObject("floor", 0, pin.SE3.Identity(), coal.Halfspace(np.array([0.0, 0.0, 1.0]), 0.0))
        places = {"the floor": [self.geometry.addGeometryObject(floor)], **dict(zip(names, self.parts, strict=True))}
        self.kinds = []
        assert rules.shape is not None
        for pair in rules.shape.pairs:
            for one in places[pair.names[0]]:
                for other in places[pair.names[1]]:
                    self.geometry.addCollisionPair(pin.CollisionPair(one, other))
                    self.kinds.append(pair.names)
        self.data, self.distances_data = self.model.createData(), pin.GeometryData(self.geometry)

    def _add_capsules(self, joint: int, corners: list[np.ndarray], radius: float) -> list[int]:
        points = [corner[:3, 3] for corner in corners]
        out = []
        for start, end in pairwise(points):
            length = float(np.linalg.norm(end - start))
            if length < 1e-6:
                continue
            turn = pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), (end - start) / length)
            place = pin.SE3(turn.matrix(), (start + end) / 2)
            shape = coal.Capsule(radius, length)
            name = f"{joint}-{self.geometry.ngeoms}"
            out.append(self.geometry.addGeometryObject(pin.GeometryObject(name, joint, place, shape)))
        if not out:
            ball = pin.GeometryObject(f"{joint}-ball", joint, pin.SE3.Identity(), coal.Sphere(radius))
            out.append(self.geometry.addGeometryObject(ball))
        return out

    def least_distance(self, position: np.ndarray) -> float:
        pin.computeDistances(self.model, self.data, self.geometry, self.distances_data, position)
        return min(result.min_distance for result in self.distances_data.distanceResults)


def test_every_problem_of_suite_4_has_a_record_and_five_arms_have_one_of_d_optimality() -> None:
    assert set(instances("suite-4")) <= set(RECORDS)
    assert len([name for name in RECORDS if name.endswith("-d")]) == 5


@pytest.mark.parametrize("name", [name for name in instances("suite-4") if name.endswith("-si-floor")])
def test_the_record_without_collisions_goes_through_the_floor(name: str) -> None:
    without = read_records(FILE)
    other = name.replace("suite-4/", "suite-2/").removesuffix("-floor")
    record = without["joint-fourier-irb120" if "irb120" in name else other]
    problem = build_excitation(parse_record(RECORDS[name], name, FILE), name)
    rules = problem.constraints.rules if isinstance(problem.constraints, SafeConstraints) else None
    assert rules is not None
    assert rules.shape is not None
    motion = problem.trajectory.motions(record_point(record)[None], problem.times).motion
    least = rules.shape.distances(motion.position[0]).min(axis=0)
    assert min(least[[pair.kind == "the floor" for pair in rules.shape.pairs]]) < -0.04


@pytest.mark.parametrize("name", RECORDS)
def test_a_record_with_collisions_keeps_limits_and_distances_at_2001_instants_by_pinocchio(name: str) -> None:
    record = RECORDS[name]
    problem, point = build_excitation(parse_record(record, name, FILE), name), record_point(record)
    constraints = problem.constraints
    assert isinstance(constraints, SafeConstraints)
    rules = constraints.rules
    assert rules.shape is not None
    radius = float(rules.shape.words.split()[2])
    assert rules.shape.words.startswith("capsules of ")
    capsules = CapsuleArm(problem.arm, rules, radius)
    positions = problem.trajectory.motions(point[None], sample_instants(problem.duration, INSTANTS)).motion.position[0]
    theirs = np.array([capsules.least_distance(position) for position in positions])
    assert theirs.min() > rules.settings.clearance - 1e-3
    ours = rules.shape.distances(positions[::100]).min(axis=1)
    np.testing.assert_allclose(theirs[::100], ours, atol=5e-4)  # the words round the radius to three digits
    assert max(limit_use_of_point(problem, point).values()) <= 1 + LIMIT_TOLERANCE
