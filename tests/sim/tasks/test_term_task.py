"""Tasks of terms: rules and payments by hand, one at a time and fused."""

import numpy as np
import pytest
import torch
import warp as wp
from torchrl.envs.utils import ExplorationType, set_exploration_type

import drone_rl
from drone_rl import InputError, Mover, Step, Steps, define_task, reward
from drone_rl.acceleration import FusedEpisodes
from drone_rl.config import ActionSettings
from drone_rl.config.appearance import AppearanceSettings, check_appearance
from drone_rl.config.camera import CameraSettings
from drone_rl.config.inputs import SegmentationImage
from drone_rl.config.task import TASKS, BaseTaskSettings
from drone_rl.envs import Observer
from drone_rl.sim.composer_task import make_environment
from drone_rl.sim.dynamics.state import heading_of
from drone_rl.sim.tasks import as_task
from drone_rl.sim.tasks.fused import fused_rules
from drone_rl.sim.tasks.task import MAKERS
from drone_rl.sim.worlds import Worlds
from drone_rl.training.metrics import batch_metrics
from drone_rl.utils.progress import silent
from tests.acceleration.test_fused_episodes import make

FORWARD, LEFT, RIGHT = 0, 1, 2


@reward("test_near", weight=-0.25)
def near(step: Step, distance: float = 0.5) -> float:
    """1 near something solid."""
    return wp.where(step.clearance < distance, 1.0, 0.0)


BALL = {"shape": "ball", "role": "goal", "size": [2.0, 2.0, 2.0], "x": 6.0, "y": 0.0, "z": 2.5}
POST = {"shape": "cylinder", "size": [1.0, 1.0, 5.0], "x": 4.0, "y": 2.0}


@pytest.fixture(autouse=True, scope="module")
def task():
    """The task of these tests, which others must not find among the registered ones."""
    kind = define_task(
        "test_reach",
        objects={"ball": BALL, "post": POST},
        reward={"progress": 0.5, "reached": 2.0, "contact": -1.0, "test_near": {}},
        end=["contact", "out_of_bounds"],
        success=["all_goals"],
        step_limit=12,
    )
    yield
    del TASKS[kind.name], MAKERS[kind]


def worlds(**changes):
    made = Worlds(1, BaseTaskSettings.read({"name": "test_reach", **changes}))
    made.reset(torch.arange(1), [np.random.RandomState(0)])
    return made


def fly(made, *actions):
    rewards = [float(made.step(torch.arange(1), torch.tensor([a]))) for a in actions]
    return rewards, made.task.ends(int(made.state.end_reason)).name


def test_a_goal_is_reached_where_the_balls_touch():
    made = worlds()
    rewards, end = fly(made, *[FORWARD] * 4)
    assert rewards == pytest.approx([0.5] * 4) and end == "RUNNING"
    # centres 1 m apart, reach 1.4 m: progress 0.5, reached 2
    assert fly(made, FORWARD) == (pytest.approx([2.5]), "SUCCESS")
    assert made.state.paid[0].tolist() == pytest.approx([2.5, 2.0, 0.0, 0.0])
    assert made.info()["reached"].tolist() == [[True]]
    assert made.task.places(made.state)[0, 0, 2] < 0.0  # it has vanished


def test_a_drone_turns_to_a_goal_beside_it():
    """It looks to the left, along +y, and the ball is 6 m ahead on +x: a turn of 90 degrees."""
    settings = {"name": "test_reach", "start": {"heading": 90.0}, "step_limit": 20}
    actions = ActionSettings(kind="moves_turning", turn_step=45.0)
    made = Worlds(1, BaseTaskSettings.read(settings), actions=actions)
    made.reset(torch.arange(1), [np.random.RandomState(0)])
    assert made.task.edits.next_offset(made.state)[0].tolist() == pytest.approx([0.0, -6.0, 0.0])
    assert made.state.sides[0, 0] == 2  # on its right
    rewards, end = fly(made, RIGHT, RIGHT, *[FORWARD] * 4)
    assert rewards == pytest.approx([0, 0, 0.5, 0.5, 0.5, 0.5]) and end == "RUNNING"
    assert fly(made, FORWARD)[1] == "SUCCESS"
    assert made.state.body.position[0].tolist() == pytest.approx([5.0, 0.0, 2.5])


