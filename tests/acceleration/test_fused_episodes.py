"""Episodes of the fused kernel equal their replay step by step."""

import threading
from functools import partial

import pytest
import torch
from torchrl.envs import CatFrames
from torchrl.envs.utils import ExplorationType, set_exploration_type

from drone_rl.acceleration import FusedEpisodes, fused_episodes
from drone_rl.acceleration.fused_episodes import RolloutBuffer
from drone_rl.acceleration.fused_network import FusedNetwork
from drone_rl.collectors import EpisodeCollector
from drone_rl.config import (
    ActionSettings,
    AppearanceSettings,
    CameraSettings,
    DynamicsSettings,
    PillarsSettings,
    TaskSettings,
)
from drone_rl.config.inputs import (
    Altitude,
    Attitude,
    DepthImage,
    Goal,
    GrayImage,
    LastAction,
    Rates,
    RgbImage,
    SegmentationImage,
    Velocity,
    describe_inputs,
)
from drone_rl.config.transforms import Chromaticity, Crop
from drone_rl.config.transforms import Shift as ShiftSettings
from drone_rl.envs import (
    ChromaticityPixels,
    CropRows,
    DroneEnv,
    GrayPixels,
    Resize,
    RgbPixels,
    Shift,
    StandardizePixels,
)
from drone_rl.policies import MLP, OriginalCNN, SmallCNN, make_actor
from drone_rl.policies.actor import SquashedNormal
from drone_rl.policies.networks import InputsNetwork
from drone_rl.sim.dynamics import Quadrotor
from drone_rl.sim.dynamics.state import LOST
from drone_rl.sim.tasks.collect_cubes import CubesEnd
from tests.policies.halves import forward_backward, halves
from tests.second_task import Posts

SHORT = TaskSettings(num_cubes=2, first_distance=3.0, spacing=3.0, step_limit=12, front_margin=3.0)
REASON = ("next", "info", "end_reason")
DETERMINISTIC = ExplorationType.DETERMINISTIC


FLYING = DynamicsSettings(mode="simple_flight", wind=(0.5, -1.0, 0.2))


def make(
    task=SHORT,
    transforms=(GrayPixels, StandardizePixels),
    num_envs=5,
    network=None,
    dynamics=None,
    actions=None,
    appearance=None,
    inputs=None,
    **how,
):
    made = [transform() for transform in transforms]
    env = DroneEnv(
        num_envs,
        task,
        dynamics=dynamics,
        actions=actions,
        appearance=appearance,
        transforms=made,
        inputs=None if inputs is None else describe_inputs(inputs),
    )
    generator = torch.Generator().manual_seed(0)
    if network is None:
        names = [*env.observer.sources]
        shapes = {name: tuple(env.observation_spec[name].shape[1:]) for name in names}
        count, sizes = env.worlds.dynamics.actions.num_outputs, {"channels": (4,), "hidden": (8,)}
        images = {
            name: SmallCNN(shapes[name], count, **sizes, generator=generator)
            for name in env.observer.images
        }
        network = next(iter(images.values()))
        if inputs is not None:
            network = InputsNetwork(shapes, images, count, hidden=(8,), generator=generator)
        with torch.no_grad():
            network.layers.logits.weight.mul_(100)
    actor = make_actor(network, env.action_spec, generator)
    return EpisodeCollector(env, actor, **{"compiled": True, **how})


GIMBAL = FLYING.replace(camera_mount="gimbal")


DYNAMICS = (None, Quadrotor(FLYING), Quadrotor(GIMBAL))
TRANSFORMS = (
    lambda camera: [GrayPixels()],
    lambda camera: [GrayPixels(), StandardizePixels()],
    lambda camera: [
        GrayPixels(),
        Resize(height=camera.height, width=camera.width),
        StandardizePixels(),
    ],
)
NETWORKS = (
    {"channels": (4,), "hidden": ()},
    {"channels": (4, 3), "hidden": (8,)},
    {"channels": (2,), "hidden": (8, 5), "patch": 8},
)
WORLDS = (
    (SHORT, CameraSettings()),
    (SHORT.replace(vertical_bound=1.0), CameraSettings(width=40, height=24)),
    (SHORT.replace(num_cubes=1, lateral_bound=3.0), CameraSettings(horizontal_fov=80.0)),
)


