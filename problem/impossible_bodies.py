"""Links of a robot file whose inertia no body has, and the smallest repair: mass and centre stay."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yaml

from armlab.common.arrays import Array
from armlab.common.settings import read_yaml, validate
from armlab.common.xml_text import parse_xml_text
from problem.arm import Link
from problem.bodies import is_body, nearest_body, spread_at_centre
from problem.pseudo_inertia import link_from_pseudo_inertia, pseudo_inertia_of
from problem.robot_file import LinkEntry, RobotFile
from problem.urdf import CarriedLink, chain_of
from problem.urdf_document import UrdfElement, parse_urdf_root

INERTIA_KEYS = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")


@dataclass(frozen=True, eq=False)
class ImpossibleBody:
    """A link as it stands and as the nearest body has it, both about the frame in which the file states its inertia."""

    name: str
    stated: Link
    nearest: Link

    @property
    def words(self) -> str:
        """What is wrong, and what would be right, in one line."""
        stated, nearest = (_moments_in_words(link) for link in (self.stated, self.nearest))
        return (
            f"link '{self.name}': no body has its principal moments of inertia, {stated} kg m2, of which none may be "
            f"larger than the sum of the others; the nearest body has {nearest}"
        )


def find_impossible_bodies(text: str, path: Path) -> tuple[ImpossibleBody, ...]:
    """The links that move with an inertia that no body has; path: of the file, for its kind and for messages.

    MuJoCo refuses an MJCF with such a body, so there is none.
    """
    if path.suffix == ".urdf":
        found = [_body_of_urdf(UrdfElement(each.node, str(path))) for own in _carried(text, path) for each in own]
    elif path.suffix in (".yaml", ".yml"):
        file = validate(RobotFile, read_yaml(path), str(path))
        found = [(str(number), entry.build()) for number, entry in enumerate(file.links or (), 1)]
    else:
        found = []
    bodies = [(name, link, pseudo_inertia_of(link)) for name, link in found if link is not None]
    return tuple(
        ImpossibleBody(name, link, link_from_pseudo_inertia(nearest_body(pseudo)))
        for name, link, pseudo in bodies
        if not is_body(pseudo)
    )


def repaired_text(text: str, path: Path) -> str:
    """The text of a robot file with the nearest bodies in the place of those that cannot be."""
    wrong = {body.name: body.nearest for body in find_impossible_bodies(text, path)}
    if not wrong:
        return text
    if path.suffix == ".urdf":
        return _repaired_urdf(text, path, wrong)
    file = validate(RobotFile, read_yaml(path), str(path))
    links = tuple(
        _entry(wrong[str(number)]) if str(number) in wrong else entry
        for number, entry in enumerate(file.links or (), 1)
    )
    content = file.model_copy(update={"links": links}).model_dump(mode="json", exclude_none=True)
    return str(yaml.safe_dump(content, sort_keys=False, default_flow_style=None, width=110))


def _entry(link: Link) -> LinkEntry:
    return LinkEntry(mass=link.mass, first_moment=link.first_moment, inertia=link.inertia)


def _repaired_urdf(text: str, path: Path, wrong: dict[str, Link]) -> str:
    document = parse_xml_text(text, str(path))
    for node in document.root.children:
        inertial = node.find("inertial") if node.tag == "link" else None
        body = wrong.get(node.attributes.get("name", ""))
        inertia = None if inertial is None else inertial.find("inertia")
        if inertia is not None and body is not None:
            inertia.set({key: repr(value) for key, value in zip(INERTIA_KEYS, body.inertia, strict=True)})
    return document.text()


def _carried(text: str, path: Path) -> tuple[tuple[CarriedLink, ...], ...]:
    chain = chain_of(parse_urdf_root(text, path), path)
    return (*chain.carried, *chain.coupled)


def _body_of_urdf(link: UrdfElement) -> tuple[str, Link | None]:
    """A link about its centre of mass, along the axes in which the file states its inertia."""
    if link.node.find("inertial") is None:
        return link.name, None
    entries = tuple(float(link.numbers("inertial/inertia", key, "", 1)[0]) for key in INERTIA_KEYS)
    mass = float(link.numbers("inertial/mass", "value", "", 1)[0])
    return link.name, Link(mass, (0.0, 0.0, 0.0), entries)  # type: ignore[arg-type]


def _moments_in_words(link: Link) -> str:
    first, second, third = (f"{moment:.3g}" for moment in _principal_moments(pseudo_inertia_of(link)))
    return f"{first}, {second} and {third}"


def _principal_moments(pseudo: Array) -> list[float]:
    """About the centre of mass, the largest first."""
    spread = spread_at_centre(pseudo)
    moments: list[float] = np.linalg.eigvalsh(np.trace(spread) * np.eye(3) - spread)[::-1].tolist()
    return moments