def test_an_obstacle_is_touched_between_two_positions():
    made = worlds()
    fly(made, LEFT, LEFT, FORWARD, FORWARD)
    # from x 2 to 3 beside nothing: the post's surface is 0.5 m away from x 3, the drone's 0.1 m
    rewards, end = fly(made, FORWARD)
    before, after = np.hypot(4.0, 2.0), np.hypot(3.0, 2.0)
    assert rewards == pytest.approx([0.5 * (before - after) - 0.25]) and end == "RUNNING"
    rewards, end = fly(made, FORWARD)
    assert rewards == pytest.approx([0.5 * (after - np.hypot(2.0, 2.0)) - 1.25])
    assert end == "CONTACT" and made.info()["touched"].tolist() == [[False, True]]


@pytest.mark.parametrize(
    ("actions", "end"), [([LEFT] * 12, "STEP_LIMIT"), ([LEFT] * 13, "OUT_OF_BOUNDS")]
)
def test_ends(actions, end):
    assert fly(worlds(step_limit=len(actions)), *actions)[1] == end  # y is at most 2 + 10


def test_weights_and_parameters_are_settings():
    changes = {"reward": {"progress": 1.0, "test_near": {"distance": 3.0}}}
    made = worlds(**changes)
    assert fly(made, FORWARD)[0] == pytest.approx([1.0 - 0.25])  # the ground is 2.1 m away


@pytest.mark.parametrize(
    ("task", "weights", "largest"),
    [
        ("collect_cubes", {"reached": 0.5}, 1.5),
        ("collect_cubes", {"reached": 1.0, "time": -0.01}, None),
        ("collect_cubes", {"reached": 1.0, "time": 0.0}, 3.0),
        ("pillars", {"progress": 2.0, "contact": -1.0, "reached": 0.25}, 3.0),  # in four rows
    ],
)
def test_the_largest_reward_follows_from_the_weights(task, weights, largest):
    assert as_task(TASKS[task](reward=weights)).largest_reward == largest


def test_the_side_of_a_goal_is_that_of_the_drone_when_it_comes_up():
    low = {**BALL, "x": 9.0, "y": -4.0}
    made = worlds(objects={"first": BALL, "second": low})
    assert made.info()["sides"].tolist() == [[1, -1]]
    fly(made, *[FORWARD] * 5)
    assert made.info()["sides"].tolist() == [[1, 2]]


def test_starts_turn_the_drone_and_the_offset_of_its_goal():
    made = worlds(start={"heading": 90.0})

    @reward("test_offset")
    def offset(step: Step) -> float:
        return step.goal[1] + 100.0 * step.goal[0] + 10000.0 * step.heading

    made = worlds(start={"heading": 90.0}, reward={"test_offset": 1.0})
    # at (0, 1), looking to y: the goal is 6 m to the right; a float's rounding of 10000 pi / 2
    assert fly(made, FORWARD)[0] == pytest.approx([10000 * np.pi / 2 - 106.0], abs=0.01)


def test_terms_see_the_goal_from_a_start_that_is_turned():
    at = {"x": 2.0, "y": -1.0, "z": 1.5, "heading": 120.0}
    made = worlds(start=at, reward={"facing": 1.0})
    state, edits = made.state, made.task.edits
    cos, sin = -0.5, 0.75**0.5
    ahead, left = cos * 4.0 + sin * 1.0, cos * 1.0 - sin * 4.0  # the ball is at (6, 0, 2.5)
    assert edits.next_offset(state)[0].tolist() == pytest.approx([ahead, left, 1.0])
    assert made.info()["sides"].tolist() == [[2]]
    moved = edits.next_moved(state, 2.0).places[0, 0].tolist()
    assert moved == pytest.approx([6.0 - 2.0 * sin, 2.0 * cos, 2.5])
    alone = edits.one_target(state.body, torch.tensor([[3.0, 0.0, 1.0]])).places[0, 0].tolist()
    assert alone == pytest.approx([2.0 + 3.0 * cos, -1.0 + 3.0 * sin, 2.5])
    reward = made.task.step(state, state.body)[1]  # the drone hovers
    assert float(reward) == pytest.approx(ahead / np.hypot(ahead, left))