def assert_replayed(batch, env):
    """Take the actions of a batch of five episodes again in equal environments."""
    state, ids = env.reset(), batch["collector", "traj_ids"]
    episodes = [batch[ids == i] for i in ids.unique()]
    assert len(episodes) == 5 and ids.tolist() == sorted(ids.tolist())
    for t in range(max(map(len, episodes))):
        is_on = torch.tensor([t < len(episode) for episode in episodes])
        rows = [episode[t] for episode in episodes if t < len(episode)]
        assert torch.equal(torch.stack([r["pixels"] for r in rows]), state["pixels"][is_on])
        action = env.action_spec.zero()
        action[is_on] = torch.stack([row["action"] for row in rows])
        state = env.step(state.set("action", action).set("_step", is_on))
        for key in (("next", "reward"), ("next", "done"), ("next", "truncated"), REASON):
            assert torch.equal(torch.stack([row[key] for row in rows]), state[key][is_on])
        for name in ("drone", "attitude"):
            if ("next", "info", name) in batch.keys(True):
                reported = torch.stack([row["next", "info", name] for row in rows])
                assert torch.equal(reported, state["next", "info", name][is_on])
        state = state["next"]


@pytest.mark.parametrize("first", range(3))
@pytest.mark.parametrize("second", range(3))
def test_fused_episodes_equal_their_replay_by_torchrl_bit_for_bit(first, second):
    """Nine combinations contain each pair of values of two of the four parts once."""
    dynamics, transforms = DYNAMICS[first], TRANSFORMS[second]
    task, camera = WORLDS[(first + second) % 3]

    def make_env():
        made = transforms(camera)
        return DroneEnv(5, task, dynamics=dynamics, camera=camera, transforms=made)

    generator, env, acting = torch.Generator().manual_seed(0), make_env(), make_env()
    shape, sizes = (
        tuple(env.observation_spec["pixels"].shape[1:]),
        NETWORKS[(first + 2 * second) % 3],
    )
    network = SmallCNN(shape, 3, **sizes, generator=generator)
    with torch.no_grad():
        network.layers.logits.weight.mul_(100)
    actor = make_actor(network, env.action_spec, generator)
    collector = EpisodeCollector(acting, actor, compiled=True, info=("drone", "attitude"))
    assert isinstance(collector.fused, FusedEpisodes)
    for _ in range(2):
        batch = collector.collect()
        assert_replayed(batch, env)
        assert batch["next", "done"].sum() == 5
        network = collector.actor.module[0].module
        assert torch.allclose(network(batch["pixels"]), batch["logits"], atol=1e-5)
    assert collector.episodes == 10 and collector.frames > 10


VELOCITY = ActionSettings(kind="velocity", forward_speed=4.0)
CLIMBING = VELOCITY.replace(climb_speed=1.0, backward_speed=0.5)
PILLARS = PillarsSettings(step_limit=40)


GUSTY = GIMBAL.replace(gusts=2.0, control_ticks=66)
LONG = SHORT.replace(step_limit=40)


@pytest.mark.parametrize(
    ("task", "dynamics", "actions"),
    [
        (PILLARS, None, CLIMBING),
        (LONG, FLYING, VELOCITY),
        (PILLARS, FLYING, ActionSettings()),
        (LONG, GUSTY, CLIMBING),
    ],
)
def test_flight_at_velocities_and_among_obstacles_is_fused(task, dynamics, actions):
    how = {"dynamics": dynamics, "actions": actions, "info": ("drone", "attitude")}
    collector = make(task, **how)
    assert isinstance(collector.fused, FusedEpisodes)
    env = make(task, **how).base_env
    for _ in range(2):
        batch = collector.collect()
        assert_replayed(batch, env)
    outputs = collector.actor.network(batch["pixels"])
    torch.testing.assert_close(outputs, batch["logits"], atol=1e-4, rtol=1e-4)


def test_continuous_actions_are_the_squashed_medians_or_samples():
    how = {"dynamics": FLYING, "actions": VELOCITY, "num_envs": 100}
    collector = make(**how)
    with set_exploration_type(DETERMINISTIC):
        batch = collector.collect()
    expected = SquashedNormal(batch["logits"]).deterministic_sample
    torch.testing.assert_close(batch["action"], expected)
    batch = collector.collect()
    normal = SquashedNormal(batch["logits"])
    draws = (batch["action"].atanh() - normal.loc) / normal.scale
    count = len(draws)
    # four standard errors
    assert draws.mean(0).tolist() == pytest.approx([0.0] * 3, abs=4 / count**0.5)
    assert draws.std(0).tolist() == pytest.approx([1.0] * 3, abs=4 / (2 * count) ** 0.5)


