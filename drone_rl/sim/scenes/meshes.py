"""Mesh files as scenes, read in a process of their own."""

import os
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from drone_rl.sim.scenes.elements import Element, parse
from drone_rl.sim.scenes.reader import Reading
from drone_rl.utils.errors import InputError

ENDINGS = (".obj", ".stl", ".ply", ".glb")
_PATIENCE_S = 60.0
"""Of a process whose own limit is a sixth of it, on a busy machine."""


def read_mesh(file: Path, reading: Reading, up: str, scale: float) -> Element:
    """Return a mesh file as MJCF, with its files in `reading`.

    Args:
        file: An OBJ, STL, PLY or GLB file.
        reading: Where its files are noted.
        up: See `load_scene`.
        scale: See `load_scene`.

    Raises:
        InputError: The file can't be read, or exceeds a limit.
    """
    program = [sys.executable, "-m", "drone_rl.sim.scenes.mesh_reader", str(file), up, repr(scale)]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    environment |= dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"), "1")
    with tempfile.TemporaryFile() as output, tempfile.TemporaryFile() as errors:
        try:
            done = subprocess.run(
                program,
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=errors,
                env=environment,
                timeout=_PATIENCE_S,
            )
        except subprocess.TimeoutExpired:
            raise InputError("it takes too long to read; give a simpler mesh") from None
        errors.seek(0)
        lines = errors.read(10_000).decode(errors="replace").splitlines()
        if done.returncode:
            mistakes = [line for line in lines if line.startswith("mistake: ")]
            reason = "it takes more than 2 GiB of memory; give a simpler mesh"
            if done.returncode in (-signal.SIGXCPU, -signal.SIGKILL):
                reason = "it takes more than 10 s to read; give a simpler mesh"
            raise InputError(mistakes[-1].removeprefix("mistake: ") if mistakes else reason)
        output.seek(0)
        made = np.load(output, allow_pickle=False)
        for version in made["versions"]:
            path, _, numbers = str(version).rpartition("\n")
            size, time = numbers.split()
            reading.folder.versions[Path(path)] = int(size), int(time)
        reading.folder.hash.update(str(made["hash"]).encode())
        reading.files |= {
            n.removeprefix("file "): made[n].tobytes() for n in made.files if " " in n
        }
        root = parse(str(made["mjcf"]).encode(), file)
    for mesh in root.every("mesh"):
        mesh.attributes["inertia"] = "shell"
    return root
