import json

import pytest

import drone_rl
from drone_rl.config import DynamicsSettings, TaskSettings
from drone_rl.envs import DroneEnv
from drone_rl.policies.baselines import ConstantAgent, OracleAgent
from drone_rl.policies.policy import Policy
from drone_rl.sim.actions import Move
from drone_rl.sim.tasks.collect_cubes import Side
from drone_rl.trust.results import CameraUse, Repeated, Repetition
from drone_rl.trust.rule import Rule, VerdictKind
from drone_rl.trust.verdict import apply_rule, judge_for_selection, judge_policy, measure, observe
from drone_rl.utils.errors import InputError
from drone_rl.utils.intervals import mean_bounds, proportion
from drone_rl.utils.progress import silent
from drone_rl.utils.seeding import Stream
from tests.fake_flight import floating
from tests.second_task import Posts
from tests.training.test_train import TINY

LEFT, AHEAD, RIGHT = Side
LAYOUTS = [[LEFT, RIGHT], [RIGHT, LEFT], [AHEAD, LEFT], [RIGHT, AHEAD]]


@pytest.fixture
def judged(make_episodes, make_baselines):
    """The verdict on a policy that collects what `hits` says of the sides of 400 episodes."""

    def judged(hits, number=400, **kwargs):
        sides = [LAYOUTS[i % 4] for i in range(number)]
        episodes = make_episodes(sides, [[hits(i, s) for s in row] for i, row in enumerate(sides)])
        return apply_rule(episodes, make_baselines(episodes), **kwargs)

    return judged


@pytest.mark.parametrize(
    ("hits", "kind", "status"),
    [
        (lambda i, side: True, VerdictKind.GOOD, 0),
        (lambda i, side: side != LEFT, VerdictKind.ONE_SIDED_RIGHT, 11),
        (lambda i, side: side == AHEAD, VerdictKind.POOR, 10),  # as flying straight on
        (lambda i, side: i % 8 < 4, VerdictKind.NONE, 12),
    ],
)
def test_kinds(judged, hits, kind, status):
    verdict = judged(hits)
    assert (verdict.kind, verdict.certain, verdict.exit_code) == (kind, True, status)
    plain = verdict.as_dict()
    assert (plain["kind"], plain["certain"], plain["exit_code"]) == (kind.value, True, status)
    assert plain["sentence"] == verdict.sentence
    json.dumps(plain, allow_nan=False)


def test_few_episodes_are_not_certain(judged):
    verdict = judged(lambda i, side: True, number=5)
    assert (verdict.kind, verdict.certain, verdict.exit_code) == (VerdictKind.GOOD, False, 13)
    assert verdict.enough == 100
    assert judged(lambda i, side: True, number=100).exit_code == 0


@pytest.mark.parametrize(
    ("number", "missed", "enough"),
    [
        (40, None, 2 * 40),
        (8, None, 10 * 8),
        (100, 13, 50 * 100),  # one episode in thirteen
        (40, 14, 100 * 40),
    ],
)
def test_number_of_episodes_that_would_be_enough(judged, number, missed, enough):
    verdict = judged(lambda i, side: missed is None or i % missed > 0, number=number)
    assert (verdict.certain, verdict.enough) == (False, enough)


def test_margin_above_baselines(make_episodes, make_baselines):
    episodes = make_episodes([[LEFT, LEFT], [AHEAD, AHEAD]], [[1, 1], [1, 0]])
    baselines = make_baselines(episodes)
    told = dict(zip(Rule().quantities, observe(episodes, baselines, Rule()), strict=True))
    assert told["success"].tolist() == pytest.approx([0.1, -0.9])
    assert told["above random"].tolist() == pytest.approx([5 / 6, 0.5 - 1 / 6])
    assert told["above forward"].tolist() == pytest.approx([5 / 6, 0.5 - 5 / 6 - 1 / 6])


def test_success_at_the_threshold_is_not_good(judged):
    verdict = judged(lambda i, side: i % 10 > 0)
    assert verdict.greedy.success.share == 0.9
    assert (verdict.kind, verdict.certain) == (VerdictKind.NONE, False)
    assert verdict.enough is None
    assert judged(lambda i, side: i % 10 > 0, rule=Rule(good_share=0.8)).kind is VerdictKind.GOOD