@pytest.mark.parametrize("is_cropped_first", [True, False])
def test_cropped_frames_and_a_network_with_pooling_are_fused(is_cropped_first):
    """As in the original study: the collector keeps the rows that the network sees."""
    transforms = [GrayPixels, StandardizePixels]
    transforms.insert(1 if is_cropped_first else 2, lambda: CropRows(3, 23))
    network = OriginalCNN((1, 20, 64), 3, generator=torch.Generator().manual_seed(0))
    made = [make(transforms=transforms, network=network, compiled=c) for c in (True, False)]
    assert isinstance(made[0].fused, FusedEpisodes)
    with set_exploration_type(DETERMINISTIC):
        one, other = (collector.collect() for collector in made)
    for key in other.keys(True, True):
        if key != "logits":
            assert torch.equal(one[key], other[key]), key
    assert torch.allclose(one["logits"], other["logits"], atol=1e-4)
    assert one["pixels"].shape[1:] == (1, 20, 64)


@pytest.mark.parametrize("kind", ["moves_3d", "moves_turning", "moves_full"])
@pytest.mark.parametrize("dynamics", [None, FLYING])
def test_other_moves_and_turns_are_fused(kind, dynamics):
    task = SHORT.replace(step_limit=25)
    actions = ActionSettings(kind=kind, turn_step=25.0)
    how = {"dynamics": dynamics, "actions": actions, "info": ("drone", "attitude")}
    made = [make(task, compiled=compiled, **how) for compiled in (True, False)]
    assert isinstance(made[0].fused, FusedEpisodes)
    with set_exploration_type(DETERMINISTIC):
        for _ in range(2):
            one, other = (collector.collect() for collector in made)
            for key in other.keys(True, True):
                if key != "logits":
                    assert torch.equal(one[key], other[key]), key
            assert len(one["action"].unique()) > 1


@pytest.mark.parametrize("longest_launch", [64, 2])
@pytest.mark.parametrize("more", [(), (lambda: CropRows(3, 23),)])
def test_stacks_of_frames_are_fused(monkeypatch, more, longest_launch):
    """Also where an observation has frames of two launches."""
    monkeypatch.setattr(fused_episodes, "_MAX_STEPS", longest_launch)
    stack = partial(CatFrames, 3, dim=-3, in_keys=["pixels"])
    transforms = [GrayPixels, stack, StandardizePixels, *more]
    made = [make(transforms=transforms, compiled=compiled) for compiled in (True, False)]
    assert isinstance(made[0].fused, FusedEpisodes)
    with set_exploration_type(DETERMINISTIC):
        for _ in range(2):
            one, other = (collector.collect() for collector in made)
            assert torch.equal(one["pixels"], other["pixels"]) and one["pixels"].shape[1] == 3
            assert torch.equal(one["action"], other["action"])


@pytest.mark.parametrize("how", [{"num_threads": 2}, {"num_threads": 3}])
def test_batches_do_not_depend_on_the_number_of_cores(how):
    one, other = make(num_envs=35), make(num_envs=35, **how)
    for _ in range(2):
        first, second = one.collect(), other.collect()
        assert all(torch.equal(first[key], second[key]) for key in first.keys(True, True))


def test_greedy_episodes_do_not_depend_on_the_split_into_launches(monkeypatch):
    with set_exploration_type(DETERMINISTIC):
        whole = make()
        monkeypatch.setattr(fused_episodes, "_MAX_STEPS", 2)
        parts = make()
        assert parts.fused._length == 2
        for _ in range(2):
            expected, found = whole.collect(), parts.collect()
            assert torch.bincount(found["collector", "traj_ids"]).max() > 4
            for key in expected.keys(True, True):
                assert torch.equal(expected[key], found[key])


def test_deterministic_exploration_takes_the_most_probable_actions():
    with set_exploration_type(DETERMINISTIC):
        batch = make().collect()
    assert torch.equal(batch["logits"].argmax(-1), batch["action"])
    drawn = make().collect()
    assert not torch.equal(drawn["logits"].argmax(-1), drawn["action"])