def test_starts_and_headings_are_drawn_from_their_ranges_away_from_objects():
    start = {"x": [-3.0, 9.0], "y": [-2.0, 2.0], "z": [1.0, 3.0], "heading": [-180.0, 180.0]}
    made = worlds(start=start)
    drawn = torch.stack([made.task.sample(np.random.RandomState(i)) for i in range(200)])
    for axis, (low, high) in enumerate(start.values()):
        scale = np.pi / 180 if axis == 3 else 1.0
        values = drawn[:, axis] / scale
        assert low <= values.min() < 0.9 * low + 0.1 * high
        assert high >= values.max() > 0.1 * low + 0.9 * high
    state = made.start(drawn)
    assert torch.equal(state.drone, drawn[:, :3])
    assert torch.allclose(heading_of(state.body.attitude), drawn[:, 3])
    # 1 m from the surfaces of the drone, 0.4 m, and of boxes around ball and post
    gap = (drawn[:, :3] - torch.tensor([6.0, 0.0, 2.5])).abs() - 1.0 - 0.4
    assert (gap.clamp(min=0.0).norm(dim=-1) > 1.0).all()
    assert len(made.task.score(made.task.info(state)).world.unique(dim=0)) == 200


def test_changes_of_a_policys_task_keep_the_rest_of_start_and_objects():
    start, ball = {"x": [-1.0, 1.0], "z": 2.5}, {"x": 7.0}
    task = BaseTaskSettings.read({"name": "test_reach", "start": start})
    policy = drone_rl.policy_from(lambda images: images[:, 0, 0, :3], task=task)
    made = policy.in_task(start={"z": 1.5}, objects={"ball": ball}).task
    assert made.start == task.start.replace(z=1.5)
    assert made.objects == {**task.objects, "ball": task.objects["ball"].replace(x=7.0)}
    fewer = task.replace(objects={"ball": BALL})
    assert policy.in_task(fewer).task == fewer


def test_the_image_is_that_of_the_heading():
    shown = []
    for heading, place in ((0.0, (6.0, 1.0)), (90.0, (-1.0, 6.0))):
        ball = {**BALL, "x": place[0], "y": place[1]}
        made = worlds(objects={"ball": ball}, start={"heading": heading})
        shown.append(made.render(made.state, made.view(modality="segmentation")))
    assert torch.equal(*shown) and len(shown[0].unique()) == 3  # sky, ground and ball


def test_segmentation_shows_each_object_in_the_channel_of_its_role():
    sides = {"goal": 4.0, "obstacle": 0.0, "decoration": -4.0}
    box = {"size": [2.0, 2.0, 2.0], "x": 6.0, "z": 2.5}
    made = worlds(objects={role: {**box, "role": role, "y": y} for role, y in sides.items()})
    inputs = {"seen": SegmentationImage(size=(24, 64)).described(CameraSettings(), ())}
    images = Observer(made, inputs).observe(made.state, torch.arange(1), True, None)["seen"]
    seen = images[0].argmax(0)  # a box is 2 / 5 * 32 / tan(135 / 2 degrees) = 5 pixels wide
    assert [seen[11, column].item() for column in (21, 32, 42)] == [0, 1, 3]
    assert seen[0, 32] == 4 and seen[-1, 32] == 2


