"""Scenes from files: MJCF and meshes as worlds in which tasks take place."""

from drone_rl.sim.scenes.scene_file import SceneFile, Site, load_scene, scene_names

__all__ = ["SceneFile", "Site", "load_scene", "scene_names"]