def test_actions_are_sampled_by_their_probabilities():
    task = TaskSettings(num_cubes=1, step_limit=20)
    network = SmallCNN((1, 25, 64), 3, channels=(4,), hidden=())
    with torch.no_grad():
        network.layers.logits.weight.zero_()
        network.layers.logits.bias.copy_(torch.tensor([0.5, 0.3, 0.2]).log())
    actions = make(task, num_envs=500, network=network).collect()["action"]
    shares = actions.bincount(minlength=3) / len(actions)
    # four standard errors are 0.02 for about 10,000 actions
    assert shares.tolist() == pytest.approx([0.5, 0.3, 0.2], abs=0.02)


def test_collector_uses_updated_weights():
    collector = make()
    collector.collect()
    with torch.no_grad():
        collector.actor.module[0].module.layers.logits.bias.copy_(torch.tensor([0.0, 50.0, 0.0]))
    assert (collector.collect()["action"] == 1).all()


def test_collecting_from_fewer_environments():
    batch = make().collect(3)
    assert batch["collector", "traj_ids"].unique().tolist() == [0, 1, 2]


def test_observations_are_optional():
    batch = make(keep_actor_entries=False).collect()
    assert "pixels" not in batch and "logits" not in batch and "action" in batch


@pytest.mark.parametrize(
    ("how", "reason"),
    [
        (
            {"transforms": (GrayPixels, lambda: CropRows(2, 22), lambda: CropRows(1, 19))},
            "transform CropRows is not fused",
        ),
        (
            {"transforms": (GrayPixels, lambda: CropRows(2, 20), lambda: Shift(1, 1))},
            "transform Shift is not fused",
        ),
        ({"task": Posts()}, "task Posts with ComputerVision is not fused"),
        ({"network": MLP((1, 25, 64), 3)}, "network MLP is not fused"),
    ],
)
def test_log_states_why_a_collector_is_not_fused(how, reason):
    collector = make(**how) if "network" in how or "task" in how else None
    if collector is None:
        collector = make(network=SmallCNN((1, 18, 64), 3), **how)
    assert reason in collector.name and collector.name.startswith("stepping collector: ")
    assert make().name == "fused collector"


def test_resuming_from_a_state_gives_the_same_batches():
    collector, other = make(), make()
    collector.collect()
    state = collector.state_dict()
    source = collector.actor.module[1].distribution_kwargs["source"].generator
    actions = source.get_state()
    expected = collector.collect()
    other.load_state_dict(state)
    other.actor.module[1].distribution_kwargs["source"].generator.set_state(actions)
    found = other.collect()
    assert all(torch.equal(found[key], expected[key]) for key in found.keys(True, True))


def test_other_renderers_fall_back():
    env = DroneEnv(2, SHORT, renderer="mujoco_warp", transforms=[GrayPixels()])
    actor = make_actor(SmallCNN((1, 25, 64), 3), env.action_spec)
    assert "WarpRenderer on cpu" in EpisodeCollector(env, actor, compiled=True).name
    env.close()


def test_unsupported_exploration_types_fall_back():
    collector = make()
    with set_exploration_type(ExplorationType.MODE):
        assert len(collector.collect())


def test_shutdown_ends_the_threads():
    before = {*threading.enumerate()}
    collector = make(num_threads=3)
    collector.collect()
    begun = {*threading.enumerate()} - before
    assert begun  # idle threads are reused
    collector.shutdown()
    assert not any(thread.is_alive() for thread in begun)


STACK = partial(CatFrames, 2, dim=-3, in_keys=["pixels"])
RANDOM = AppearanceSettings(
    sun_elevation=(10.0, 80.0),
    shadows=0.5,
    sky_zenith=((0.1, 0.2, 0.4), (0.6, 0.7, 0.9)),
    fog_visibility=(40.0, 100.0),
    ground_texture=("none", "checker"),
    object_texture=("none", "bricks"),
    distractors=(0, 3),
    camera_offset=((-0.2, -0.2, -0.2), (0.2, 0.2, 0.2)),
    camera_turn=((-3.0, -3.0, -3.0), (3.0, 3.0, 3.0)),
    camera_widening=(-5.0, 5.0),
    exposure=(0.7, 1.4),
)


FOG = AppearanceSettings(fog_visibility=30.0)
CROPPED = (GrayPixels, partial(Shift, 4, 6), STACK, StandardizePixels, partial(CropRows, 3, 23))
COLORS = (RgbPixels, partial(Shift, 6, 9), ChromaticityPixels, StandardizePixels, STACK)