def test_a_turned_box_is_drawn_and_touched_as_its_twin_that_is_not():
    shown, ends = [], []
    for size, heading in (([6.0, 1.0, 4.0], 0.0), ([1.0, 6.0, 4.0], 90.0)):
        wall = {"size": size, "heading": heading, "x": 6.0, "y": 2.5}  # y is 2 to 3
        made = worlds(objects={"ball": {**BALL, "x": 20.0}, "wall": wall})
        shown.append(made.render(made.state))
        clear = fly(made, *[FORWARD] * 6)[1]  # the drone's side is 1.6 m away
        ends.append((clear, *fly(made, LEFT), *fly(made, LEFT)))
    assert ends[0] == ends[1] and ends[0][0] == "RUNNING" and ends[0][-1] == "CONTACT"
    assert (shown[0] != shown[1]).any(-1).float().mean() < 0.01  # but for rounding at edges


def test_sampled_objects_keep_apart():
    box = {"count": 8, "size": [1.0, 1.0, 2.0], "x": [4.0, 12.0], "y": [-4.0, 4.0], "apart": 0.7}
    task = as_task(BaseTaskSettings.read({"name": "test_reach", "objects": {"b": BALL, "x": box}}))
    for seed in range(20):
        at = task.sample(np.random.RandomState(seed))[4:].reshape(9, 3)[1:]
        gap = (at[:, None] - at[None]).abs() - torch.tensor([1.0, 1.0, 2.0]).double()
        apart = gap.clamp(min=0.0).norm(dim=-1)
        assert apart[~torch.eye(8, dtype=torch.bool)].min() >= 0.7
        assert at[:, 2].tolist() == [1.0] * 8


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"reward": {"progres": 1.0}}, "progress"),
        ({"reward": {"progress": 0.0}}, "reward"),
        ({"reward": {"test_near": {"distanc": 1.0}}}, "distance"),
        ({"objects": {"post": POST}}, "goal"),
        ({"objects": {"ball": {**BALL, "size": [1.0, 2.0, 1.0]}}}, "size"),
        ({"success": {}}, "success"),
        ({"curriculum": {"objects.ball.x": [7.0, 5.0]}}, "objects.ball.x"),
        ({"curriculum": {"objects.ball.x": [5.0, 7.0]}}, "not within"),
    ],
)
def test_invalid_tasks_are_refused(changes, named):
    with pytest.raises(InputError, match=named):
        BaseTaskSettings.read({"name": "test_reach", **changes})


def test_objects_without_room_are_named():
    boxes = {"count": 20, "size": [1.0, 1.0, 1.0], "x": [4.0, 6.0], "y": [-1.0, 1.0], "apart": 1.0}
    task = as_task(
        BaseTaskSettings.read({"name": "test_reach", "objects": {"b": BALL, "boxes": boxes}})
    )
    with pytest.raises(InputError, match="boxes"):
        task.sample(np.random.RandomState(0))


@reward("test_velocity")
def sideways(step: Step) -> float:
    """Metres a second to the left."""
    return step.velocity[1]


@drone_rl.event("test_drift")
def drift(mover: Mover, speed: float = 10.0) -> wp.vec3:
    """Flies to the left, and up as fast as it is away from the drone."""
    return wp.vec3(0.0, speed, mover.place[0] - mover.drone[0])


@drone_rl.event("test_lost")
def lost(mover: Mover) -> wp.vec3:
    """Not finite."""
    return wp.vec3(wp.log(-mover.time), 0.0, 0.0)


def test_events_move_objects_and_the_distance_to_goals():
    made = worlds(objects={"ball": {**BALL, "event": {"test_drift": {"speed": 5.0}}}})
    (paid,), _ = fly(made, FORWARD)
    assert made.state.places[0, 0].tolist() == pytest.approx([6.0, 0.5, 2.5 + 0.6])
    assert paid == pytest.approx(0.5 * (6.0 - np.hypot(5.0, np.hypot(0.5, 0.6))))
    moved = made.task.edits.next_moved(made.state, 1.0)  # goes on from where it was put
    after = made.task.step(moved, moved.body)[0]
    assert after.places[0, 0].tolist() == pytest.approx([6.0, 2.0, 2.5 + 0.6 + 0.5])
    assert moved.places[0, 0, 1] == 1.5  # states before a step stay as they are