def test_quantities_by_hand(make_episodes, make_baselines):
    episodes = make_episodes([[LEFT, LEFT], [LEFT, RIGHT], [AHEAD, -1]], [[1, 1], [1, 0], [0, 0]])
    baselines, rule = make_baselines(episodes), Rule()
    found = measure(episodes, baselines, rule)
    success = mean_bounds([0.1, -0.9, -0.9], -0.9, 1.0, rule.confidence)
    assert (found["success"].value, found["success"].lower) == (success.mean, success.lower95)
    offered = proportion(2, 3, rule.confidence)
    assert (found["offered left"].value, found["offered left"].upper) == (2 / 3, offered.upper95)
    assert found["collected left"].value == 1.0
    assert found["collected right"].value == 0.0
    assert found["collected right"].upper == mean_bounds([0.0], confidence=rule.confidence).upper95
    # shares 1, 0.5, 0; random 0; straight on 0, 0, 0.5, the oracle 1
    assert found["above random"].value == pytest.approx(0.5 - 1 / 6)
    assert found["above forward"].value == pytest.approx(0.5 - 5 / 6 * 0.5 / 3 - 1 / 6)


def test_sides_without_goals_do_not_count(make_episodes, make_baselines):
    episodes = make_episodes([[AHEAD, AHEAD]] * 400, [[1, 1]] * 400)
    verdict = apply_rule(episodes, make_baselines(episodes))
    assert (verdict.kind, verdict.certain) == (VerdictKind.TRIVIAL, True)
    assert verdict.greedy.shares["left"].mean is None
    assert "0%" not in verdict.sentence.replace("100%", "")


@pytest.mark.parametrize(
    ("solved", "kind", "certain", "status"),
    [(400, VerdictKind.TRIVIAL, True, 18), (360, VerdictKind.TRIVIAL, False, 13),
     (352, VerdictKind.GOOD, False, 13), (200, VerdictKind.GOOD, True, 0)],
)  # fmt: skip
def test_task_that_a_baseline_solves_is_trivial(
    make_episodes, make_baselines, solved, kind, certain, status
):
    """Of 400 episodes the policy succeeds in all; flying straight needs 360 to be good, too."""
    sides = [[AHEAD, AHEAD if i < solved else LEFT] for i in range(400)]
    episodes = make_episodes(sides, [[1, 1]] * 400)
    verdict = apply_rule(episodes, make_baselines(episodes))
    assert (verdict.kind, verdict.certain, verdict.exit_code) == (kind, certain, status)
    trivial = 'task is trivial: the baseline "always forward" collects every cube in 100% of'
    assert (trivial in verdict.sentence) == (solved == 400)


def test_baselines_have_the_dynamics_of_the_environment(monkeypatch):
    """The baselines of a verdict meet the same wind as the policy."""
    floating(monkeypatch)
    task = TaskSettings(num_cubes=1)
    against = DynamicsSettings(mode="simple_flight", wind=(-2.0, 0.0, 0.0))
    env = DroneEnv(3, task, pixels=False, dynamics=against)
    verdict = judge_policy(env, ConstantAgent(Move.FORWARD), 3, sampled=False)
    policy, baseline = verdict.greedy, verdict.baselines["forward"]
    assert policy.mean_length == baseline.mean_length
    still = judge_policy(DroneEnv(3, task, pixels=False), ConstantAgent(Move.FORWARD), 3)
    assert still.greedy.mean_length < policy.mean_length


def test_other_initial_states_are_refused(make_episodes, make_baselines):
    ours = make_episodes([[LEFT, LEFT]] * 2, [[1, 1]] * 2)
    theirs = make_episodes([[RIGHT, LEFT]] * 2, [[1, 1]] * 2)
    with pytest.raises(ValueError, match="different initial states"):
        apply_rule(ours, make_baselines(theirs))
    with pytest.raises(ValueError, match="different initial states"):
        apply_rule(ours, make_baselines(ours), sampled=ours.first(1))


def test_sampled_episodes_are_compared_pairwise(judged, make_episodes):
    sides = [LAYOUTS[i % 4] for i in range(400)]
    drawn = make_episodes(sides, [[i % 2 == 0] * 2 for i in range(400)])
    verdict = judged(lambda i, side: True, sampled=drawn)
    assert verdict.drawing.mean == -0.5
    assert verdict.sampled.success.share == 0.5
    assert verdict.kind is VerdictKind.GOOD


