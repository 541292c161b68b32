"""Scenes that were made to exhaust memory or time, to read other files, or to run code."""

import json
import os
import struct
import subprocess
import sys
import tempfile
import threading
import time
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.benchmark import Figures, Setup

SECRET = "the canary's secret 4711"
_MOST_BYTES, _MOST_SECONDS = 2**31, 20.0
_PATIENCE_S = 60.0
_PROGRAM = """
import sys
from drone_rl.sim.entities import Field, SceneEntity
from drone_rl.sim.quiet_dm_control import mjcf
from drone_rl.sim.scenes import load_scene
from drone_rl.utils.errors import InputError
try:
    scene = load_scene(sys.argv[1])
    field = Field([scene])
    field.attach(SceneEntity(scene))
    mjcf.Physics.from_mjcf_model(field.mjcf_model)
except InputError as error:
    sys.exit(f"error: {error}")
"""


def _model(world: str = "", before: str = "") -> bytes:
    world = world or '<geom size="1"/>'
    return f"<mujoco>{before}<worldbody>{world}</worldbody></mujoco>".encode()


def _asset(asset: str, world: str = "") -> bytes:
    return _model(world, f"<asset>{asset}</asset>")


def _mesh(file: str) -> bytes:
    return _asset(f'<mesh name="m" file="{file}"/>', '<geom type="mesh" mesh="m"/>')


def _texture(file: str) -> bytes:
    return _asset(f'<texture name="t" type="2d" file="{file}"/>')