@pytest.mark.parametrize(("x", "end"), [(0.0, "CONTACT"), (-1.0, "RUNNING")])
def test_a_fast_object_does_not_pass_through_the_drone(x, end):
    fast = {"test_drift": {"speed": 100.0}}  # 10 m a step: from the drone's right to its left
    made = worlds(objects={"ball": BALL, "post": {**POST, "x": x, "y": -5.0, "event": fast}})
    # at half of the step the drone is at x = 0.5; surfaces touch 0.9 m apart
    assert fly(made, FORWARD)[1] == end


@pytest.mark.parametrize("event", ["orbit", "shuttle"])
def test_shipped_events_return_after_their_period(event):
    made = worlds(objects={"ball": {**BALL, "event": {event: {"period": 2.0}}}}, step_limit=99)
    places = [made.state.places[0, 0].clone()]
    for _ in range(20):  # of 0.1 s
        made.state = made.task.step(made.state, made.state.body)[0]
        places.append(made.state.places[0, 0].clone())
    assert places[-1].tolist() == pytest.approx(places[0].tolist(), abs=1e-5)
    ranges = torch.stack(places).amax(0) - torch.stack(places).amin(0)
    if event == "orbit":  # 2 m around a centre that depends on the phase
        assert ranges.tolist() == pytest.approx([4.0, 4.0, 0.0], abs=0.05)
    else:  # 2 m along y, in half of the period
        assert ranges.tolist() == pytest.approx([0.0, 2.0, 0.0], abs=0.21)
    assert len({float(made.task.sample(np.random.RandomState(i))[-1]) for i in range(9)}) == 9


def test_dm_control_shows_moved_objects():
    settings = {"name": "test_reach", "objects": {"ball": {**BALL, "event": ["test_drift"]}}}
    env = make_environment(BaseTaskSettings.read(settings), pixels=False, random_state=0)
    env.reset()
    env.step(FORWARD)
    ball = env.physics.bind(env.task._model.frames[0]).mocap_pos
    assert ball.tolist() == pytest.approx([6.0, 1.0, 3.1])


@drone_rl.event("test_number")
def number(mover: Mover) -> float:
    """No velocity."""
    return mover.time


@pytest.mark.parametrize(
    ("event", "message"), [("test_lost", "test_lost"), ("test_number", "wp.vec3")]
)
def test_unusable_events_are_named(event, message):
    with pytest.raises(InputError, match=message):
        fly(worlds(objects={"ball": {**BALL, "event": [event]}}), FORWARD)


def test_moving_obstacles_of_a_quadrotor_are_not_fused():
    objects = {"ball": BALL, "post": {**POST, "event": ["shuttle"]}}
    task = BaseTaskSettings.read({"name": "test_reach", "objects": objects})
    made = Worlds(1, task, dynamics=drone_rl.DynamicsSettings(mode="simple_flight"))
    assert "events" in fused_rules(made.task, made.dynamics, made.state)
    made = Worlds(1, task)
    assert not isinstance(fused_rules(made.task, made.dynamics, made.state), str)


@reward("test_undefined")
def undefined(step: Step) -> float:
    """Not finite."""
    return wp.log(-step.time)


@reward("test_uncompiled")
def uncompiled(step: Step) -> float:
    """Not in Warp's language."""
    return len([step.time])


@reward("test_nothing")
def nothing(step: Step):
    """Not a value."""


@pytest.mark.parametrize("term", ["test_undefined", "test_uncompiled", "test_nothing"])
def test_unusable_terms_are_named(term):
    with pytest.raises(InputError, match=term.removeprefix("test_")):
        fly(worlds(reward={"test_near": 1.0, term: 0.0}), FORWARD)


