import dataclasses
import json
import math

import pytest
import torch
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from drone_rl.collectors.complete_episodes import run_episodes
from drone_rl.config import DynamicsSettings, TaskSettings
from drone_rl.envs import DroneEnv
from drone_rl.policies.baselines import constant_policy, oracle_policy
from drone_rl.sim.actions import Move
from drone_rl.sim.tasks.collect_cubes import Side
from drone_rl.sim.vocabulary import TaskVocabulary
from drone_rl.trust.outcomes import OutcomeSet, Rounding
from drone_rl.trust.rule import Kind, Rule
from drone_rl.trust.verdict import apply_rule, judge_policy, measure, observe, widen
from drone_rl.utils.errors import InputError
from drone_rl.utils.intervals import mean_bounds, proportion
from tests.fake_flight import floating
from tests.second_task import Posts

LEFT, AHEAD, RIGHT = Side
SHARED = HealthCheck.function_scoped_fixture
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
        (lambda i, side: True, Kind.GOOD, 0),
        (lambda i, side: False, Kind.POOR, 10),
        (lambda i, side: side != LEFT, Kind.ONE_SIDED_RIGHT, 11),
        (lambda i, side: side != RIGHT, Kind.ONE_SIDED_LEFT, 11),
        (lambda i, side: side != AHEAD, Kind.NONE, 12),
        (lambda i, side: side == AHEAD, Kind.POOR, 10),  # as flying straight on
        (lambda i, side: i % 8 < 4, Kind.NONE, 12),
    ],
)
def test_kinds(judged, hits, kind, status):
    verdict = judged(hits)
    assert (verdict.kind, verdict.certain, verdict.exit_code) == (kind, True, status)
    plain = verdict.as_dict()
    assert (plain["kind"], plain["certain"], plain["exit_code"]) == (kind.value, True, status)
    assert plain["sentence"] == verdict.sentence
    json.dumps(plain, allow_nan=False)


def test_few_episodes_prove_nothing(judged):
    verdict = judged(lambda i, side: True, number=5)
    assert (verdict.kind, verdict.certain, verdict.exit_code) == (Kind.GOOD, False, 13)
    assert verdict.evidence["enough"] == 100
    assert judged(lambda i, side: True, number=100).exit_code == 0


@pytest.mark.parametrize(
    ("number", "missed", "enough"),
    [
        (40, None, 2 * 40),
        (28, None, 3 * 28),
        (16, None, 5 * 16),
        (8, None, 10 * 8),
        (4, None, 20 * 4),
        (100, 13, 50 * 100),  # one episode in thirteen
        (40, 14, 100 * 40),
    ],
)
def test_how_many_episodes_would_be_enough(judged, number, missed, enough):
    verdict = judged(lambda i, side: missed is None or i % missed > 0, number=number)
    assert (verdict.certain, verdict.evidence["enough"]) == (False, enough)


def test_luck_is_measured_on_the_way_to_what_the_oracle_gets(make_episodes, make_baselines):
    episodes = make_episodes([[LEFT, LEFT], [AHEAD, AHEAD]], [[1, 1], [1, 0]])
    baselines = make_baselines(episodes)
    baselines["oracle"] = make_episodes([[LEFT, LEFT], [AHEAD, AHEAD]], [[1, 0], [0, 0]])
    told = dict(zip(Rule().quantities, observe(episodes, baselines, Rule()), strict=True))
    assert told["success"].tolist() == [1.0, 0.0]  # the oracle never succeeds
    assert told["above random"].tolist() == pytest.approx([1 - 1 / 6 * 0.5, 0.5])
    assert told["above forward"].tolist() == pytest.approx([1 - 1 / 6 * 0.5, 0.5 - 5 / 6])


def test_exactly_at_the_threshold_is_not_good_and_never_certain(judged):
    verdict = judged(lambda i, side: i % 10 > 0)
    assert verdict.evidence["greedy"]["success"]["share"] == 0.9
    assert (verdict.kind, verdict.certain) == (Kind.NONE, False)
    assert verdict.evidence["enough"] is None
    assert judged(lambda i, side: i % 10 > 0, rule=Rule(good_share=0.8)).kind is Kind.GOOD


