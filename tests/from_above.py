"""A box of 1 m on the ground, viewed from 10 m above; a pixel covers 0.25 m of the ground."""

import mujoco
import torch

from drone_rl.sim.rendering import Poses, Raytracer, Scene, View
from drone_rl.sim.rendering.raytrace.renderer import GpuLauncher
from drone_rl.sim.rendering.scene import SemanticClass

SIZE = 40
XML = """<mujoco><statistic extent="1"/>
<visual><headlight active="0"/><map znear="0.05" zfar="60"/></visual>
<worldbody>
<light directional="true" dir="1 0 -1" ambient=".4 .4 .4" diffuse=".6 .6 .6" castshadow="false"/>
<geom type="plane" size="0 0 1" rgba="1 .5 0 1"/>
<geom type="{kind}" size="{size}" pos="0 0 .5" rgba="0 0 1 1"/>
<camera name="down" pos="0 0 10" xyaxes="1 0 0 0 1 0" fovy="53.13010235"/>
<camera name="ahead" pos="0 0 10" xyaxes="0 -1 0 0 0 1" fovy="90"/>
</worldbody></mujoco>"""
LAUNCHERS = ("cores", "pixels")


def tracer(launcher="cores", kind="box", size=".5 .5 .5"):
    model = mujoco.MjModel.from_xml_string(XML.format(kind=kind, size=size))
    scene = Scene(model, (SemanticClass.GROUND, SemanticClass.TARGET), (-1, -1), (0.2, 0.4, 0.6))
    renderer = Raytracer(scene, num_envs=2, num_shards=2)
    if launcher == "pixels":
        renderer._launcher = GpuLauncher("cpu")  # the GPU kernels run on a CPU as well
    return renderer


def render(renderer, appearance=None, *, camera="down", modality="rgb", worlds=1):
    """Return images. Shape: (worlds, SIZE, SIZE, *)."""
    view = View(cameras=(camera,), height=SIZE, width=SIZE, modalities=(modality,))
    attitude = torch.tensor([[1.0, 0.0, 0.0, 0.0]]).repeat(worlds, 1)
    poses = Poses(torch.zeros(worlds, 3), attitude, torch.zeros(worlds, 0, 3))
    return renderer.render(view, poses, appearance)[modality][:, 0]