@pytest.mark.parametrize("start", [{}, {"y": [-3.0, 3.0], "heading": [-90.0, 90.0]}])
@pytest.mark.parametrize("event", [{}, {"orbit": {}, "shuttle": {"period": 0.7}}])
def test_fused_episodes_are_the_stepped_ones(start, event):
    objects = {"ball": {**BALL, "y": [-3.0, 3.0], "event": event}, "post": POST}
    rewards = {"progress": 0.5, "contact": -1.0, "test_velocity": 0.1}
    changes = {"objects": objects, "reward": rewards, "start": start}
    task = BaseTaskSettings.read({"name": "test_reach", **changes})
    collectors = [make(task=task, num_envs=32, compiled=fused) for fused in (True, False)]
    assert isinstance(collectors[0].fused, FusedEpisodes)
    with set_exploration_type(ExplorationType.DETERMINISTIC):
        one, other = (collector.collect() for collector in collectors)
    info = ("next", "info")
    for key in ("pixels", "action", ("next", "reward"), (*info, "end_reason"), (*info, "paid")):
        assert torch.equal(one[key], other[key]), key
    assert len(one["next", "info", "paid"].unique(dim=0)) > 20
    logged = batch_metrics(one, terms=as_task(task).reward_terms)
    sums = [logged[f"reward/{name}"] for name in rewards]
    assert sum(sums) == pytest.approx(logged["train/reward"], abs=1e-5)
    shares = [logged[f"reward_share/{name}"] for name in rewards]
    assert sum(shares) == pytest.approx(1.0) and max(shares) < 1.0


@pytest.mark.parametrize("kind", ["moves", "moves_turning", "moves_full"])
def test_fused_episodes_with_headings_at_random_are_the_stepped_ones(kind):
    values = {
        "objects": {"ball": {**BALL, "y": [-3.0, 3.0]}},
        "start": {"heading": [-180.0, 180.0]},
    }
    task = BaseTaskSettings.read({"name": "test_reach", **values})
    how = {"task": task, "num_envs": 32, "actions": ActionSettings(kind=kind)}
    collectors = [make(compiled=fused, info=("attitude",), **how) for fused in (True, False)]
    assert isinstance(collectors[0].fused, FusedEpisodes)
    with set_exploration_type(ExplorationType.DETERMINISTIC):
        one, other = (collector.collect() for collector in collectors)
    for key in ("pixels", "action", ("next", "reward"), ("next", "info", "attitude")):
        assert torch.equal(one[key], other[key]), key


def test_velocity_of_a_move_is_its_length_over_the_steps_time():
    made = worlds(reward={"test_velocity": 1.0})
    assert fly(made, FORWARD, LEFT, RIGHT)[0] == pytest.approx([0.0, 10.0, -10.0])


def test_fused_episodes_name_unusable_terms():
    task = BaseTaskSettings.read({"name": "test_reach", "reward": {"test_undefined": 1.0}})
    collector = make(task=task, num_envs=4, compiled=True)
    with pytest.raises(InputError, match="undefined"):
        collector.collect()


def test_a_curriculum_widens_from_its_range_to_that_of_the_setting():
    wide = {"ball": {**BALL, "y": [-4.0, 4.0]}}
    made = worlds(objects=wide, curriculum={"objects.ball.y": [0.0, 1.0]})
    curriculum = made.task.curriculum
    assert curriculum.ranges.objects["ball"].y == (-4.0, 4.0)  # except in a training
    curriculum.load((0.0, 0.0))
    # running means of 1 - 0.9^n reach 0.8 at the 16th batch
    assert [curriculum.note(1.0) for _ in range(16)] == [False] * 15 + [True]
    assert curriculum.ranges.objects["ball"].y == pytest.approx((-0.4, 1.3))
    drawn = [float(made.task.sample(np.random.RandomState(seed))[5]) for seed in range(50)]
    assert -0.4 <= min(drawn) < -0.2 and 1.1 < max(drawn) <= 1.3


