import threading
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
import torch

from drone_rl.sim.cameras import CHASE, DRONE_CAMERAS
from drone_rl.sim.collect_cubes import make_environment
from drone_rl.sim.renderer import View, WarpRenderer, check_device
from drone_rl.sim.settings import CameraSettings
from drone_rl.sim.worlds import CubeWorlds
from drone_rl.utils.errors import InputError
from drone_rl.utils.seeding import world_random_state


@pytest.fixture(scope="module")
def worlds():
    worlds = CubeWorlds(3)
    worlds.reset(torch.arange(3), [world_random_state(0, i) for i in range(3)])
    yield worlds
    worlds.close()


def test_any_part_of_a_batch_is_the_same_picture(worlds):
    together = worlds.render(worlds.state)
    assert together.shape == (3, 25, 64, 3)
    assert together.dtype == torch.uint8
    for i in range(3):
        alone = worlds.render(worlds.state[torch.tensor([i])])
        assert torch.equal(alone[0], together[i])


def test_shards_draw_what_one_draws(worlds):
    single = CubeWorlds(3, num_shards=1)
    double = CubeWorlds(3, num_shards=2)
    assert torch.equal(single.render(worlds.state), double.render(worlds.state))
    single.close()
    double.close()


def test_recording_a_frame_takes_in_nothing_that_other_threads_draw(worlds):
    expected = worlds.render(worlds.state)
    stop = threading.Event()

    def draw_on() -> list[bool]:
        same = []
        while not stop.is_set():
            same.append(torch.equal(worlds.render(worlds.state), expected))
        return same

    with ThreadPoolExecutor(1) as pool:
        others = pool.submit(draw_on)
        fresh = CubeWorlds(3, num_shards=1)  # builds, and records one, two and three worlds
        pictures = [fresh.render(worlds.state[torch.arange(n)]) for n in (1, 2, 3)]
        stop.set()
    assert all(torch.equal(picture, expected[: len(picture)]) for picture in pictures)
    assert others.result()
    assert all(others.result())
    fresh.close()


def test_more_imagined_worlds_than_there_are(worlds):
    index = torch.tensor([0, 1, 2, 0, 1])
    assert torch.equal(
        worlds.render(worlds.state[index]), worlds.render(worlds.state)[[0, 1, 2, 0, 1]]
    )


def test_depth_of_the_cube_ahead(worlds):
    state = worlds.state[torch.tensor([0])]
    state.cubes[0, :, 1] = 0.0
    depth = worlds.render(state, worlds.view(modality="depth"))
    # camera 0.4 m ahead of the drone's centre, front face 1.25 m before the cube's centre
    assert depth[0, 12, 32].item() == pytest.approx(15.0 - 1.25 - 0.4, abs=1e-3)
    assert depth[0, 0, 0].item() == 0.0  # sky


def test_segmentation_names_what_is_seen(worlds):
    state = worlds.state[torch.tensor([0])]
    state.cubes[0, :, 1] = 0.0
    seen = worlds.render(state, worlds.view(modality="segmentation"))[0]
    name = worlds.model.geom
    assert name(int(seen[12, 32])).name == "cube_0/geom"
    assert name(int(seen[24, 32])).name == "floor"
    assert seen[0, 0].item() == -1


@pytest.mark.parametrize("camera", [c.name for c in (*DRONE_CAMERAS, CHASE)])
def test_every_camera_can_be_asked_for(worlds, camera):
    picture = worlds.render(worlds.state, worlds.view(camera, height=20, width=30))
    assert picture.shape == (3, 20, 30, 3)


def test_drone_is_unseen_by_itself_and_seen_by_the_chase_camera(worlds):
    view = worlds.view(CHASE.name, "segmentation", 40, 60, show_drone=True)
    seen = {
        worlds.model.geom(int(i)).name for i in worlds.render(worlds.state, view).unique() if i >= 0
    }
    assert "drone/hull" in seen
    own = worlds.render(worlds.state, worlds.view("bottom_center", "segmentation"))
    assert {worlds.model.geom(int(i)).name for i in own.unique() if i >= 0} == {"floor"}


def test_vanished_cube_is_not_drawn(worlds):
    state = worlds.state[torch.tensor([0])]
    state.collected[:] = True
    seen = worlds.render(state, worlds.view(modality="segmentation")).unique()
    assert {worlds.model.geom(int(i)).name for i in seen if i >= 0} == {"floor"}


def test_bad_requests_are_refused(worlds):
    with pytest.raises(InputError, match="choose from"):
        worlds.render(worlds.state, worlds.view("no_such_camera"))
    with pytest.raises(InputError, match="rgb, depth or segmentation"):
        View(camera="x", height=1, width=1, modality="normals")
    with pytest.raises(InputError, match="cpu, cuda"):
        check_device("tpu")
    renderer = WarpRenderer(worlds.model, worlds.policy_view, max_worlds=1)
    with pytest.raises(ValueError, match="max_worlds"):
        renderer.render(torch.zeros(2, 7), torch.zeros(2, 3, 3))


@pytest.mark.skipif(torch.cuda.is_available(), reason="there is a GPU")
def test_cuda_without_gpu_is_refused():
    with pytest.raises(InputError, match="give device=cpu"):
        check_device("cuda")


@pytest.mark.gpu
@pytest.mark.skipif(not torch.cuda.is_available(), reason="needs a CUDA GPU")
def test_gpu_draws_what_the_cpu_draws(worlds):
    on_gpu = CubeWorlds(3, device="cuda")
    picture = on_gpu.render(worlds.state.to("cuda")).cpu()
    difference = (picture.int() - worlds.render(worlds.state).int()).abs()
    assert float(difference.float().mean()) < 0.5


@pytest.mark.render
def test_pictures_agree_with_opengl(egl):
    """Both renderers on the same poses: equal but for edges, where OpenGL blends samples."""
    camera = CameraSettings(width=256, height=100)
    env = make_environment(camera=camera, random_state=world_random_state(0, 0))
    worlds = CubeWorlds(1, camera=camera)
    worlds.reset(torch.arange(1), [world_random_state(0, 0)])
    timestep = env.reset()
    for action in (0, 0, 1, 0, 2, 2, 0, 0, 0, 0, 0, 0):
        traced = worlds.render(worlds.state)[0].numpy().astype(int)
        drawn = timestep.observation["drone/front_center"].astype(int)
        difference = np.abs(traced - drawn).max(-1)
        assert np.median(difference) <= 2
        assert (difference > 8).mean() < 0.04  # edges and the horizon's haze
        timestep = env.step(action)
        worlds.step(torch.arange(1), torch.tensor([action]))
    worlds.close()
