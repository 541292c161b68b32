"""Threads, GPUs and appearances of MuJoCo Warp; test_renderers tests all else."""

from concurrent.futures import ThreadPoolExecutor

import pytest
import torch

from drone_rl.sim.rendering import Appearance
from drone_rl.sim.rendering.mujoco_warp import WarpRenderer
from drone_rl.sim.worlds import Worlds
from drone_rl.utils.errors import InputError
from drone_rl.utils.seeding import world_random_state


def started(**options):
    worlds = Worlds(3, **options)
    worlds.reset(torch.arange(3), [world_random_state(0, i) for i in range(3)])
    return worlds


def test_threads_can_build_and_render_concurrently():
    several = [started(renderer=WarpRenderer, num_shards=1) for _ in range(3)]
    with ThreadPoolExecutor(3) as pool:
        images = list(pool.map(lambda worlds: worlds.render(worlds.state), several))
    assert torch.equal(images[0], images[1]) and torch.equal(images[0], images[2])
    for worlds in several:
        worlds.close()


@pytest.mark.gpu
@pytest.mark.skipif(not torch.cuda.is_available(), reason="needs a CUDA GPU")
def test_gpu_renders_the_same_as_cpu():
    on_cpu, on_gpu = started(), started(device="cuda", renderer=WarpRenderer)
    image = on_gpu.render(on_gpu.state).cpu()
    difference = (image.int() - on_cpu.render(on_cpu.state).int()).abs()
    assert float(difference.float().mean()) < 0.5


@pytest.mark.parametrize("look", [{"fog_visibility": 50.0}, {"exposure": 2.0}, {"shadows": 1}])
def test_unsupported_appearances_raise(look):
    worlds = started(renderer=WarpRenderer, num_shards=1, appearance=Appearance(**look))
    with pytest.raises(InputError, match="give renderer=raytrace"):
        worlds.render(worlds.state)
    worlds.close()
