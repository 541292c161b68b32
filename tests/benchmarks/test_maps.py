import numpy as np
import pytest
import torch

from benchmarks.maps import bench_maps, expert, imagined, shipped
from drone_rl.explanations.scenes import Scenes
from drone_rl.sim.actions import Move


def test_no_adversarial_map_is_trusted_and_true_maps_are_found(tmp_path):
    found = bench_maps(tmp_path, quick=True)
    assert found["placebo_maps_trusted"] == 0 and found["placebo_maps_total"] >= 60
    assert found["planted_maps_found"] == 1.0 and found["planted_maps_total"] >= 3
    assert found["planted_maps_blind_trusted"] == 0 and found["planted_maps_blind_total"] >= 1


def test_shipped_policies_with_discrete_moves_are_used():
    """`flight_velocity` has continuous actions, and others have two frames; they are left out."""
    networks = shipped(torch.zeros(1, 25, 64))
    assert {"good", "poor", "proved", "flight"} <= networks.keys()
    assert not networks.keys() & {"flight_velocity", "robust", "pillars_good"}
    assert all(network(torch.zeros(2, 1, 25, 64)).shape == (2, 3) for network in networks.values())


@pytest.fixture
def scenes(make_pipeline):
    return Scenes(make_pipeline()[0])


def test_imagined_states_can_occur_in_episodes(scenes):
    state, episode = imagined(scenes, 10, 4)
    assert episode.tolist() == np.repeat(np.arange(10), 4).tolist()
    assert torch.equal(state.cubes[0], state.cubes[3]) and not torch.equal(
        state.cubes[0], state.cubes[4]
    )
    settings = scenes.worlds.task.settings
    assert state.drone[:, 1].abs().max() <= settings.lateral_bound
    ahead = state.cubes[..., 0] > state.drone[:, None, 0]
    assert not (state.present & ~ahead).any()
    assert state.present.any(1).all()


def test_the_expert_moves_towards_the_next_cube(scenes):
    state, _ = imagined(scenes, 10, 4)
    offset = state.cubes[torch.arange(40), state.next_cube, 1] - state.drone[:, 1]
    wanted = expert(scenes, state)
    assert (wanted[offset > 2] == Move.LEFT).all() and (wanted[offset < -2] == Move.RIGHT).all()
    assert set(wanted.tolist()) == {0, 1, 2}
