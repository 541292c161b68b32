import json

import numpy as np
import torch

from drone_rl.config import DynamicsSettings
from drone_rl.explanations.rollouts import RENDERED, collect, step_fields
from drone_rl.explanations.scenes import Region
from drone_rl.sim.actions import MOVES
from drone_rl.sim.dynamics import BodyState, ComputerVision, FlightState, Quadrotor
from drone_rl.sim.tasks import CollectCubes

FLOWN = step_fields(CollectCubes(), MOVES)


def test_everything_is_known_of_an_analysed_frame(dataset):
    assert len(dataset) == 60
    assert set(dataset.arrays) == {*FLOWN, *RENDERED} == set(dataset.meta["fields"])


def test_redrawn_frames_are_those_that_the_policy_saw(dataset, scenes):
    again = scenes.transform(torch.from_numpy(dataset.frames))
    np.testing.assert_allclose(again.numpy(), dataset.observations, atol=1e-6)


def test_the_file_loads_without_this_package(dataset, tmp_path):
    dataset.save(tmp_path / "data.npz")
    with np.load(tmp_path / "data.npz", allow_pickle=False) as file:
        meta = json.loads(str(file["meta"]))
        assert meta["fields"]["drone"].startswith("position before the action, metres")
        assert file["features/fc_relu1"].shape == (60, 8)
        np.testing.assert_array_equal(file["frames"], dataset.frames)
        assert meta["features"] == ["relu1", "fc_relu1"]


def test_the_file_holds_every_step_of_the_flights(dataset, world, tmp_path):
    flights = collect(*world[:2], num_episodes=4)
    dataset.save(tmp_path / "data.npz", flights)
    with np.load(tmp_path / "data.npz") as file:
        names = {name for name in file.files if name.startswith("flights/")}
        assert names == {f"flights/{name}" for name in FLOWN}
        np.testing.assert_array_equal(file["flights/actions"], flights.actions)
        assert {"features/relu1", "features/fc_relu1"} < set(file.files)


def test_offset_is_seen_from_the_drone(dataset):
    t = int(np.flatnonzero(dataset.next_target == 0)[0])
    expected = dataset.cubes[t, 0, :2] - dataset.drone[t, :2]
    np.testing.assert_allclose(dataset.offset(CollectCubes())[t], expected)
    near = np.flatnonzero((dataset.next_target == 0) & (dataset.step < 5))
    assert (dataset.regions == Region.NEXT_TARGET).any((1, 2))[near].all()


def test_without_a_next_cube_there_is_no_offset(dataset):
    dataset.arrays["present"] = np.zeros_like(dataset.present)
    assert np.isnan(dataset.offset(CollectCubes())).all()


def test_recalled_drones_of_a_task_without_dynamics_are_level(dataset):
    state = dataset.state(CollectCubes())
    assert state.body.attitude.unique(dim=0).tolist() == [[1.0, 0.0, 0.0, 0.0]]


def test_a_recorded_attitude_is_that_of_the_recalled_world(dataset):
    dataset.arrays["attitude"][3] = [0.6, 0.0, 0.0, 0.8]
    attitude = dataset.state(CollectCubes()).body.attitude
    torch.testing.assert_close(attitude[3], torch.tensor([0.6, 0.0, 0.0, 0.8]).double())


def test_a_recalled_drone_can_go_on_by_the_dynamics_that_it_has(dataset):
    flight = Quadrotor(DynamicsSettings(mode="simple_flight"))
    body, plain = (dataset.state(CollectCubes(), of).body for of in (flight, ComputerVision()))
    assert isinstance(body, FlightState) and type(plain) is BodyState
    for name in ("position", "attitude", "velocity"):
        torch.testing.assert_close(getattr(body, name), getattr(plain, name))
    assert flight.step(body, torch.zeros(len(body), dtype=torch.int64)).velocity.any()


def test_offset_follows_the_heading_of_a_turned_drone(dataset):
    t = int(np.flatnonzero(dataset.next_target == 0)[0])
    x, y = (dataset.cubes[t, 0] - dataset.drone[t])[:2]
    dataset.arrays["attitude"][t] = [0.5**0.5, 0.0, 0.0, 0.5**0.5]  # it looks to the left
    np.testing.assert_allclose(dataset.offset(CollectCubes())[t], (y, -x), atol=1e-5)
