"""Read MJCF within limits: includes, attached models and assets, as text that names no file."""

import collections
import dataclasses
import os
from pathlib import Path
from typing import Any, NoReturn

from drone_rl.sim.scenes.assets import Folder, Kind
from drone_rl.sim.scenes.elements import Element, parse, write
from drone_rl.utils import limits
from drone_rl.utils.errors import InputError

_SECTIONS = {"compiler", "statistic", "visual", "default", "asset", "worldbody"}
"""Those that change an image. The others are dynamics, plugins, and sizes of buffers."""
_COMPILER = {
    *("angle", "autolimits", "balanceinertia", "discardvisual", "eulerseq", "inertiafromgeom"),
    "inertiagrouprange",
}
_PARTS = {
    "visual": {"headlight", "map", "rgba"},
    "default": {"default", "geom", "joint", "light", "material", "mesh", "site", "texture"},
}
_NEVER = {"camera", "composite", "flexcomp", "plugin", "skin"}
_KEY = {"name", "qpos", "mpos", "mquat"}
_NAMED = ("body", "geom", "site", "light", "joint", "freejoint", "mesh", "texture", "material")
_FILES = ("file", "fileright", "fileleft", "fileup", "filedown", "filefront", "fileback")
_MOST_INCLUDES = 100
_MOST_DEPTH = 10
"""Of files that include or attach others."""
_MOST_PARAMETER = {"sphere": 5}
"""Of a mesh that MuJoCo makes; others have resolutions of at most 64."""
_UNITS: dict[Kind, str] = {"mesh": "triangles", "texture": "pixels", "hfield": "points"}
_MOST = {
    "elements": limits.SCENE_ELEMENTS,
    "triangles": limits.SCENE_TRIANGLES,
    "pixels": limits.SCENE_TEXELS,
    "points": limits.SCENE_CELLS,
}


@dataclasses.dataclass
class Reading:
    """What has been read of a scene so far."""

    folder: Folder
    files: dict[str, bytes] = dataclasses.field(default_factory=dict)
    """Contents of assets, by the names that the elements have now."""
    names: dict[tuple[Kind, Path], tuple[str, int]] = dataclasses.field(default_factory=dict)
    """Those names, and sizes, by kind and path."""
    models: dict[str, bytes] = dataclasses.field(default_factory=dict)
    """MJCF of attached models, likewise."""
    notes: dict[str, list[str]] = dataclasses.field(
        default_factory=lambda: collections.defaultdict(list)
    )
    """Names of what is not drawn or does not move, by kind."""
    xml_bytes: int = 0


def fail(element: Element, what: str) -> NoReturn:
    """Raise an `InputError` about an element."""
    raise InputError(f"{element}: {what}")


