"""`drone-rl scene`: its settings."""

import io
import logging
from pathlib import Path
from typing import Annotated

from drone_rl.cli.settings import CommandSettings
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import write_all_atomically
from drone_rl.utils.schema import OneOf, Real

_log = logging.getLogger(__name__)


class SceneCommand(CommandSettings):
    """Describe and render a scene file: drone-rl scene FILE.

    Prints its size, objects, sites, free space, and what the task reach lacks; writes images from
    above and from the first start.
    """

    unnamed = "file"
    file: str = ""
    """An MJCF file, a mesh (OBJ, STL, PLY or GLB), or indoor or outdoor."""
    up: Annotated[str, OneOf(("z", "y"))] = "z"
    """Axis of a mesh that points up; task.scene_up of a training."""
    scale: Annotated[float, Real(1e-6, 1e6)] = 1.0
    """Metres of one unit of a mesh; task.scene_scale of a training."""
    drone_size: Annotated[float, Real(0.01, 10.0, unit="m")] = 0.3
    """Diameter of the drone for which free space is measured."""

    def run(self, folder: Path) -> tuple[int, None]:
        """Describe the scene; return the exit status."""
        if not self.file:
            raise InputError("file= is empty; give a scene: drone-rl scene FILE")
        from drone_rl.sim.scene_overview import describe, render_above, render_start  # slow
        from drone_rl.sim.scenes import load_scene

        scene = load_scene(self.file, self.up, self.scale)
        given = {"scene_up": self.up, "scene_scale": self.scale, "drone_size": self.drone_size}
        usual = ("z", 1.0, type(self)().drone_size)
        task = {name: value for name, value in given.items() if value not in usual}
        task = {"scene": self.file, **task}
        print(describe(scene, task, self.drone_size), flush=True)
        images = {"above.png": render_above(scene), "start.png": render_start(scene)}
        contents = {}
        for name, image in images.items():
            image.save(file := io.BytesIO(), "png")
            contents[folder / name] = file.getvalue()
        write_all_atomically(contents)
        _log.info("written: %s in %s", " and ".join(images), folder)
        return 0, None