def test_quantities_by_hand(make_episodes, make_baselines):
    episodes = make_episodes([[LEFT, LEFT], [LEFT, RIGHT], [AHEAD, -1]], [[1, 1], [1, 0], [0, 0]])
    baselines, rule = make_baselines(episodes), Rule()
    found = dict(zip(Rule().quantities, measure(episodes, baselines, rule), strict=True))
    success = mean_bounds([0.1, -0.9, -0.9], -0.9, 1.0, rule.confidence)
    assert found["success"][:3] == tuple(success[k] for k in ("mean", "lower95", "upper95"))
    offered = proportion(2, 3, rule.confidence)
    assert found["offered left"][:3] == tuple(offered[k] for k in ("share", "lower95", "upper95"))
    assert found["collected left"].value == 1.0
    assert found["collected right"].value == 0.0
    assert (
        found["collected right"].upper == mean_bounds([0.0], confidence=rule.confidence)["upper95"]
    )
    # shares 1, 0.5, 0; random 0; straight on 0, 0, 0.5, the oracle 1
    assert found["above random"].value == pytest.approx(0.5 - 1 / 6)
    assert found["above forward"].value == pytest.approx(0.5 - 5 / 6 * 0.5 / 3 - 1 / 6)


def test_more_of_the_same_is_known_better(make_episodes, make_baselines):
    episodes = make_episodes([[LEFT, RIGHT], [RIGHT, AHEAD]], [[1, 1], [1, 0]])
    baselines, rule = make_baselines(episodes), Rule()
    once, often = (measure(episodes, baselines, rule, times) for times in (1, 50))
    for few, many in zip(once, often, strict=True):
        assert few.value == pytest.approx(many.value)
        assert many.upper - many.lower < few.upper - few.lower


def test_what_was_not_offered_is_no_failure(make_episodes, make_baselines):
    episodes = make_episodes([[AHEAD, AHEAD]] * 400, [[1, 1]] * 400)
    verdict = apply_rule(episodes, make_baselines(episodes))
    assert (verdict.kind, verdict.certain) == (Kind.TRIVIAL, True)
    assert verdict.evidence["greedy"]["shares"]["left"]["mean"] is None
    assert "0%" not in verdict.sentence.replace("100%", "")


@pytest.mark.parametrize(
    ("solved", "kind", "certain", "status"),
    [(400, Kind.TRIVIAL, True, 18), (360, Kind.TRIVIAL, False, 13), (352, Kind.GOOD, False, 13),
     (200, Kind.GOOD, True, 0)],
)  # fmt: skip
def test_a_task_that_a_baseline_solves_is_trivial(
    make_episodes, make_baselines, solved, kind, certain, status
):
    """Of 400 episodes the policy succeeds in all; flying straight needs 360 to be good, too."""
    sides = [[AHEAD, AHEAD if i < solved else LEFT] for i in range(400)]
    episodes = make_episodes(sides, [[1, 1]] * 400)
    verdict = apply_rule(episodes, make_baselines(episodes))
    assert (verdict.kind, verdict.certain, verdict.exit_code) == (kind, certain, status)
    trivial = "Flying straight on does as well: it collects every cube in 100% of episodes"
    assert verdict.sentence.startswith(trivial) == (solved == 400)


def test_baselines_fly_with_the_dynamics_of_the_environment(monkeypatch):
    """The baselines of a verdict meet the same wind as the policy."""
    floating(monkeypatch)
    task = TaskSettings(num_cubes=1)
    against = DynamicsSettings(mode="simple_flight", wind=(-2.0, 0.0, 0.0))
    env = DroneEnv(3, task, pixels=False, dynamics=against)
    verdict = judge_policy(env, constant_policy(Move.FORWARD), 3, sampled=False)
    policy, baseline = verdict.evidence["greedy"], verdict.evidence["baselines"]["forward"]
    assert policy["mean_length"] == baseline["mean_length"]
    still = judge_policy(DroneEnv(3, task, pixels=False), constant_policy(Move.FORWARD), 3)
    assert still.evidence["greedy"]["mean_length"] < policy["mean_length"]


def test_other_worlds_are_no_baseline(make_episodes, make_baselines):
    ours = make_episodes([[LEFT, LEFT]] * 2, [[1, 1]] * 2)
    theirs = make_episodes([[RIGHT, LEFT]] * 2, [[1, 1]] * 2)
    with pytest.raises(ValueError, match="different initial states"):
        apply_rule(ours, make_baselines(theirs))
    with pytest.raises(ValueError, match="different initial states"):
        apply_rule(ours, make_baselines(ours), sampled=ours[:1])


def test_one_other_world_is_enough_to_be_no_baseline(make_episodes, make_baselines):
    ours = make_episodes([[LEFT, LEFT]] * 3, [[1, 1]] * 3)
    theirs = make_episodes([[LEFT, LEFT]] * 2 + [[RIGHT, LEFT]], [[1, 1]] * 3)
    with pytest.raises(ValueError, match="different initial states"):
        apply_rule(ours, make_baselines(theirs))