class Reader:
    """One MJCF file with all that it includes; `root` is safe to compile."""

    def __init__(self, file: Path, reading: Reading, depth: int = 0) -> None:
        """Read the file; raise an `InputError` if it can't be read or exceeds a limit."""
        self.file, self.reading, self._depth = file, reading, depth
        self.costs: collections.Counter[str] = collections.Counter()
        """What compiling takes, copies included; keys of `_MOST`."""
        self._included = {file.resolve()}
        self._folders: dict[str, str] = {}
        self._models: dict[str, Reader] = {}
        self.root = self._parse(file)
        if self.root.tag != "mujoco":
            fail(self.root, "it is no MuJoCo model; give a file whose root is <mujoco>")
        self._include(self.root, 0)
        self._note()
        self._select()
        self._check_names()
        for asset in self._assets():
            if asset.tag == "model":
                self._read_model(asset)
            elif asset.tag in _UNITS:
                self._read_asset(asset)
        for section in self.root.children:
            if section.tag == "worldbody":
                self._count(section, 1)

    # Files

    def _parse(self, file: Path) -> Element:
        content = self.reading.folder.read(file, limits.SCENE_XML_BYTES)
        self.reading.xml_bytes += len(content)
        if self.reading.xml_bytes > limits.SCENE_XML_BYTES:
            raise InputError(
                f"with {file.name} the scene has more than {limits.SCENE_XML_BYTES} bytes of XML; "
                "give meshes and height fields as files of their own"
            )
        return parse(content, file)

    def _find(self, element: Element, name: str, folder: str = "") -> Path:
        """Return the file where MuJoCo looks: next to the model, then to the including file."""
        of_model, own = self.file.parent, element.file.parent
        beside = os.path.relpath(own, of_model)
        places = [of_model / folder / name, of_model / folder / beside / name, own / folder / name]
        try:
            return self.reading.folder.find(places)
        except InputError as error:
            fail(element, str(error))

    def _include(self, element: Element, depth: int) -> None:
        """Put what files include in the place of the elements that name them."""
        children = []
        for child in element.children:
            if child.tag != "include":
                self._include(child, depth)
                children.append(child)
                continue
            path = self._find(child, child.get("file"))
            if path.resolve() in self._included:
                fail(child, "the file is included twice or includes itself; remove this element")
            self._included.add(path.resolve())
            if len(self._included) > _MOST_INCLUDES or depth >= _MOST_DEPTH:
                fail(child, f"give at most {_MOST_INCLUDES} includes, {_MOST_DEPTH} deep")
            root = self._parse(path)
            self._include(root, depth + 1)
            children += root.children
        element.children = children

    # Selection

    def _note(self) -> None:
        """Note what will not be drawn, or does not move."""
        notes, root = self.reading.notes, self.root
        for element in root.every():
            _check_numbers(element)
            if element.tag == "default":
                continue
            tag, name = element.tag, element.get("name") or element.get("prefix") or element.tag
            if tag in ("joint", "freejoint", "flex", "flexcomp", "skin", "composite"):
                notes[tag].append(name)
            elif tag == "plugin" and element.get("plugin"):
                notes[tag].append(element.get("plugin"))
            elif tag == "material" and element.get("reflectance", "0").strip("0."):
                notes["reflectance"].append(name)
            elif tag == "map" and element.get("haze", "0").strip("0."):
                notes["haze"].append(name)

    def _select(self) -> None:
        """Leave what can be seen."""
        keys = list(self.root.every("key"))[:1]
        has_all_joints = not any(self.root.every("composite", "flexcomp"))
        self._sdf = {
            mesh.get("name") for mesh in self.root.every("mesh") if any(mesh.every("plugin"))
        }
        sections = [section for section in self.root.children if section.tag in _SECTIONS]
        for section in sections:
            if section.tag == "compiler":
                self._folders |= section.attributes
                kept = {n: v for n, v in section.attributes.items() if n in _COMPILER}
                section.attributes = {**kept, "boundmass": "1e-6", "boundinertia": "1e-6"}
                section.children = []
            self._strip(section, _PARTS.get(section.tag))
        for key in keys if has_all_joints and self._depth == 0 else ():
            key.attributes = {n: v for n, v in key.attributes.items() if n in _KEY}
            self.reading.notes["key"].append(key.get("name", "0"))
            sections.append(Element("keyframe", {}, key.file, key.line, [key]))
        self.root.attributes, self.root.children = {}, sections

    def _strip(self, element: Element, parts: set[str] | None) -> None:
        """Drop elements and attributes that are of no use here; plugins make some of them."""
        children = []
        for child in element.children:
            if child.tag in _NEVER or (parts and child.tag not in parts):
                continue
            names = {child.get("mesh") if child.tag == "geom" else child.get("name")}
            if child.get("type") == "sdf" or (child.tag in ("mesh", "geom") and names & self._sdf):
                self.reading.notes["sdf"].append(child.get("name", child.tag))
                continue
            child.attributes.pop("user", None)
            self._strip(child, parts)
            children.append(child)
        element.children = children

    def _check_names(self) -> None:
        """Refuse names that occur twice."""
        first: dict[tuple[str, str], Element] = {}
        for section in self.root.children:
            for element in section.every(*_NAMED) if section.tag in ("worldbody", "asset") else ():
                key = element.tag.removeprefix("free"), element.get("name")
                other = first.setdefault(key, element)
                if key[1] and other is not element:
                    where = f"line {other.line} of {other.file.name}"
                    fail(element, f"{where} has the same name; rename one of them")

    # Assets

    def _assets(self) -> list[Element]:
        sections = [section for section in self.root.children if section.tag == "asset"]
        return [asset for section in sections for asset in section.children]

    def _read_asset(self, element: Element) -> None:
        """Read the files of an asset, name them by their number, and count its size."""
        kind: Any = element.tag
        if element.get("file") and not element.get("name"):
            element.attributes["name"] = Path(element.get("file")).stem
        element.attributes.pop("content_type", None)
        if kind == "mesh":
            element.attributes["inertia"] = "shell"  # the others refuse open meshes
        named = [name for name in _FILES if element.get(name)]
        if not named:
            self.costs[_UNITS[kind]] += self._size_of_numbers(element)
        for attribute in named:
            name, size = self._read_file(element, element.get(attribute), kind)
            self.costs[_UNITS[kind]] += size
            element.attributes[attribute] = name
        self._check_costs(element)

    def _read_file(self, element: Element, name: str, kind: Kind) -> tuple[str, int]:
        """Read a file once; return its name by number, and its size."""
        if self._folders.get("strippath") == "true":
            name = name.replace("\\", "/").rpartition("/")[2]
        own = "texturedir" if kind == "texture" else "meshdir"
        folder = self._folders.get(own, self._folders.get("assetdir", ""))
        path = self._find(element, name, folder)
        known = self.reading.names
        if (kind, path) not in known:
            try:
                asset = self.reading.folder.asset(kind, path)
            except InputError as error:
                fail(element, str(error))
            known[kind, path] = f"asset_{len(known)}{asset.ending}", asset.size
            self.reading.files[known[kind, path][0]] = asset.content
        return known[kind, path]

    def _size_of_numbers(self, element: Element) -> int:
        """Return the size of an asset that its attributes describe."""
        if element.tag == "hfield":
            return _whole(element, "nrow") * _whole(element, "ncol")
        if element.tag == "texture":
            width, height = _whole(element, "width"), _whole(element, "height")
            is_flat = element.get("type", "cube") == "2d"
            return width * height if is_flat else max(6 * width * width, width * height)
        if not element.get("builtin"):
            return sum(len(element.get(name).split()) // 3 for name in ("face", "vertex"))
        most = _MOST_PARAMETER.get(element.get("builtin"), 64)
        for word in element.get("params").split():
            if not abs(_number(element, "params", word)) <= most:
                fail(element, f"params has {word[:40]}; give numbers of at most {most}")
        return 2 * 64 * 64

    def _read_model(self, element: Element) -> None:
        """Read a model that others attach, and name it by its number."""
        if self._depth >= _MOST_DEPTH:
            fail(element, f"models attach models more than {_MOST_DEPTH} deep; attach fewer")
        path = self._find(element, element.get("file"))
        model = Reader(path, self.reading, self._depth + 1)
        self._models[element.get("name") or path.stem] = model
        element.attributes.setdefault("name", path.stem)
        element.attributes["file"] = f"model_{len(self.reading.models)}.xml"
        element.attributes.pop("content_type", None)
        self.reading.models[element.get("file")] = write(model.root)[0].encode()

    # Counts

    def _count(self, element: Element, times: int) -> None:
        """Add the copies of all elements below one to the costs."""
        for child in element.children:
            copies = times
            if child.tag == "replicate":
                copies *= max(1, _whole(child, "count"))
            elif child.tag == "attach" and child.get("model") in self._models:
                for name, size in self._models[child.get("model")].costs.items():
                    self.costs[name] += times * size
            self.costs["elements"] += copies if child.tag not in ("frame", "replicate") else 0
            self._check_costs(child)
            self._count(child, copies)

    def _check_costs(self, element: Element) -> None:
        for name, most in _MOST.items():
            if self.costs[name] > most:
                count = f"with it the scene has {self.costs[name]} {name}"
                fail(element, f"{count}; give at most {most}")


def _check_numbers(element: Element) -> None:
    """Refuse what is no number, about which MuJoCo would write a log file."""
    for name, value in element.attributes.items():
        if name != "name" and "nan" in value.lower().split():
            fail(element, f"{name} has a nan, which is no number; correct it")


def _whole(element: Element, name: str) -> int:
    """Return an attribute that is a count."""
    value = _number(element, name, element.get(name, "0"))
    if not 0 <= value < 2**31:
        fail(element, f"{name}={value:g}; give a whole number that is not so large")
    return int(value)


def _number(element: Element, name: str, word: str) -> float:
    try:
        return float(word)
    except ValueError:
        fail(element, f"{name} has {word[:40]!r}; give a number")