def test_verdict_repeats():
    task = TaskSettings(num_cubes=1)
    verdicts = []
    for _ in range(2):
        env = DroneEnv(16, task, pixels=False)
        verdicts.append(judge_policy(env, OracleAgent(), 20, sampled=True))
    first, again = verdicts
    assert first == again
    assert first.greedy == first.sampled == first.baselines["oracle"]
    assert first.baselines["left"].mean_goals == 0.0
    assert 0 < first.baselines["forward"].mean_goals < 1


def test_verdict_on_another_task():
    env = DroneEnv(20, Posts(), pixels=False)
    straight = judge_policy(env, ConstantAgent(Move.FORWARD), 200, sampled=False)
    assert (straight.kind, straight.certain) == (VerdictKind.TRIVIAL, True)
    evidence = straight
    assert list(evidence.quantities) == [
        "success", "offered left", "offered right", "collected left", "collected right",
        "above random", "above forward", "unsolved by random", "unsolved by forward",
    ]  # fmt: skip
    assert list(evidence.baselines) == ["random", "forward", "oracle"]
    leaving = judge_policy(env, ConstantAgent(Move.LEFT), 200, sampled=False)
    assert (leaving.kind, leaving.certain) == (VerdictKind.POOR, True)
    assert leaving.failures.largest.value in ("left", "right")


@pytest.mark.parametrize(
    ("policy", "oracle", "forward", "kind", "certain"),
    [
        (400, None, 12, VerdictKind.GOOD, True),
        (300, 8, 12, VerdictKind.NONE, True),  # absolute: 75% are not 90%
        (340, 340, 12, VerdictKind.GOOD, True),  # relative: the oracle succeeds in no more
        (400, 260, 240, VerdictKind.GOOD, True),  # not trivial: the policy solves all episodes
        (340, 340, 340, VerdictKind.TRIVIAL, True),
        (400, 210, 12, VerdictKind.GOOD, False),  # 50% lie within the interval of the oracle
    ],
)
def test_only_an_oracle_that_succeeds_sets_the_thresholds(
    make_episodes, policy, oracle, forward, kind, certain
):
    """Of 400 episodes with one cube ahead, how many each solves."""

    def flown(solved):
        return make_episodes([[AHEAD]] * 400, [[i < solved] for i in range(400)])

    numbers = {"random": 0, "forward": forward, "left": 0, "right": 0, "oracle": oracle}
    baselines = {name: flown(number) for name, number in numbers.items() if number is not None}
    verdict = apply_rule(flown(policy), baselines)
    assert (verdict.kind, verdict.certain) == (kind, certain)
    assert verdict.is_trivial == (kind is VerdictKind.TRIVIAL)


def test_task_without_an_oracle():
    class Blind(Posts):
        name, oracle = "fog", None

    env = DroneEnv(20, Blind(), pixels=False)
    straight = judge_policy(env, ConstantAgent(Move.FORWARD), 200, sampled=False)
    assert list(straight.baselines) == ["random", "forward"]
    assert (straight.kind, straight.certain) == (VerdictKind.TRIVIAL, True)
    assert straight.failing_side is None


def repeated(different, successes=50):
    run = Repeated(how="one environment at a time", different=different, successes=successes)
    same = Repeated(how="8 environments at a time", different=0, successes=50)
    made = {"implementation": "PyTorch", "episodes": 50, "successes": 50}
    return Repetition(**made, runs=(same, run))


@pytest.mark.parametrize(("different", "is_certain"), [(0, True), (1, True), (2, False)])
def test_a_verdict_is_certain_only_if_at_most_one_repeated_episode_differs(
    judged, different, is_certain
):
    verdict = judged(lambda i, side: True, repetition=repeated(different, 50 - different))
    assert (verdict.kind, verdict.certain) == (VerdictKind.GOOD, is_certain)
    assert verdict.exit_code == (0 if is_certain else 13)
    words = "2 of 50 episodes drawn at random end otherwise: it collects every cube in 48 of them "
    assert (words in verdict.sentence) != is_certain


