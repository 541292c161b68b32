"""The GPU kernel, run on a CPU, renders the same images as the CPU kernel."""

import pytest
import torch

from drone_rl.sim.rendering import Appearance, Texture
from drone_rl.sim.rendering.scene import SemanticClass
from tests.sim.rendering.raytrace.test_renderer import (
    GpuLauncher,
    Raytracer,
    render,
    scattered,
    scene,
    view,
)

APPEARANCE = Appearance(
    zenith=(0.1, 0.2, 0.6),
    fog_visibility=60.0,
    shadows=1,
    textures={
        SemanticClass.GROUND: Texture(images=("grid",), size=3.0),
        SemanticClass.TARGET: Texture(images=("noise",), size=1.0),
    },
)


@pytest.mark.parametrize("modality", ["rgb", "depth", "segmentation"])
def test_both_kernels_render_the_same_images(modality):
    both = [Raytracer(scene(), num_envs=32, num_shards=2) for _ in range(2)]
    both[1]._launcher = GpuLauncher("cpu")
    poses = scattered(32, 0.4)
    ours, theirs = (render(r, view(modality), poses, APPEARANCE).double() for r in both)
    assert ((ours - theirs).abs() > 1e-3).double().mean() < 1e-3
    plain = render(both[0], view(modality), poses).double()
    assert (plain != ours).double().mean() > 0.5 if modality == "rgb" else torch.equal(plain, ours)
    for renderer in both:
        renderer.close()
