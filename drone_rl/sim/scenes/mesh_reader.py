"""A program that reads a mesh file by trimesh and writes it as MJCF, within limits of its process.

`python -m drone_rl.sim.scenes.mesh_reader FILE UP SCALE` writes a NumPy archive to standard output:
the text, its files, and hash and versions of all files that were read.
"""

import io
import resource
import struct
import sys
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray

from drone_rl.sim.scenes.assets import Folder, check_texels
from drone_rl.utils import limits
from drone_rl.utils.errors import InputError

_MOST_BYTES, _MOST_SECONDS = 2**31, 10
_LEAST_VERTICES = 4
"""Of a mesh in MuJoCo."""
_GRAY = (0.7, 0.7, 0.7, 1.0)


_LIGHT = '<visual><headlight ambient=".35 .35 .35" diffuse=".2 .2 .2" specular="0 0 0"/></visual>'
_SKY = '<texture type="skybox" builtin="gradient" rgb1=".55 .7 .92" rgb2=".85 .9 .97" width="64"/>'
_SUN = '<light type="directional" dir=".35 -.45 -.82" diffuse=".6 .6 .6" castshadow="false"/>'


class _Inside:
    """What trimesh gets files by that a mesh names: those in its folder."""

    def __init__(self, folder: Folder) -> None:
        self._folder = folder

    def get(self, name: str) -> bytes:
        path = self._folder.find([self._folder.root / str(name).strip()])
        return self._folder.read(path, limits.SCENE_ASSET_BYTES)

    __getitem__ = get

    def keys(self) -> list[str]:
        return []

    def namespaced(self, namespace: str) -> "_Inside":
        del namespace
        return self


class _Writer:
    """MJCF of meshes, and its files."""

    def __init__(self, folder: Folder, up: str, scale: float) -> None:
        self.folder = folder
        turn = np.eye(3) if up == "z" else np.array([[1.0, 0, 0], [0, 0, -1.0], [0, 1.0, 0]])
        self._turn = scale * turn
        self.files: dict[str, bytes] = {}
        self._assets: list[str] = []
        self._geoms: list[str] = []
        self._materials: dict[int, str] = {}
        self._names: set[str] = set()
        self._texels = 0

    @property
    def mjcf(self) -> str:
        """The model."""
        assets, geoms = "\n".join(self._assets), "\n".join(self._geoms)
        return (
            f"<mujoco>{_LIGHT}<asset>{_SKY}{assets}</asset>"
            f"<worldbody>{_SUN}{geoms}</worldbody></mujoco>"
        )

    def add(self, name: str, mesh: Any, transform: NDArray[np.float64]) -> None:
        """Add a mesh where it is."""
        number = len(self._geoms)
        linear = self._turn @ transform[:3, :3]
        vertices = mesh.vertices @ linear.T + self._turn @ transform[:3, 3]
        faces = mesh.faces[:, ::-1] if np.linalg.det(linear) < 0 else mesh.faces
        places = getattr(mesh.visual, "uv", None)
        if places is None or len(places) != len(vertices):
            places = np.zeros((0, 2))
        places = np.stack([places[:, 0], 1.0 - places[:, 1]], -1)  # MuJoCo's begin at the top
        if len(vertices) < _LEAST_VERTICES:
            more = _LEAST_VERTICES - len(vertices)
            vertices = np.pad(vertices, ((0, more), (0, 0)), "edge")
            places = np.pad(places, ((0, more), (0, 0)), "edge") if len(places) else places
        counts = struct.pack("<4i", len(vertices), 0, len(places), len(faces))
        parts = [vertices.astype("<f4"), places.astype("<f4"), faces.astype("<i4")]
        self.files[f"mesh_{number}.msh"] = counts + b"".join(part.tobytes() for part in parts)
        self._assets.append(f'<mesh name="mesh_{number}" file="mesh_{number}.msh"/>')
        unique = name if name and name not in self._names else f"{name or 'mesh'}_{number}"
        self._names.add(unique)
        material = self._material(mesh.visual)
        self._geoms.append(
            f"<geom name={quoteattr(unique)} "
            f'type="mesh" mesh="mesh_{number}" material="{material}"/>'
        )

    def _material(self, visual: Any) -> str:
        """Return the name of the material of a mesh, one color where it has no image."""
        material = getattr(visual, "material", None)
        key = id(visual if material is None else material)
        if key not in self._materials:
            name = self._materials[key] = f"material_{len(self._materials)}"
            texture = "" if material is None else self._texture(material, name)
            color = (1.0,) * 4 if texture else _color(visual, material)
            rgba = " ".join(f"{value:.4g}" for value in color)
            self._assets.append(f'<material name="{name}" rgba="{rgba}" specular="0"{texture}/>')
        return self._materials[key]

    def _texture(self, material: Any, name: str) -> str:
        image = getattr(material, "baseColorTexture", None) or getattr(material, "image", None)
        if image is None:
            return ""
        self._texels += image.width * image.height
        check_texels(self._texels, "its images")
        image.convert("RGB").save(file := io.BytesIO(), "png", compress_level=1)
        self.files[f"{name}.png"] = file.getvalue()
        self._assets.append(f'<texture name="{name}" type="2d" file="{name}.png"/>')
        return f' texture="{name}"'


