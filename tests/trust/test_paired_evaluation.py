"""Whole flights, against the environment's and by hand."""

import pytest
import torch

import drone_rl
from drone_rl.collectors.complete_episodes import rollout
from drone_rl.config import DynamicsSettings, TaskSettings
from drone_rl.config.commands import MODES
from drone_rl.envs.fault_models import late_frames
from drone_rl.sim.rendering.scene import SemanticClass
from drone_rl.sim.tasks.collect_cubes import CubesEnd
from drone_rl.trust.axes import AXES
from drone_rl.trust.paired_evaluation import EvaluatedPolicy, PairedEvaluator
from drone_rl.trust.perturbations import ONSET_STEP, Condition, whiten
from drone_rl.utils.errors import InputError
from drone_rl.utils.seeding import Stream
from tests.trust.subjects import TASK, Blind, subject


@pytest.fixture
def make_bed():
    beds = []

    def make(*args, **kwargs):
        beds.append(PairedEvaluator(*args, **kwargs))
        return beds[-1]

    yield make
    for evaluator in beds:
        evaluator.close()


def test_with_nothing_different_flights_are_those_of_the_environment(make_bed):
    policy = drone_rl.load_policy("poor")
    network, described = policy.make_network().eval(), policy.description
    evaluator = make_bed(
        EvaluatedPolicy(
            network, policy.task, described.camera, {"pixels": described.make_transforms()}
        ),
        6,
    )
    flown = evaluator.run(Condition()).episodes
    with policy.flying(6, stream=Stream.SHIFTED) as (env, actor):
        expected = rollout(actor, env, 6)
    order = [expected.goals.world.tolist().index(world) for world in flown.goals.world.tolist()]
    assert sorted(order) == [*range(6)]
    assert torch.equal(flown.length, expected.length[order])
    assert torch.equal(flown.end_reason, expected.end_reason[order])
    assert torch.equal(flown.goals.reached, expected.goals.reached[order])


def test_flights_are_repeated_exactly(make_bed):
    evaluator = make_bed(subject(), 5)
    condition = AXES["slow_noise"].make(32.0, evaluator.subject) | AXES["object_color"].make(
        0.3, evaluator.subject
    )
    for mode in MODES:
        one, two = evaluator.run(condition, mode), evaluator.run(condition, mode)
        assert torch.equal(one.trace, two.trace)
        assert torch.equal(one.episodes.length, two.episodes.length)


def test_who_flies_straight_on_ends_when_it_must(make_bed):
    evaluator = make_bed(subject(Blind(0)), 20)
    flown = evaluator.run(Condition()).episodes
    hit = flown.goals.world.reshape(20, 3)[:, 1].abs() <= 1.65
    assert torch.equal(flown.success.bool(), hit)
    # touches at x = 8 - 1.65, so after 7 moves; else the boundary at x > 12 ends it after 13
    assert flown.length.tolist() == [7 if there else 13 for there in hit]
    ends = {True: CubesEnd.ALL_CUBES, False: CubesEnd.FRONT_BOUNDARY}
    assert flown.end_reason.tolist() == [ends[there] for there in hit.tolist()]


def test_a_delayed_action_is_the_one_decided_so_many_steps_before(make_bed):
    """late_frames pictures make the same flights as late actions, of who remembers nothing."""
    evaluator = make_bed(subject(), 20)
    late = evaluator.run(Condition(faults=(late_frames(2),))).episodes
    delayed = evaluator.run(Condition(delay=2)).episodes
    assert torch.equal(late.length, delayed.length)
    assert torch.equal(late.end_reason, delayed.end_reason)
    assert not torch.equal(delayed.length, evaluator.run(Condition()).episodes.length)


def test_an_onset_changes_nothing_before_it(make_bed):
    white = Condition(appearance_changes=(whiten((SemanticClass.TARGET,), 1.0),))
    evaluator = make_bed(
        subject(task=TaskSettings(num_cubes=2, first_distance=15.0, spacing=9.0)), 12
    )
    plain, onset = evaluator.run(Condition()), evaluator.run(white, "onset")
    constant = evaluator.run(white)
    early = plain.episodes.length <= ONSET_STEP
    assert torch.equal(onset.trace[early], plain.trace[early])
    assert (onset.trace[~early] != plain.trace[~early]).all()
    assert (constant.trace != plain.trace).all()


def test_luck_is_what_the_task_calls_so(make_bed):
    evaluator = make_bed(subject(Blind(1)), 20)
    blind = evaluator.run_baselines(Condition())
    assert [*blind] == ["random", "forward", "left", "right"]
    assert torch.equal(blind["left"].length, evaluator.run(Condition()).episodes.length)
    assert torch.equal(blind["left"].goals.world, blind["random"].goals.world)


def test_a_size_that_cannot_be_is_refused(make_bed):
    evaluator = make_bed(subject(), 1)
    with pytest.raises(InputError, match=r"task\.altitude=2\.5 sinks cubes"):
        evaluator.settings(Condition(task={"cube_size": 9.0}))
    with pytest.raises(InputError, match=r"camera\.horizontal_fov=175"):
        evaluator.settings(Condition(camera={"horizontal_fov": 175.0}))
    high = make_bed(subject(task=TASK.replace(vertical_bound=1.2)), 1)
    with pytest.raises(InputError, match=r"task\.vertical_bound=1\.2 puts cubes where"):
        high.settings(Condition(task={"cube_size": 1.25}))


@pytest.mark.parametrize("axis", AXES.values(), ids=AXES)
def test_at_its_strongest_every_axis_changes_what_is_seen_or_done(axis, make_bed):
    evaluator = make_bed(subject(Blind(0)), 3)
    plain = evaluator.run(Condition())
    if axis.name in ("action_delay",):  # who does the same always does the same later
        evaluator = make_bed(subject(), 12)
        plain = evaluator.run(Condition())
    flown = evaluator.run(axis.make(axis.strengths[-1], evaluator.subject))
    assert not torch.equal(flown.trace, plain.trace)


def test_the_worlds_are_the_same_under_every_condition(make_bed):
    evaluator = make_bed(subject(), 4)
    plain = evaluator.run(Condition()).episodes.goals.world
    for axis in (AXES["object_size"], AXES["step_length"], AXES["field_of_view"]):
        flown = evaluator.run(axis.make(axis.strengths[2], evaluator.subject)).episodes
        assert torch.equal(flown.goals.world, plain)
    assert TASK.cube_size == 2.5


def test_flights_in_another_body_are_those_of_the_environment(make_bed):
    gusty = DynamicsSettings(mode="simple_flight", wind=(1.0, 0.0, 0.0), gusts=1.0)
    policy = drone_rl.load_policy("good").in_dynamics(mode="simple_flight", wind=[1, 0, 0], gusts=1)
    network, described = policy.make_network().eval(), policy.description
    seen = {"pixels": described.make_transforms()}
    told = EvaluatedPolicy(network, policy.task, described.camera, seen, dynamics=gusty)
    flown = make_bed(told, 3).run(Condition()).episodes
    with policy.flying(3, stream=Stream.SHIFTED) as (env, actor):
        expected = rollout(actor, env, 3)
    order = [expected.goals.world.tolist().index(world) for world in flown.goals.world.tolist()]
    assert sorted(order) == [*range(3)]
    assert torch.equal(flown.length, expected.length[order])
    assert torch.equal(flown.end_reason, expected.end_reason[order])