def _png(width: int, height: int) -> bytes:
    """A small file that claims to be a large black image, and is one."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        checked = kind + data
        return struct.pack(">I", len(data)) + checked + struct.pack(">I", zlib.crc32(checked))

    head = struct.pack(">2I5B", width, height, 1, 0, 0, 0, 0)
    row = b"\0" * (1 + (width + 7) // 8)
    packer = zlib.compressobj(9)
    rows = min(height, 2**27 // len(row))
    data = b"".join(packer.compress(row) for _ in range(rows)) + packer.flush()
    parts = [chunk(b"IHDR", head), chunk(b"IDAT", data), chunk(b"IEND", b"")]
    return b"\x89PNG\r\n\x1a\n" + b"".join(parts)


def _glb(document: dict[str, Any], binary: bytes = b"") -> bytes:
    text = json.dumps({"asset": {"version": "2.0"}, **document}).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    chunks += struct.pack("<I4s", len(binary), b"BIN\0") + binary
    return struct.pack("<4s2I", b"glTF", 2, 12 + len(chunks)) + chunks


def _replicate(depth: int) -> bytes:
    world = '<geom size="1"/>'
    for _ in range(depth):
        world = f'<replicate count="1000" offset="1 0 0">{world}</replicate>'
    return _model(world)


def _entities() -> bytes:
    entities = "".join(f'<!ENTITY e{i + 1} "{f"&e{i};" * 10}">' for i in range(12))
    return f'<!DOCTYPE m [<!ENTITY e0 "ha">{entities}]><mujoco model="&e12;"/>'.encode()


def _sparse(path: Path, size: int, head: bytes = b"") -> None:
    path.write_bytes(head)
    os.truncate(path, size)


def _attached(folder: Path) -> None:
    for i in range(9):
        asset = f'<asset><model name="m" file="{i + 1}.xml"/></asset>'
        copies = "".join(f'<attach model="m" body="b" prefix="{k}_"/>' for k in range(10))
        (folder / f"{i}.xml").write_bytes(_model(f'<body name="b">{copies}</body>', asset))
    (folder / "9.xml").write_bytes(_model('<body name="b"><geom size="1"/></body>'))
    (folder / "0.xml").rename(folder / "scene.xml")


def _chain(folder: Path) -> None:
    for i in range(300):
        (folder / f"{i}.xml").write_text(f'<mujoco><include file="{i + 1}.xml"/></mujoco>')
    (folder / "300.xml").write_bytes(_model())
    (folder / "0.xml").rename(folder / "scene.xml")


def _largest(folder: Path) -> None:
    """Write a scene that is about as large as the limits admit."""
    steps = np.linspace(0, 20, 500)
    x, y = (of.ravel() for of in np.meshgrid(steps, steps))
    vertices = "".join(f"v {x} {y} {z}\n" for x, y, z in zip(x, y, np.sin(3 * x), strict=True))
    first = (np.arange(499)[:, None] * 500 + np.arange(499) + 1).ravel().tolist()
    faces = "".join(f"f {i} {i + 1} {i + 501} {i + 500}\n" for i in first)
    (folder / "m.obj").write_text(vertices + faces)
    (folder / "t.png").write_bytes(_png(4096, 4096))
    (folder / "h.png").write_bytes(_png(2048, 2048))
    asset = """<asset><mesh name="m" file="m.obj"/><texture name="t" type="2d" file="t.png"/>
    <material name="t" texture="t"/><hfield name="h" file="h.png" size="9 9 1 1"/></asset>"""
    world = """<geom type="mesh" mesh="m" material="t"/><geom type="hfield" hfield="h"/>
    <replicate count="2400" offset="0.1 0 0"><body><geom size="1"/></body></replicate>"""
    (folder / "scene.xml").write_bytes(_model(world, asset))


def _gltf_scene(**parts: Any) -> dict[str, Any]:
    return {
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        **parts,
    }


_STL = b"\0" * 80 + struct.pack("<I", 10**9)
_HUGE_ACCESSOR = {"componentType": 5126, "count": 10**10, "type": "VEC3"}
_ONE_FACE = b"v 0 0 0\nv 1 0 0\nv 0 1 0\n"
_PLY = b"ply\nformat binary_little_endian 1.0\nelement vertex 9999999999\n"
_PLY += b"property float x\nproperty float y\nproperty float z\nend_header\n"

Made = bytes | dict[str, bytes | Callable[[Path], object]] | Callable[[Path], object]
HOSTILE: dict[str, Made] = {
    "include_of_itself": _model(before='<include file="scene.xml"/>'),
    "chain_of_includes": _chain,
    "height_field_50000": _asset(
        '<hfield name="h" nrow="50000" ncol="50000" size="1 1 1 1"/>',
        '<geom type="hfield" hfield="h"/>',
    ),
    "height_field_file": {
        "scene.xml": _asset(
            '<hfield name="h" file="h.bin" size="1 1 1 1"/>', '<geom type="hfield" hfield="h"/>'
        ),
        "h.bin": lambda path: _sparse(path, 8 + 10**10, struct.pack("<2i", 50000, 50000)),
    },
    "height_field_image": {
        "scene.xml": _asset(
            '<hfield name="h" file="h.png" size="1 1 1 1"/>', '<geom type="hfield" hfield="h"/>'
        ),
        "h.png": _png(50_000, 50_000),
    },
    "texture_100000": _asset(
        '<texture name="t" type="2d" builtin="flat" width="100000" height="100000"/>'
    ),
    "texture_cube": _asset('<texture name="t" type="cube" builtin="flat" width="60000"/>'),
    "image_100000": {"scene.xml": _texture("t.png"), "t.png": _png(100_000, 100_000)},
    "archive": lambda folder: _zip(folder / "scene.xml"),
    "pipe": {"scene.xml": os.mkfifo},
    "pipe_as_mesh": {"scene.xml": _mesh("m.obj"), "m.obj": os.mkfifo},
    "pipe_as_include": {
        "scene.xml": _model(before='<include file="i.xml"/>'),
        "i.xml": os.mkfifo,
    },
    "device": lambda folder: (folder / "scene.xml").symlink_to("/dev/zero"),
    "device_as_texture": {
        "scene.xml": _texture("t.png"),
        "t.png": lambda path: path.symlink_to("/dev/zero"),
    },
    "absolute_path": lambda folder: (folder / "scene.xml").write_bytes(
        _model(before=f'<include file="{folder.parent}/canary"/>')
    ),
    "absolute_folder": lambda folder: (folder / "scene.xml").write_bytes(
        _model(before=f'<compiler meshdir="{folder.parent}"/><asset><mesh file="canary"/></asset>')
    ),
    "parent_folder": _model(before='<include file="../canary"/>'),
    "link_outside": {
        "scene.xml": _model(before='<include file="i.xml"/>'),
        "i.xml": lambda path: path.symlink_to(path.parent.parent / "canary"),
    },
    "loop_of_links": {
        "scene.xml": _mesh("m.obj"),
        "m.obj": lambda path: path.symlink_to(path),
    },
    "plugin": _model(
        '<body><plugin plugin="evil" instance="e"/><geom size="1"/></body>',
        '<extension><plugin plugin="evil"><instance name="e"/></plugin></extension>',
    ),
    "replicate": _replicate(3),
    "replicate_count": _model('<replicate count="99999999999"><geom size="1"/></replicate>'),
    "attached_models": _attached,
    "entities": _entities(),
    "external_entity": (
        b'<!DOCTYPE m [<!ENTITY e SYSTEM "../canary">]><mujoco model="&e;"><worldbody/></mujoco>'
    ),
    "billion_triangles": {
        "scene.xml": _mesh("m.stl"),
        "m.stl": lambda path: _sparse(path, 84 + 50 * 10**9, _STL),
    },
    "billion_triangles_in_header": {"scene.xml": _mesh("m.stl"), "m.stl": _STL + b"\0" * 500},
    "face_of_a_million_corners": {
        "scene.xml": _mesh("m.obj"),
        "m.obj": _ONE_FACE + b"f" + b" 1 2 3" * 333_333,
    },
    "mesh_of_spheres": _asset(
        '<mesh name="m" builtin="sphere" params="20"/>', '<geom type="mesh" mesh="m"/>'
    ),
    "deep_bodies": _model("<body>" * 100_000 + "</body>" * 100_000),
    "many_bodies": _model('<body><geom size="1"/></body>' * 100_000),
    "numbers": _model('<geom size="1" pos="nan 1e308 -1e308"/><geom size="1e308"/>'),
    "arena": _model(before='<size memory="500G" nuser_geom="1000000000"/>'),
    "user_data": _model(
        f'<geom size="1" user="{"1 " * 100_000}"/>' + '<geom size="1"/>' * 4000,
    ),
    "custom": _model(before='<custom><numeric name="n" size="2000000000"/></custom>'),
    "cloth": _model('<flexcomp name="c" type="grid" count="5000 5000 1" spacing="1 1 1"/>'),
    "cable": _model(
        '<composite prefix="c" type="cable" count="10000000 1 1" size="1 0 0" curve="s">'
        '<geom size=".01"/></composite>'
    ),
    "limits": _largest,
    "huge_file": lambda folder: _sparse(folder / "scene.xml", 10**12, b"<mujoco>"),
    "glb_without_data": {
        "scene.glb": _glb(_gltf_scene(accessors=[_HUGE_ACCESSOR])),
    },
    "glb_nodes": {
        "scene.glb": _glb(
            {
                **_gltf_scene(accessors=[{**_HUGE_ACCESSOR, "count": 3, "bufferView": 0}]),
                "nodes": [{"children": [i + 1] * 10} for i in range(12)] + [{"mesh": 0}],
                "buffers": [{"byteLength": 36}],
                "bufferViews": [{"buffer": 0, "byteLength": 36}],
            },
            struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0),
        ),
    },
    "glb_files": {
        "scene.glb": _glb(
            _gltf_scene(
                buffers=[{"uri": "../canary", "byteLength": 24}],
                bufferViews=[{"buffer": 0, "byteLength": 24}],
                accessors=[{**_HUGE_ACCESSOR, "count": 2, "bufferView": 0}],
            )
        ),
    },
    "ply_header": {"scene.ply": _PLY},
    "stl_header": {"scene.stl": _STL},
    "obj_material": {
        "scene.obj": b"mtllib ../canary\n" + _ONE_FACE + b"f 1 2 3\n",
    },
}
"""What is written for each kind: scene.xml or another scene, several files, or a function of the
folder or path that writes it. The file canary is in the folder above."""


def _zip(path: Path) -> None:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("scene.xml", b" " * 10**8)


def make(kind: str, folder: Path) -> Path:
    """Write a scene of `HOSTILE` into a new folder in `folder`; return the scene's path."""
    (folder / "canary").write_text(SECRET)
    inside = folder / kind
    inside.mkdir()
    made = HOSTILE[kind]
    files = {"scene.xml": made} if isinstance(made, bytes) else made
    if not isinstance(files, dict):
        files(inside)
        files = {}
    for name, content in files.items():
        if isinstance(content, bytes):
            (inside / name).write_bytes(content)
        else:
            content(inside / name)
    return next(path for path in inside.iterdir() if path.stem == "scene")


