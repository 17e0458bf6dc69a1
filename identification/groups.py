"""Groups of components that are taken or left together when a structure is chosen."""

from collections.abc import Mapping

from identification.components import Component, every_joint, neighbour_couplings

Groups = Mapping[str, tuple[Component, ...]]
USUAL = ("viscous", "coulomb", "rotor", "offset")
EXCLUSIVE = {  # one holds the other's columns, or what a few seconds of motion cannot tell from them
    "direction": "viscous",
    "viscous": "direction",
    "spring": "crank",
    "crank": "spring",
}


def candidate_groups(joints: int) -> dict[str, tuple[Component, ...]]:
    """The groups that may matter on any arm with this number of joints."""
    groups = {
        "viscous": every_joint("viscous_friction", joints),
        "coulomb": every_joint("coulomb_friction", joints),
        "rotor": every_joint("rotor_inertia", joints),
        "offset": every_joint("torque_offset", joints),
        "direction": every_joint("asymmetric_friction", joints, 1.0),
        "square root": every_joint("nonlinear_viscous_friction", joints, 0.5),
        "cube root": every_joint("nonlinear_viscous_friction", joints, 1 / 3),
        "square": every_joint("nonlinear_viscous_friction", joints, 2.0),
        "load": every_joint("load_dependent_friction", joints),
    }
    if joints > 1:
        groups["wrist coupling"] = neighbour_couplings(joints)
    return groups


def counterbalance(joint: int) -> dict[str, tuple[Component, ...]]:
    """A counterbalance at a joint that is known to have one: a torsion spring, or a linkage on a crank."""
    return {
        "spring": (Component("gravity_compensator", joint),),
        "crank": (Component("gravity_compensator", joint, form=1),),
    }


def toggled(names: tuple[str, ...], name: str) -> tuple[str, ...]:
    """The chosen groups with one more or one less; what excludes each other is exchanged."""
    if name in names:
        return tuple(other for other in names if other != name)
    return (*(other for other in names if other != EXCLUSIVE.get(name)), name)


def components_of(groups: Groups, names: tuple[str, ...]) -> tuple[Component, ...]:
    """The components of the chosen groups, in the groups' order."""
    return tuple(part for name, parts in groups.items() if name in names for part in parts)