def _color(visual: Any, material: Any) -> tuple[float, ...]:
    """Return the color of a material, or the mean one of vertices or faces."""
    if material is not None:
        found = material.main_color
    elif getattr(visual, "defined", False):
        colors = visual.vertex_colors if visual.kind == "vertex" else visual.face_colors
        found = np.asarray(colors).mean(0)
    else:
        return _GRAY
    return tuple((np.asarray(found, dtype=float)[:4] / 255.0).tolist())


def convert(file: Path, up: str, scale: float) -> _Writer:
    """Return a mesh file as MJCF.

    Raises:
        InputError: It names files outside of its folder, or exceeds a limit.
    """
    import trimesh  # slow

    folder = Folder(file.parent)
    content = io.BytesIO(folder.read(file, limits.SCENE_ASSET_BYTES))
    inside: Any = _Inside(folder)
    kind = file.suffix.lower().removeprefix(".")
    scene: Any = trimesh.load_scene(content, file_type=kind, resolver=inside, process=False)
    writer, triangles = _Writer(folder, up, scale), 0
    for node in sorted(scene.graph.nodes_geometry):
        transform, name = scene.graph[node]
        mesh = scene.geometry[name]
        if not hasattr(mesh, "faces") or not len(mesh.faces):
            continue  # points or lines
        triangles += max(len(mesh.faces), len(mesh.vertices) // 3)
        if triangles > limits.SCENE_TRIANGLES:
            raise InputError(
                f"it has more than {limits.SCENE_TRIANGLES} triangles; give a simpler mesh"
            )
        if not np.isfinite(mesh.vertices).all():
            raise InputError("it has vertices that are no numbers; correct it")
        writer.add(str(name)[:100], mesh, transform)
    if not triangles:
        raise InputError("it has no triangles; give a mesh with faces")
    return writer


def main(arguments: list[str]) -> None:
    """Convert a file; exit with a line about the mistake if that is not possible."""
    resource.setrlimit(resource.RLIMIT_AS, (_MOST_BYTES, _MOST_BYTES))
    resource.setrlimit(resource.RLIMIT_CPU, (_MOST_SECONDS, _MOST_SECONDS + 1))
    file, up, scale = arguments
    try:
        made = convert(Path(file), up, float(scale))
    except InputError as error:
        sys.exit(f"mistake: {error}")
    except MemoryError:
        sys.exit("mistake: it takes more than 2 GiB of memory; give a simpler mesh")
    except Exception as error:  # whatever trimesh raises for damaged files
        reason = " ".join(f"{type(error).__name__} {error}".split())[:200]
        sys.exit(f"mistake: it is damaged, or no such mesh ({reason}); save it again")
    versions = [f"{path}\n{size} {time}" for path, (size, time) in made.folder.versions.items()]
    about = {"mjcf": made.mjcf, "hash": made.folder.hash.hexdigest(), "versions": versions}
    files = {f"file {name}": np.frombuffer(of, np.uint8) for name, of in made.files.items()}
    arrays: dict[str, Any] = {**{name: np.array(of) for name, of in about.items()}, **files}
    np.savez(sys.stdout.buffer, **arrays)


if __name__ == "__main__":
    main(sys.argv[1:])