@pytest.mark.parametrize(("number", "is_certain"), [(49, False), (52, True)])
def test_fewer_than_50_episodes_are_not_certain(judged, number, is_certain):
    verdict = judged(lambda i, side: False, number)
    assert (verdict.certain, verdict.enough) == (is_certain, max(50, number))


def camera(own, exchanged, low, high, strata=(0.0, 0.0)):
    """The lower and the upper end of the intervals of the differences."""
    success = {"mean": own - exchanged, "lower95": low, "upper95": high, "count": 200}
    left = dict(zip(("lower95", "upper95"), strata, strict=True))
    made = {"success": success, "strata": {"left": {"mean": 0.0, "count": 200, **left}}}
    return CameraUse.read({"own": own, "exchanged": exchanged, **made})


@pytest.mark.parametrize(
    ("found", "is_used"),
    [
        (camera(1.0, 0.99, -0.02, 0.04), False),
        (camera(1.0, 0.95, 0.01, 0.1), False),
        (camera(1.0, 0.91, 0.05, 0.11), None),
        (camera(1.0, 0.5, 0.4, 0.6), True),
        (camera(0.29, 0.29, -0.02, 0.02), None),  # hardly ever succeeds, so goals decide
        (camera(0.05, 0.0, 0.01, 0.09, strata=(0.11, 0.3)), True),
        (camera(0.05, 0.0, 0.01, 0.09, strata=(0.1, 0.3)), None),
    ],
)
def test_use_of_the_camera(found, is_used):
    assert found.is_used is is_used


def test_only_a_policy_that_uses_its_camera_is_good(judged):
    seeing = judged(lambda i, side: True, camera=camera(1.0, 0.5, 0.4, 0.6))
    assert (seeing.kind, seeing.certain) == (VerdictKind.GOOD, True)
    blind = judged(lambda i, side: True, camera=camera(1.0, 0.98, -0.02, 0.05))
    assert (blind.kind, blind.certain, blind.exit_code) == (VerdictKind.TRIVIAL, True, 18)
    assert "does not use its camera: with the images of other episodes it" in blind.sentence
    unknown = judged(lambda i, side: True, camera=camera(1.0, 0.9, 0.05, 0.15))
    assert (unknown.kind, unknown.certain) == (VerdictKind.GOOD, False)
    assert "do not determine whether it uses its camera" in unknown.sentence

    alone = camera(1.0, 1.0, -1.0, 1.0).replace(exchanged=None)
    assert "no two environments ran together" in judged(lambda i, side: True, camera=alone).sentence
    few = judged(lambda i, side: True, number=12, camera=camera(1.0, 0.9, 0.05, 0.15))
    assert not few.certain and "12 episodes are too few to be certain" in few.sentence


def test_in_a_trivial_task_success_with_other_images_shows_nothing(make_episodes):
    episodes = make_episodes([[AHEAD]] * 400, [[True]] * 400)
    every = dict.fromkeys(("random", "forward", "left", "right", "oracle"), episodes)
    verdict = apply_rule(episodes, every, camera=camera(1.0, 1.0, -0.02, 0.02))
    assert (verdict.kind, verdict.certain) == (VerdictKind.TRIVIAL, True)
    assert verdict.camera and verdict.camera.is_used is None
    assert "task is trivial" in verdict.sentence and "camera" not in verdict.sentence


@pytest.fixture
def trained(tmp_path):
    """The folder of a training that was not judged."""
    return drone_rl.train(TINY, folder=tmp_path / "run", progress=silent).folder


def test_selection_has_its_own_environments(trained, monkeypatch):
    asked = {}

    def note(self, num_envs, **kwargs):
        asked.update(kwargs, num_envs=num_envs)
        raise InputError("enough")

    monkeypatch.setattr(Policy, "make_env", note)
    with pytest.raises(InputError, match="enough"):
        judge_for_selection(trained / "checkpoints" / "last.pt", 5, "cpu", "mujoco_warp")
    where = {"device": "cpu", "renderer": "mujoco_warp"}
    seed = asked.pop("seed")
    assert asked == {"stream": Stream.CHOICE, "num_envs": 5, **where}
    with pytest.raises(InputError, match="enough"):
        judge_for_selection(trained / "checkpoints" / "last.pt", 5, "cpu")
    assert asked["seed"] != seed, "both are fresh"