@pytest.mark.parametrize(
    ("look", "transforms"),
    [
        (None, CROPPED),
        (RANDOM, CROPPED),
        (None, (RgbPixels, StandardizePixels)),
        (FOG, COLORS),
    ],
)
def test_colors_shifts_and_visual_randomization_are_fused(look, transforms):
    made = [make(transforms=transforms, appearance=look, compiled=c) for c in (True, False)]
    assert isinstance(made[0].fused, FusedEpisodes)
    with set_exploration_type(DETERMINISTIC):
        for count in (5, 3):
            one, other = (collector.collect(count) for collector in made)
            for key in other.keys(True, True):
                if key != "logits":
                    assert torch.equal(one[key], other[key]), key


SENSES = {"goal": Goal(), "last_action": LastAction(), "altitude": Altitude(scale=3.0)}
SHIFTED = (Crop(top=3, bottom=23), ShiftSettings(down=2, across=3))[::-1]
SEVERAL = [
    ({"gray": GrayImage(), **SENSES}, {}),
    (
        {
            "velocity": Velocity(),
            "depth": DepthImage(size=(20, 32), maximum=9.0, stack=2),
            "goal": Goal(),
            "rates": Rates(),
            "attitude": Attitude(),
        },
        {"dynamics": FLYING, "actions": VELOCITY},
    ),
    (
        {
            "below": DepthImage(camera="down", size=(16, 20), transforms=SHIFTED[:1]),
            "goal": Goal(),
            "rgb": RgbImage(stack=3),
            "gray": GrayImage(transforms=SHIFTED),
        },
        {"appearance": RANDOM, "actions": ActionSettings(kind="moves_full")},
    ),
]


@pytest.mark.parametrize(("inputs", "how"), SEVERAL)
def test_several_inputs_are_fused(inputs, how):
    made = [make(LONG, inputs=inputs, compiled=c, **how) for c in (True, False)]
    assert isinstance(made[0].fused, FusedEpisodes), made[0].name
    with set_exploration_type(DETERMINISTIC):
        for count in (5, 3):
            one, other = (collector.collect(count) for collector in made)
            for key in other.keys(True, True):
                is_rounded = key == "logits" or one["action"].is_floating_point()
                exactly = {"rtol": 0.0, "atol": 1e-4 if is_rounded else 0.0}
                torch.testing.assert_close(one[key], other[key], **exactly, msg=str(key))


@pytest.mark.parametrize(
    ("inputs", "reason"),
    [
        ({"gray": GrayImage(noise=0.1)}, "transform Noise is not fused"),
        ({"gray": GrayImage(), "goal": Goal(loss=0.1)}, "errors of input goal are not fused"),
        (
            {"rgb": RgbImage(transforms=(Chromaticity(), SHIFTED[0]))},
            "transform Shift is not fused",
        ),
        ({"segmentation": SegmentationImage()}, "input segmentation is not fused"),
        ({"goal": Goal()}, "a policy without images is not fused"),
    ],
)
def test_log_states_why_inputs_are_not_fused(inputs, reason):
    assert reason in make(inputs=inputs, network=SmallCNN((1, 25, 64), 3)).name


def test_kernel_ends_the_episode_of_a_lost_drone():
    """One of five drones is lost from the start."""
    collector = make(dynamics=Quadrotor(FLYING))
    begin = collector.fused._rules.begin

    def lose(state):
        state.body.numbers[2, LOST] = 1.0
        begin(state)

    collector.fused._rules.begin = lose
    batch = collector.collect()
    lengths = batch["collector", "traj_ids"].bincount()
    assert lengths[2] == 1 and (lengths[[0, 1, 3, 4]] > 1).all()
    assert batch[REASON].flatten().tolist().count(CubesEnd.LOST_CONTROL) == 1


@pytest.mark.parametrize(("shape", "num_actions"), [((1, 25, 32), 3), ((1, 25, 64), 5)])
def test_networks_for_other_frames_or_actions_are_not_fused(shape, num_actions):
    collector = make(network=SmallCNN(shape, num_actions))
    assert "outputs is not fused with frames of (1, 25, 64) and 3 outputs" in collector.name


def make_buffer(num_rows=4):
    return RolloutBuffer(
        {"action": torch.zeros(num_rows, dtype=int), "pixels": torch.zeros(num_rows, 2)}
    )


def write(part_rows, *numbers):
    part_rows["action"][:] = torch.tensor(numbers)
    part_rows["pixels"][:] = torch.tensor(numbers)[:, None] * torch.tensor([1.0, 0.5])


