"""The world of the page: rules, observations, wind, light, and changes of who flies."""

import pytest
import torch

import drone_rl
from drone_rl.config.networks import Lstm, SmallCnn
from drone_rl.config.transforms import Gray, Noise, Stack
from drone_rl.envs import GrayPixels
from drone_rl.flight.settings import CAMERAS
from drone_rl.sim.dynamics import FlightState, Quadrotor
from tests.house import write_house
from tests.untrained import untrained

FORWARD = torch.tensor([0])


def turned(world, x, y, z, yaw):
    """Move the drone; the heading is in radians to the left."""
    half = torch.tensor(yaw / 2, dtype=torch.float64)
    attitude = torch.stack([half.cos(), half * 0, half * 0, half.sin()])[None]
    place = torch.tensor([[x, y, z]], dtype=torch.float64)
    world.move(world.body.moved(place, attitude))


def test_an_action_moves_the_drone_by_a_metre(make_world):
    world = make_world()
    assert world.body.position[0].tolist() == [0.0, 0.0, 2.5]
    assert [round(place[0]) for place in world.objects] == [15, 24, 33]
    assert world.step(FORWARD) == 0.0
    assert world.body.position[0].tolist() == [1.0, 0.0, 2.5]
    assert (world.goals, world.end, world.is_over) == ((0, 3), None, False)


def test_a_scene_is_no_object_of_the_map(make_world, tmp_path):
    task = {"name": "reach", "scene": [str(write_house(tmp_path))]}
    actions = {"kind": "moves_turning"}
    world = make_world(untrained(SmallCnn(), task=task, actions=actions))
    (goal,) = world.objects
    assert goal == pytest.approx((5.0, 3.2, 1.0))


def test_cubes_vanish_when_a_person_touches_them_and_nothing_ends(make_world):
    world = make_world()
    x, y, z = world.objects[1]
    turned(world, x + 1.6, y, z, 0.0)  # touched: 1.65 m = (2.5 + 0.8) / 2
    assert world.objects[1] is None and world.goals == (1, 3)  # the first cube is still ahead
    turned(world, 100.0, 50.0, 30.0, 0.0)  # behind all cubes and beyond every boundary
    assert not world.is_over
    assert world.objects[0] is not None and world.objects[2] is not None
    world.align()
    world.step(FORWARD)
    assert world.end == "behind the last cube" and world.is_over


def test_a_new_episode_has_other_cubes_and_counts(make_world):
    world = make_world()
    before = world.objects
    world.step(FORWARD)
    world.reset()
    assert world.episode == 2 and world.reward == 0.0
    assert world.objects != before
    assert world.body.position[0].tolist() == [0.0, 0.0, 2.5]


def test_a_new_episode_follows_a_flight_of_another_kind_of_body(make_world):
    world = make_world()
    world.move(Quadrotor(world.flight_dynamics).start(world.body.position))
    assert isinstance(world.body, FlightState)
    world.reset()
    assert not isinstance(world.body, FlightState)
    world.step(FORWARD)


def test_moves_begin_level_at_the_tasks_altitude(make_world):
    world = make_world()
    turned(world, 3.0, -2.0, 9.0, 1.0)
    world.align()
    assert world.body.position[0].tolist() == [3.0, -2.0, 2.5]
    assert world.body.attitude[0].tolist() == [1.0, 0.0, 0.0, 0.0]


def test_a_drone_with_dynamics_flies_on_and_gets_targets(make_world):
    world = make_world("flight")
    flying = Quadrotor(world.flight_dynamics).start(torch.tensor([[3.0, -2.0, 9.0]]).double())
    flying.velocity[0, 0] = 2.0
    world.move(flying)
    world.align()
    assert world.body.position[0].tolist() == [3.0, -2.0, 9.0]
    assert world.body.velocity[0].tolist() == [2.0, 0.0, 0.0]
    assert world.body.reference[0].tolist() == [3.0, -2.0, 0.0, 2.5]


def test_the_observation_is_that_of_the_policys_environment(make_world):
    world = make_world(seed=4)
    policy = drone_rl.load_policy("good")
    env = policy.make_env(1, seed=4)
    expected = env.reset()["pixels"]
    env.close()
    seen = world.see()
    assert torch.equal(seen.observation, expected)
    assert int(seen.action) == policy.act(seen.frame[0])
    assert sum(seen.probabilities) == pytest.approx(1.0)
    assert world.see() is seen  # computed once for each state
    world.step(FORWARD)
    assert world.see() is not seen