def test_a_training_with_a_curriculum_resumes_bit_for_bit(tmp_path):
    task = BaseTaskSettings.read(
        {
            "name": "test_reach",
            "objects": {"ball": {**BALL, "y": [-4.0, 4.0]}},
            "curriculum": {"objects.ball.y": 0.0},
        }
    )

    short = drone_rl.TrainerSettings(total_frames=1000, target_share=None, confirm_episodes=0)
    settings = drone_rl.TrainSettings(task=task, trainer=short)
    longer = short.replace(total_frames=2000)
    whole = drone_rl.train(settings.replace(trainer=longer), folder=tmp_path / "a", progress=silent)
    half = drone_rl.train(settings, folder=tmp_path / "b", progress=silent)
    again = drone_rl.train(folder=half.folder, resume=True, trainer=longer, progress=silent)
    assert half.result.frames < again.result.frames == whole.result.frames
    assert again.result.running_reward == whole.result.running_reward
    one, two = (drone_rl.load_policy(of.folder).state.weights for of in (whole, again))
    assert all(torch.equal(one[name], two[name]) for name in one)
    verdict = drone_rl.judge(whole.folder, episodes=8)  # in the final range
    assert verdict.repetition.worst.different == 0


def _named_weight(step: Step, weight: float = 1.0) -> float:
    return weight


def _whole(step: Step, count: int = 1) -> float:
    return float(count)


@pytest.mark.parametrize(
    ("name", "function", "message"),
    [
        ("contact", near, "contact is built in"),
        ("My Term", near, "My Term"),
        ("test_weight", _named_weight, "weight"),
        ("test_whole", _whole, "count: float"),
        ("test_none", lambda: 0.0, "0 parameters"),
    ],
)
def test_terms_that_settings_could_not_name_are_refused(name, function, message):
    with pytest.raises(InputError, match=message):
        reward(name)(function)


@reward("test_far", weight=0.3)
def far(step: Step, scale: float = 1.0) -> float:
    """The velocity to the left, less where the goal is far away."""
    return step.velocity[1] - scale * step.distance


@reward("test_far_torch", weight=0.3)
def far_torch(steps: Steps, scale: float = 1.0) -> torch.Tensor:
    """The same in torch, which changes its own copy."""
    steps.distance.mul_(scale)
    return steps.velocity[:, 1] - steps.distance


@drone_rl.end("test_away")
def away(step: Step) -> bool:
    """Beyond 0.3 m to the left."""
    return step.position[1] > 0.3


@drone_rl.end("test_away_torch")
def away_torch(steps: "drone_rl.Steps") -> torch.Tensor:
    """The same in torch."""
    return steps.position[:, 1] > 0.3


@pytest.mark.parametrize("mode", ["computer_vision", "simple_flight"])
def test_a_term_in_torch_is_its_twin_in_warp(mode):
    twins = []
    for kind in "", "_torch":
        task = {
            "name": "test_reach",
            "reward": {"test_near": {}, f"test_far{kind}": {"scale": 0.7}, "contact": -1.0},
            "end": [f"test_away{kind}", "contact"],
        }
        made = Worlds(8, BaseTaskSettings.read(task), dynamics=drone_rl.DynamicsSettings(mode=mode))
        every = torch.arange(8)
        made.reset(every, [np.random.RandomState(i) for i in range(8)])
        actions = torch.randint(3, (10, 8), generator=torch.Generator().manual_seed(0))
        rewards = [made.step(every, each) for each in actions]
        twins.append((torch.stack(rewards), made.state.paid, made.state.end_reason))
    assert all(torch.equal(*pair) for pair in zip(*twins, strict=True))
    rewards, paid, ends = twins[0]
    assert len(rewards.unique()) > 20 and bool(paid[:, 1].all()) and len(ends.unique()) > 1