def test_rows_are_read_in_any_order():
    buffer = make_buffer()
    for part in range(3):
        write(buffer.open(part, ("action", "pixels")), *(10 * part + row for row in range(4)))
    read = buffer.read(torch.tensor([9, 0, 3, 4]), ("action", "pixels"))
    assert read["action"].tolist() == [21, 0, 3, 10]
    assert read["pixels"].tolist() == [[n, n / 2] for n in (21, 0, 3, 10)]
    assert [*buffer.read(torch.tensor([11]), ["action"]).items()] == [
        ("action", torch.tensor([23]))
    ]


@pytest.mark.parametrize("num_parts", [1, 2, 3, 9])
def test_buffer_grows_with_the_number_of_parts(num_parts):
    buffer = make_buffer(3)
    where = []
    for _ in range(2):  # the second time without growing
        for part in range(num_parts):
            part_rows = buffer.open(part, ("action", "pixels"))
            write(part_rows, part, part + 100, part + 200)
        where.append(part_rows["pixels"].data_ptr())
        rows = torch.arange(3 * num_parts)
        expected = [part + hundreds for part in range(num_parts) for hundreds in (0, 100, 200)]
        assert buffer.read(rows, ["action"])["action"].tolist() == expected
    assert where[0] == where[1]


def test_memory_of_batches_is_reused_once_nothing_refers_to_it():
    buffer, rows = make_buffer(), torch.arange(4)
    write(buffer.open(0, ("pixels",)), 1, 2, 3, 4)
    view = buffer.read(rows, ["pixels"])["pixels"][1:]
    write(buffer.open(0, ("pixels",)), 5, 6, 7, 8)
    second = buffer.read(rows, ["pixels"])["pixels"]
    assert view[:, 0].tolist() == [2, 3, 4] and second[:, 0].tolist() == [5, 6, 7, 8]
    place = second.data_ptr()
    del second
    assert buffer.read(rows[:3], ["pixels"])["pixels"].data_ptr() == place


class TestRecordedActivations:
    @pytest.fixture
    def episodes(self):
        """Collector whose kernel records, the fused network that reads, and torch's network."""
        collector = make(num_envs=4)
        assert isinstance(collector.fused, FusedEpisodes)
        network = collector.actor.network
        activations = collector.fused.activations
        return collector, FusedNetwork.try_create(network, 1, activations=activations), network

    @staticmethod
    def recorded(episodes, pixels):
        """Logits of the fused network after the recorded ones were replaced by 7."""
        collector, fused, _ = episodes
        collector.fused.activations.outputs.fill_(7)
        return fused(pixels).unique().tolist() == [7]

    def test_gradients_of_a_batch_equal_torch(self, episodes):
        collector, fused, network = episodes
        for length in (None, 3):  # as a whole and in slices
            batch = collector.collect()
            for part in batch.split(length or len(batch)):
                weights = halves(len(part), 3)
                logits, expected = forward_backward(network, network, part["pixels"], weights)
                found, gradients = forward_backward(network, fused, part["pixels"], weights)
                torch.testing.assert_close(found, logits)
                torch.testing.assert_close(gradients, expected)
            with torch.no_grad():
                network.layers.logits.weight.mul_(0.9)

    def test_pixels_of_the_batch_and_slices_of_them_are_recorded(self, episodes):
        pixels = episodes[0].collect()["pixels"]
        assert self.recorded(episodes, pixels)
        assert self.recorded(episodes, pixels[2:5])

    def test_copies_other_pixels_and_other_weights_are_not(self, episodes):
        collector, _, network = episodes
        pixels = collector.collect()["pixels"]
        others = [pixels.clone(), pixels[[1, 0]], pixels[::2], pixels.flip(-1)]
        assert not any(self.recorded(episodes, other) for other in others)
        with torch.no_grad():
            network.layers.logits.bias.add_(1)
        assert not self.recorded(episodes, pixels)

    def test_pixels_changed_in_place_are_not(self, episodes):
        pixels = episodes[0].collect()["pixels"]
        pixels[3, 0, 0, 0] += 1
        assert not self.recorded(episodes, pixels)

    def test_pixels_of_the_batch_before_are_not(self, episodes):
        collector = episodes[0]
        before, _ = collector.collect()["pixels"], collector.collect()
        assert not self.recorded(episodes, before)

    def test_backward_after_another_batch_raises(self, episodes):
        collector, fused, _ = episodes
        total = fused(collector.collect()["pixels"]).sum()
        collector.collect()
        with pytest.raises(RuntimeError, match="between the forward and the backward pass"):
            total.backward()