def test_sampled_flights_are_compared_pair_by_pair(judged, make_episodes):
    sides = [LAYOUTS[i % 4] for i in range(400)]
    drawn = make_episodes(sides, [[i % 2 == 0] * 2 for i in range(400)])
    verdict = judged(lambda i, side: True, sampled=drawn)
    assert verdict.evidence["drawing"]["mean"] == -0.5
    assert verdict.evidence["sampled"]["success"]["share"] == 0.5
    assert verdict.kind is Kind.GOOD


def test_a_policy_is_flown_beside_its_baselines_and_repeats():
    task = TaskSettings(num_cubes=1)
    dicts = []
    for _ in range(2):
        env = DroneEnv(16, task, pixels=False)
        dicts.append(judge_policy(env, oracle_policy(task), 20, sampled=True).as_dict())
    first, again = dicts
    assert first == again
    assert first["greedy"] == first["sampled"] == first["baselines"]["oracle"]
    assert first["skill"]["oracle"]["mean"] == 0.0
    assert first["baselines"]["left"]["mean_goals"] == 0.0
    assert 0 < first["baselines"]["forward"]["mean_goals"] < 1
    assert math.isclose(
        first["skill"]["forward"]["mean"], 1 - first["baselines"]["forward"]["mean_goals"]
    )


def mirrored(episodes):
    """The same episodes in a world where left is right."""
    swap = torch.tensor([Side.RIGHT, Side.AHEAD, Side.LEFT])
    goals = episodes.goals
    side = torch.where(goals.stratum < 0, -1, swap[goals.stratum])
    turned = {"stratum": side, "lateral": -goals.lateral, "world": -goals.world}
    return dataclasses.replace(episodes, goals=dataclasses.replace(goals, **turned))


