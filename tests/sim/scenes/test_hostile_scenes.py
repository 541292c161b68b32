"""Scenes that were made to exhaust a machine, or to read other files: one line, at once."""

import pytest

from benchmarks.worlds.hostile import HOSTILE, SECRET, make
from drone_rl.sim.scenes import load_scene
from drone_rl.utils.errors import InputError

HARMLESS = {"plugin", "arena", "user_data", "custom"}
"""What is asked for is left out."""
SLOW = {"limits", "glb_nodes", "glb_without_data", "ply_header", "stl_header", "obj_material"}


@pytest.mark.parametrize("kind", sorted(HOSTILE.keys() - SLOW))
def test_hostile_scenes_are_refused_or_harmless(kind, tmp_path):
    path = make(kind, tmp_path)
    if kind in HARMLESS:
        assert load_scene(path).model.ngeom >= 1
        return
    with pytest.raises(InputError) as error:
        load_scene(path)
    message = str(error.value)
    assert "\n" not in message and message.startswith("scene=") and SECRET not in message
