"""MJCF files whose meshes are not at hand: read without them, where the file states the inertia of the bodies."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from armlab.common.errors import InputError
from armlab.common.xml_text import XmlNode, XmlText, parse_xml_text
from problem.mjcf_document import ASSET_FOLDERS, body_nodes, moved_mjcf, own_node, read_mjcf_document

FILE_ASSETS = ("mesh", "hfield", "skin", "texture")
NAMED_BY_GEOMS = ("geom", "geom1", "geom2", "mesh", "hfield")
MAX_SHARE = 1e-9  # of a body's mass and inertia: more is no rounding


def text_without_meshes(path: Path) -> str:
    """The text of an MJCF, with what it includes, without meshes, height fields and textures and what they need.

    Other files that it names have absolute paths. Raises InputError where a mass comes from a mesh, and where the text
    cannot be edited.
    """
    document, _ = read_mjcf_document(path)
    _refuse_mass_of_meshes(document, path)
    remove_meshes(document)
    return moved_mjcf(document.text(), path, None)


def text_with_inertia(path: Path, model: Any, read: Callable[[str, Path], Any]) -> str:
    """The text of an MJCF, with what it includes, that states the inertia of each body whose mass comes from meshes.

    model: the mujoco.MjModel of the file. read: compiles a text. Errors as `text_without_meshes`.
    """
    document, _ = read_mjcf_document(path)
    if not any(_is_of_file(node) for node in document.root.walk() if node.tag == "geom"):
        return document.text()
    bare = parse_xml_text(document.text(), str(path))
    for body in (node for node in bare.root.walk() if node.tag == "body"):
        if own_node(body, "inertial") is None and any(map(_is_of_file, _geoms_of(body))):
            body.add("inertial", {"pos": "0 0 0", "mass": "1", "diaginertia": "1 1 1"}, first=True)
    remove_meshes(bare)
    _state_inertia(document, model, read(moved_mjcf(bare.text(), path, None), path))
    return document.text()


def remove_meshes(document: XmlText) -> None:
    """Takes geoms of meshes and height fields out of a document, with files of assets and what names such geoms."""
    gone = set[str]()
    for node in list(document.root.walk()):
        for child in list(node.children):
            if child.tag == "geom" and node.tag != "default" and _is_of_file(child):
                gone.add(child.attributes.get("name", ""))
                node.remove(child)
            elif node.tag == "asset" and _is_asset_of_file(child):
                node.remove(child)
            elif child.tag == "material" and "texture" in child.attributes:
                child.set({"texture": None})
    _remove_what_names(document.root, gone - {""})
    for compiler in (child for child in document.root.children if child.tag == "compiler"):
        compiler.set(dict.fromkeys((*ASSET_FOLDERS, "assetdir")))


def _is_of_file(geom: XmlNode) -> bool:
    return bool({"mesh", "hfield"} & geom.attributes.keys()) or geom.attributes.get("type") in ("mesh", "hfield", "sdf")


def _is_asset_of_file(asset: XmlNode) -> bool:
    """Whether an asset is a shape, or a texture that a file holds; others are made by MuJoCo."""
    if asset.tag == "texture":
        return any(name.startswith("file") for name in asset.attributes)
    return asset.tag in FILE_ASSETS


def _remove_what_names(root: XmlNode, names: set[str]) -> None:
    """Takes pairs of contacts and sensors out that name geoms."""
    for section in (child for child in root.children if child.tag in ("contact", "sensor")):
        for child in list(section.children):
            if names & {child.attributes.get(key, "") for key in NAMED_BY_GEOMS}:
                section.remove(child)


def _state_inertia(document: XmlText, model: Any, bare: Any) -> None:
    """Writes the inertia of bodies that another model has otherwise. model, bare: with meshes, and without."""
    for compiler in (child for child in document.root.children if child.tag == "compiler"):
        if compiler.attributes.get("inertiafromgeom") == "true":
            compiler.set({"inertiafromgeom": "auto"})
    for number, node in body_nodes(document, model).items():
        if _same_body(model, bare, number):
            continue
        found = own_node(node, "inertial")
        inertial = node.add("inertial", {}, first=True) if found is None else found[0]
        places = {"pos": "ipos", "quat": "iquat", "diaginertia": "inertia"}
        stated = {key: getattr(model, f"body_{name}")[number] for key, name in places.items()}
        texts = {key: " ".join(repr(float(each)) for each in value) for key, value in stated.items()}
        inertial.set({"fullinertia": None, "mass": repr(float(model.body_mass[number])), **texts})


def _same_body(model: Any, bare: Any, number: int) -> bool:
    """Whether a body has the same mass, centre and inertia in two models."""
    pairs = [
        (getattr(model, f"body_{name}")[number], getattr(bare, f"body_{name}")[number])
        for name in ("mass", "ipos", "iquat", "inertia")
    ]
    return all(np.allclose(one, other, rtol=MAX_SHARE, atol=0) for one, other in pairs)


def _geoms_of(body: XmlNode) -> Iterator[XmlNode]:
    """The geoms of a body, those in frames included."""
    for child in body.children:
        if child.tag == "geom":
            yield child
        elif child.tag == "frame":
            yield from _geoms_of(child)


def _refuse_mass_of_meshes(document: XmlText, path: Path) -> None:
    """Raises InputError for a body with a mesh and without an inertia of its own: its mass is not known without it."""
    compilers = [node for node in document.root.children if node.tag == "compiler"]
    ignores_stated = any(node.attributes.get("inertiafromgeom") == "true" for node in compilers)
    for body in (node for node in document.root.walk() if node.tag == "body"):
        meshes = [geom for geom in _geoms_of(body) if _is_of_file(geom)]
        massless = all("0" in (geom.attributes.get("mass"), geom.attributes.get("density")) for geom in meshes)
        if meshes and not massless and (ignores_stated or own_node(body, "inertial") is None):
            name = body.attributes.get("name", "")
            raise InputError(f"{path}, body '{name}': its mass comes from a mesh, which is not at hand")