@given(st.lists(st.tuples(st.sampled_from(LAYOUTS), st.booleans(), st.booleans()), min_size=1))
@settings(
    max_examples=10, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
def test_a_mirrored_flight_gets_the_mirrored_kind(make_episodes, make_baselines, drawn):
    sides, hits = [row[0] for row in drawn] * 30, [row[1:] for row in drawn] * 30
    ours = make_episodes(sides, hits)
    baselines = make_baselines(ours)
    theirs = {name: mirrored(flown) for name, flown in baselines.items()}
    theirs["left"], theirs["right"] = theirs["right"], theirs["left"]
    verdict, reflected = apply_rule(ours, baselines), apply_rule(mirrored(ours), theirs)
    assert reflected.kind is verdict.kind.mirrored
    assert reflected.certain == verdict.certain


def test_another_task_is_judged_by_its_own_strata_and_luck():
    env = DroneEnv(20, Posts(), pixels=False)
    straight = judge_policy(env, constant_policy(Move.FORWARD), 200, sampled=False)
    assert (straight.kind, straight.certain) == (Kind.TRIVIAL, True)
    evidence = straight.evidence
    assert list(evidence["quantities"]) == [
        "success", "offered left", "offered right", "collected left", "collected right",
        "above random", "above forward", "unsolved by random", "unsolved by forward",
    ]  # fmt: skip
    assert list(evidence["baselines"]) == ["random", "forward", "oracle"]
    leaving = judge_policy(env, constant_policy(Move.LEFT), 200, sampled=False)
    assert (leaving.kind, leaving.certain) == (Kind.POOR, True)
    assert leaving.evidence["failures"]["largest"]["value"] in ("left", "right")


def test_a_policy_is_flown_greedily_and_with_drawn_actions_in_the_same_worlds(monkeypatch):
    flown = []

    def run(env, actor, episodes, **how):
        flown.append((how.get("greedy", True), episodes, env.state_dict()))
        return run_episodes(env, actor, episodes, **how)

    monkeypatch.setattr("drone_rl.trust.verdict.run_episodes", run)
    task = TaskSettings(num_cubes=1)
    env = DroneEnv(2, task, pixels=False)
    before = env.state_dict()
    judge_policy(env, oracle_policy(task), 3)
    assert flown == [(True, 3, before), (False, 3, before)]
    flown.clear()
    judge_policy(env, oracle_policy(task), 3, sampled=False)
    assert [greedy for greedy, *_ in flown] == [True]


def test_a_task_without_an_oracle_is_refused_before_any_episode(monkeypatch):
    class Blind(Posts):
        name, oracle = "fog", None

    def refused(*_, **__):
        raise AssertionError("episodes were flown")

    for module in ("verdict", "baselines"):
        monkeypatch.setattr(f"drone_rl.trust.{module}.run_episodes", refused)
    env = DroneEnv(2, Blind(), pixels=False)
    with pytest.raises(InputError, match="task=fog has no oracle"):
        judge_policy(env, constant_policy(Move.LEFT), 2)


@pytest.fixture
def rounded(make_episodes, make_baselines):
    """The verdict on a perfect policy of whose 400 episodes some may end otherwise."""

    def rounded(number, *, is_open=False, excessive=False):
        sides = [LAYOUTS[i % 4] for i in range(400)]
        flown = make_episodes(sides, [[True, True]] * 400)
        lost = make_episodes(sides[:number], [[False, False]] * number) if not is_open else None
        opened = torch.arange(400) < (number if is_open else 0)
        owner = torch.arange(0 if is_open else number)
        rounding = Rounding(
            arithmetic="float32 on cpu, PyTorch",
            is_bound=True,
            frames=16_000,
            fragile=16_000 if excessive else number,
            is_fragile=torch.arange(400) < number,
            outcomes=OutcomeSet(lost, owner, opened),
            compared="fused kernel",
            compared_episodes=50,
            differing=0,
            unexplained=0,
        )
        return apply_rule(flown, make_baselines(flown), rounding=rounding)

    return rounded


@pytest.mark.parametrize("is_open", [False, True])
def test_few_episodes_that_rounding_decides_leave_a_verdict_certain(rounded, is_open):
    verdict = rounded(4, is_open=is_open)
    assert (verdict.kind, verdict.exit_code) == (Kind.GOOD, 0)
    assert verdict.sentence.endswith("The verdict holds for float32 on cpu, PyTorch.")


@pytest.mark.parametrize("is_open", [False, True])
def test_a_tenth_of_the_episodes_makes_it_uncertain(rounded, is_open):
    verdict = rounded(40, is_open=is_open)
    assert (verdict.kind, verdict.certain, verdict.exit_code) == (Kind.GOOD, False, 13)
    assert "Not certain: decisions depend on rounding. In 40 of 16,000 frames" in verdict.sentence
    assert "too few" not in verdict.sentence
    assert verdict.evidence["rounding"]["decides"]


def test_no_certainty_where_all_frames_are_fragile(rounded):
    assert rounded(1, excessive=True).exit_code == 13


def test_an_episode_that_may_offer_nothing_on_a_side_may_have_any_share_there(
    make_episodes, make_baselines
):
    flown = make_episodes([[Side.LEFT, Side.LEFT]] * 400, [[True, True]] * 400)
    ends = make_episodes([[Side.RIGHT, Side.RIGHT]] * 40, [[True, True]] * 40)
    outcomes = OutcomeSet(ends, torch.arange(40), torch.zeros(400, dtype=torch.bool))
    baselines, rule = make_baselines(flown), Rule()
    found = measure(flown, baselines, rule)
    wider = widen(found, flown, baselines, rule, outcomes)
    left = rule.quantities.index("collected left")
    assert found[left].lower > 0.95
    assert wider[left].lower < 0.9 < wider[left].upper  # 40 of the 400 may have collected none


def test_more_episodes_do_not_help_where_rounding_decides(make_episodes, make_baselines):
    flown = make_episodes([LAYOUTS[i % 4] for i in range(8)], [[True, True]] * 8)
    is_open = torch.arange(8) < 2
    rounding = Rounding(
        arithmetic="float32 on cpu, PyTorch",
        is_bound=True,
        frames=320,
        fragile=2,
        is_fragile=is_open,
        outcomes=OutcomeSet(None, torch.arange(0), is_open),
        compared="fused kernel",
        compared_episodes=8,
        differing=0,
        unexplained=0,
    )
    for one in (rounding, dataclasses.replace(rounding, fragile=320)):
        verdict = apply_rule(flown, make_baselines(flown), rounding=one)
        assert not verdict.certain and verdict.evidence["enough"] is None
        assert "would do" not in verdict.sentence


def test_phrases_that_no_file_may_hold_are_refused_before_any_episode(monkeypatch):
    class Wordy(Posts):
        name, vocabulary = "wordy", TaskVocabulary(tested="two posts\nin a row")

    def refused(*_, **__):
        raise AssertionError("episodes were flown")

    for module in ("verdict", "baselines"):
        monkeypatch.setattr(f"drone_rl.trust.{module}.run_episodes", refused)
    env = DroneEnv(2, Wordy(), pixels=False)
    with pytest.raises(InputError, match=r"terms\.tested="):
        judge_policy(env, constant_policy(Move.LEFT), 2)
