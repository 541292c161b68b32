"""What sets it apart: many threads that build it, and GPUs. All else is in test_renderers."""

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


def test_several_threads_may_build_and_draw_at_a_time():
    several = [started(renderer=WarpRenderer, num_shards=1) for _ in range(3)]
    with ThreadPoolExecutor(3) as pool:
        pictures = list(pool.map(lambda worlds: worlds.render(worlds.state), several))
    assert torch.equal(pictures[0], pictures[1]) and torch.equal(pictures[0], pictures[2])
    for worlds in several:
        worlds.close()


@pytest.mark.gpu
@pytest.mark.skipif(not torch.cuda.is_available(), reason="needs a CUDA GPU")
def test_gpu_draws_what_the_cpu_draws():
    on_cpu, on_gpu = started(), started(device="cuda", renderer=WarpRenderer)
    picture = on_gpu.render(on_gpu.state).cpu()
    difference = (picture.int() - on_cpu.render(on_cpu.state).int()).abs()
    assert float(difference.float().mean()) < 0.5


@pytest.mark.parametrize("look", [{"fog": 50.0}, {"exposure": 2.0}, {"shadows": 1}])
def test_what_it_can_not_draw_is_refused_before_it_draws(look):
    worlds = started(renderer=WarpRenderer, num_shards=1, appearance=Appearance(**look))
    with pytest.raises(InputError, match="give renderer=raytrace"):
        worlds.render(worlds.state)
    worlds.close()