def attempt(path: Path) -> dict[str, Any]:
    """Load a scene in a process of its own; return its seconds, bytes, status and messages."""
    begun = time.monotonic()
    with tempfile.TemporaryFile() as output:
        command = [sys.executable, "-c", _PROGRAM, str(path)]
        process = subprocess.Popen(command, stdout=output, stderr=output, stdin=subprocess.DEVNULL)
        timer = threading.Timer(_PATIENCE_S, process.kill)
        timer.start()
        _, status, usage = os.wait4(process.pid, 0)
        timer.cancel()
        process.returncode = os.waitstatus_to_exitcode(status)
        output.seek(0)
        text = output.read().decode(errors="replace")
    return {
        "seconds": time.monotonic() - begun,
        "cpu_seconds": usage.ru_utime + usage.ru_stime,
        "bytes": usage.ru_maxrss * 1024,  # also those of processes that it has started
        "status": process.returncode,
        "text": text,
    }


def fault_of(result: dict[str, Any]) -> str | None:
    """Return what is wrong with the result of an attempt; None if nothing is."""
    if result["status"] not in (0, 1) or "Traceback" in result["text"]:
        return f"ended with {result['status']}: {result['text'][-300:]}"
    if SECRET in result["text"]:
        return "revealed another file"
    if result["bytes"] > _MOST_BYTES:
        return f"took {result['bytes'] / 2**30:.1f} GiB"
    if result["seconds"] > _MOST_SECONDS:
        return f"took {result['seconds']:.0f} s"
    return None


def bench_hostile(setup: Setup) -> Figures:
    """Load every kind of hostile scene in a process of its own.

    Returns:
        "world_hostile", how many ran code, crashed, revealed a file, or took more than 2 GiB or
        20 s, of "world_hostile_total"; "world_hostile_gib" and "world_hostile_s", the most that
        any took; "world_hostile_faults" by kind.
    """
    results = {}
    for kind in HOSTILE:
        with tempfile.TemporaryDirectory() as folder:
            path = make(kind, Path(folder))
            results[kind] = attempt(path)
            if (Path(folder) / "canary").read_text() != SECRET:
                results[kind]["text"] += SECRET
    faults = {kind: fault for kind, of in results.items() if (fault := fault_of(of))}
    return {
        "world_hostile": len(faults),
        "world_hostile_total": len(results),
        "world_hostile_gib": max(of["bytes"] for of in results.values()) / 2**30,
        "world_hostile_s": max(of["seconds"] for of in results.values()),
        "world_hostile_faults": faults,
    }