def test_stacked_frames_are_those_of_the_last_actions(make_world):
    world = make_world(untrained(SmallCnn(channels=(2,), hidden=(4,)), Gray(), Stack(N=2)))
    first = world.see().observation
    assert torch.equal(first[0, 0], first[0, 1])
    for _ in range(8):
        before = world.see().observation[0, 1]
        world.step(FORWARD)
    assert torch.equal(world.see().observation[0, 0], before)
    assert not torch.equal(world.see().observation[0, 1], before)
    world.move(world.body)  # a person takes over: there are no frames of actions
    after = world.see().observation
    assert torch.equal(after[0, 0], after[0, 1])


def test_a_policy_that_remembers_keeps_its_memory_from_step_to_step(make_world):
    """As its network evaluated step by step, from a new state where a person takes over."""
    policy = untrained(Lstm(channels=(2,), hidden=(4,), memory=8))
    network, world = policy.make_network(), make_world(policy)
    memory = network.start(1)

    @torch.no_grad()
    def assert_follows():
        nonlocal memory
        seen = world.see()
        outputs, memory = network.step(seen.observation, memory)
        assert seen.probabilities == pytest.approx(outputs.softmax(-1)[0].tolist())

    for _ in range(3):
        assert_follows()
        before = world.see().probabilities
        world.set_light(0.2)  # the state is seen again, from the same memory
        assert world.see().probabilities != before
        world.set_light(1.0)
        assert world.see().probabilities == before
        world.step(world.see().action)
    assert_follows()
    for change in (lambda: world.move(world.body), world.reset):
        change()
        memory = network.start(1)
        assert_follows()


def test_a_policy_observes_through_its_camera_faults(make_world):
    world = make_world(untrained(SmallCnn(channels=(2,), hidden=(4,)), Gray(), Noise(strength=0.2)))
    noises = []
    for _ in range(3):
        world.step(FORWARD)
        seen = world.see()
        noises.append(seen.observation - GrayPixels()._apply_transform(seen.frame))
        world.set_light(0.5)
        world.see()
        world.set_light(1.0)  # the noise of a state is the same in any light
        assert torch.equal(world.see().observation, seen.observation)
    assert all(0.1 < noise.std() < 0.25 for noise in noises)
    assert not torch.equal(noises[0], noises[1])


def test_wind_blows_from_its_direction(make_world):
    world = make_world("flight")
    assert world.wind == (0.0, 0.0)
    world.set_wind(5.0, 0.0)
    assert world.flight_dynamics.wind == pytest.approx((-5.0, 0.0, 0.0))
    world.set_wind(4.0, 90.0)  # from the right, to the left
    assert world.worlds.dynamics.settings.wind == pytest.approx((0.0, 4.0, 0.0), abs=1e-12)
    assert world.conditions["dynamics"].wind == pytest.approx((0.0, 4.0, 0.0), abs=1e-12)


def test_the_policys_own_wind_is_the_first_one(make_world):
    policy = drone_rl.load_policy("flight").in_dynamics(wind=(0.0, -3.0, 1.0))
    world = make_world(policy)
    assert world.wind == pytest.approx((3.0, 270.0))
    world.set_wind(2.0, 180.0)
    assert world.flight_dynamics.wind == pytest.approx((2.0, 0.0, 1.0), abs=1e-12)


def test_light_scales_images_of_all_cameras(make_world):
    world = make_world()
    whole, seen = world.render("front_center").double(), world.see().frame.double()
    world.set_light(0.5)
    half = world.render("front_center").double()
    assert (half - 0.5 * whole).abs().max() <= 1.0
    assert (world.see().frame - 0.5 * seen).abs().max() <= 1.0
    world.set_light(1.0)
    assert torch.equal(world.render("front_center").double(), whole)


def test_every_camera_has_an_image_of_its_own(make_world):
    world = make_world()
    images = [world.render(camera) for camera in CAMERAS]
    assert all(image.shape == (144, 256, 3) and image.dtype == torch.uint8 for image in images)
    assert len({bytes(image.numpy()) for image in images}) == len(CAMERAS)


@pytest.mark.parametrize(
    ("policy", "speed", "seconds"),
    [("good", 4.0, 0.25), ("good", 0.5, 2.0), ("flight", 4.0, 0.198), ("flight", 1.0, 0.198)],
)
def test_an_action_lasts_as_long_as_its_move_takes(make_world, policy, speed, seconds):
    assert make_world(policy).seconds(speed) == pytest.approx(seconds)


@pytest.mark.parametrize("wind", [(0.0, 5.0, 0.0), (3.0, 1.0, 0.5), (0.1, -0.7, 0.0)])
def test_demonstrations_note_the_exact_wind_of_the_policy(make_world, wind):
    policy = drone_rl.load_policy("flight").in_dynamics(wind=wind)
    assert make_world(policy).conditions["dynamics"] == policy.dynamics