def test_a_success_in_torch_ends_an_episode_of_dm_control():
    @drone_rl.success("test_moved")
    def moved(steps: Steps, distance: float = 1.5) -> torch.Tensor:
        return steps.position[:, 0] > distance

    settings = {"name": "test_reach", "success": ["test_moved"], "reward": {"test_far_torch": 1.0}}
    env = make_environment(BaseTaskSettings.read(settings), pixels=False, random_state=0)
    env.reset()
    first, second = env.step(FORWARD), env.step(FORWARD)
    assert (first.reward, first.last()) == (-5.0, False)  # metres to the ball
    assert (second.reward, second.last()) == (-4.0, True)


@reward("test_table")
def table(steps: Steps) -> torch.Tensor:
    """One value too many."""
    return steps.position[:, :2]


@reward("test_endless")
def endless(steps: Steps) -> torch.Tensor:
    """Not finite."""
    return steps.time / 0.0


@reward("test_broken")
def broken(steps: Steps) -> torch.Tensor:
    """A mistake."""
    return steps.altitude


@pytest.mark.parametrize(
    ("term", "reason"), [("table", r"\(1, 2\)"), ("endless", "finite"), ("broken", "altitude")]
)
def test_unusable_terms_in_torch_are_named_with_their_file(term, reason):
    with pytest.raises(InputError, match=reason) as error:
        fly(worlds(reward={"test_near": 1.0, f"test_{term}": 0.0}), FORWARD)
    message = str(error.value)
    assert f"test_{term}" in message and __file__ in message and "\n" not in message


def test_terms_in_torch_are_stepped_with_a_reason():
    rewards = {"test_far_torch": 1.0, "test_near": 0.0}
    task = BaseTaskSettings.read({"name": "test_reach", "reward": rewards})
    collector = make(task=task, num_envs=4, compiled=True)
    assert "not fused: term test_far_torch is in torch" in collector.name
    batch = collector.collect()
    logged = batch_metrics(batch, terms=as_task(task).reward_terms)
    assert logged["reward/test_far_torch"] == pytest.approx(logged["train/reward"], abs=1e-4)


def test_a_camera_may_start_among_objects_that_keep_apart_from_the_start():
    around = {"count": 4, "size": [0.5, 0.5, 5.0], "x": [-4.0, 4.0], "y": [-4.0, 4.0]}
    start = {"apart": 0.5}
    values = {"name": "test_reach", "objects": {"ball": BALL, "around": around}, "start": start}
    region, camera = BaseTaskSettings.read(values).object_region, CameraSettings()
    check_appearance(AppearanceSettings(), camera, region, "test_reach")
    forward = AppearanceSettings(camera_offset=(0.6, 0.0, 0.0))
    with pytest.raises(InputError, match=r"give less than 0\.5"):  # 0.5 m and half the drone, 0.4
        check_appearance(forward, camera, region, "test_reach")


@drone_rl.success("test_any_goal")
def any_goal(step: Step) -> bool:
    """One of two goals is reached."""
    return step.remaining <= 1


@drone_rl.success("test_late_goals")
def late_goals(step: Step) -> bool:
    """Every goal is reached, and a minute is over."""
    return step.remaining == 0 and step.time > 60.0


@pytest.mark.parametrize(
    ("success", "reached", "finally_reached"),
    [("test_any_goal", 2, 2), ("test_late_goals", 1, 0), ("all_goals", 1, 1)],
)
def test_goals_count_by_the_success_of_the_episode(success, reached, finally_reached):
    far = {**BALL, "x": 30.0}
    made = worlds(objects={"ball": BALL, "far": far}, success=[success])
    fly(made, *[FORWARD] * 5)  # at x = 5 the drone touches the nearer ball of radius 1 at x = 6
    assert int(made.task.score(made.info()).reached.sum()) == reached
    fly(made, *[FORWARD] * 7)  # to the step limit
    assert int(made.task.score(made.info()).reached.sum()) == finally_reached
    words = made.task.vocabulary
    assert words.succeeds == (
        "reaches every goal" if success == "all_goals" else f"succeeds ({success})"
    )
