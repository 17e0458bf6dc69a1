"""MJCF documents as text: included files, folders of meshes, and the elements of the bodies and joints of a model."""

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from armlab.common.errors import InputError
from armlab.common.xml_text import XmlNode, XmlText, parse_xml_text, read_xml_text

MAKERS = ("replicate", "attach", "composite", "flexcomp")  # elements that make bodies that the text does not have
ASSET_FOLDERS = ("meshdir", "texturedir")


class UneditableError(InputError):
    """The text of an MJCF does not hold an element whose numbers should change."""


def read_mjcf_document(path: Path) -> tuple[XmlText, tuple[str, ...]]:
    """The document of an MJCF file with what it includes in place of `<include>`, and the names of those files.

    Raises InputError where a file cannot be read, UneditableError for one that MuJoCo reads and XML does not have.
    """
    document, included = _parse(path), list[str]()
    _include(document.root, path.parent, path.parent, included)
    return document, tuple(included)


def _parse(path: Path) -> XmlText:
    try:
        return read_xml_text(path)
    except InputError as error:
        raise UneditableError(str(error)) from None


def _include(node: XmlNode, folder: Path, own: Path, included: list[str]) -> None:
    """Replaces `<include>` inside an element. folder: of the main file; own: of the file that the element stands in."""
    for child in node.children:
        if child.tag != "include":
            _include(child, folder, own, included)
            continue
        name = child.attributes.get("file", "")
        if len(included) > 1000:
            raise UneditableError(f"<include file={name!r}>: files that include each other")
        path = next((path for path in (folder / name, own / name) if path.is_file()), folder / name)
        content = _parse(path).root
        included.append(name)
        _include(content, folder, path.parent, included)
        place = node.pieces.index(child)
        node.pieces[place : place + 1] = content.pieces


def moved_mjcf(text: str, source: Path, folder: Path | None) -> str:
    """The text of an MJCF as it is to stand in another folder: its meshes and textures stay where they are.

    source: of the file that names them. folder: where the text will stand, or None for absolute paths.
    """
    here = source.parent.resolve()
    if folder is not None and folder.resolve() == here:
        return text
    document = parse_xml_text(text, str(source))
    nodes = list(document.root.walk())
    if not any(name.startswith("file") for node in nodes for name in node.attributes):
        return text

    def moved(name: str) -> str:
        return (here / name).as_posix() if folder is None else Path(os.path.relpath(here / name, folder)).as_posix()

    for node in nodes:
        if node.tag == "model" and "file" in node.attributes:
            node.set({"file": moved(node.attributes["file"])})
    compilers = [node for node in document.root.children if node.tag == "compiler"]
    folders = dict.fromkeys(ASSET_FOLDERS, "")
    for compiler in compilers:
        for name in ASSET_FOLDERS:
            own = compiler.attributes.get(name, compiler.attributes.get("assetdir"))
            folders[name] = folders[name] if own is None else own
    last = compilers[-1] if compilers else document.root.add("compiler", {}, first=True)
    last.set({name: moved(own) for name, own in folders.items()})
    return document.text()


def body_nodes(document: XmlText, model: Any) -> dict[int, XmlNode]:
    """The elements of the bodies of a mujoco.MjModel by their numbers, from 1; those that no text has are left out."""
    worlds = [child for child in document.root.children if child.tag == "worldbody"]
    found, waiting = dict[int, XmlNode](), [(0, [body for world in worlds for body in _bodies_in(world)])]
    while waiting:
        parent, nodes = waiting.pop()
        numbers = [number for number in range(1, model.nbody) if model.body_parentid[number] == parent]
        names = [model.body(number).name for number in numbers]
        own = {numbers[place]: node for place, node in named_nodes(nodes, names).items()}
        found |= own
        waiting += [(number, list(_bodies_in(node))) for number, node in own.items()]
    return found


def named_nodes(nodes: list[XmlNode], names: list[str]) -> dict[int, XmlNode]:
    """Elements by the places of their names: in order, or by the names where there are more or fewer elements."""
    if names == [node.attributes.get("name", "") for node in nodes]:
        return dict(enumerate(nodes))
    by_name = {node.attributes["name"]: node for node in nodes if "name" in node.attributes}
    return {place: by_name[name] for place, name in enumerate(names) if name in by_name}


def makers_of(document: XmlText) -> list[str]:
    """The elements that make bodies, as a person finds them."""
    return [f"<{node.tag}> in line {node.line}" for node in document.root.walk() if node.tag in MAKERS]


def own_node(body: XmlNode, tag: str) -> tuple[XmlNode, XmlNode] | None:
    """The first element of a body with a tag, and the element that holds it; None where it has none."""
    return next(own_nodes(body, tag), None)


def own_nodes(body: XmlNode, tag: str) -> Iterator[tuple[XmlNode, XmlNode]]:
    """The elements of a body with a tag, frames included, each with the element that holds it."""
    for child in body.children:
        if child.tag == tag:
            yield child, body
        elif child.tag == "frame":
            yield from own_nodes(child, tag)


def _bodies_in(node: XmlNode) -> Iterator[XmlNode]:
    """The bodies right inside an element, frames included, in the order of the text, which is MuJoCo's."""
    for child in node.children:
        if child.tag == "body":
            yield child
        elif child.tag == "frame":
            yield from _bodies_in(child)
