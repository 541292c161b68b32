"""Verdicts as files hold them: those that were judged are accepted, changed ones are refused."""

import json
import math

import pytest

from benchmarks.evidence import changed
from drone_rl.evaluation.consistency import check_verdict
from drone_rl.evaluation.verdict import apply_rule
from drone_rl.sim.tasks import CollectCubes
from drone_rl.sim.tasks.collect_cubes import EndReason, Side
from drone_rl.utils.errors import InputError
from drone_rl.utils.intervals import proportion

LEFT, AHEAD, RIGHT = Side
LAYOUTS = [[LEFT, RIGHT], [RIGHT, LEFT], [AHEAD, LEFT], [RIGHT, AHEAD]]


@pytest.fixture
def judged(make_episodes, make_baselines):
    """`verdict.json` of a policy that collects what `hits` says of the sides of its episodes."""

    def judged(hits, number=400, **kwargs):
        sides = [LAYOUTS[i % 4] for i in range(number)]
        episodes = make_episodes(sides, [[hits(i, s) for s in row] for i, row in enumerate(sides)])
        verdict = apply_rule(episodes, make_baselines(episodes), sampled=episodes, **kwargs)
        return json.loads(json.dumps(verdict.as_dict()))

    return judged


@pytest.mark.parametrize("number", [3, 40, 400])
@pytest.mark.parametrize(
    "hits",
    [
        lambda i, side: True,
        lambda i, side: False,
        lambda i, side: side != LEFT,
        lambda i, side: side != AHEAD,
        lambda i, side: i % 8 < 4,
        lambda i, side: i % 40 != 0,
    ],
)
def test_verdicts_that_were_judged_are_accepted(judged, hits, number):
    check_verdict(judged(hits, number))


def test_all_goals_may_be_reached_without_success(make_episodes, make_baselines):
    """As if the drone had crossed the finish line and the side boundary in one step."""
    episodes = make_episodes([[LEFT, RIGHT]] * 40, [[True, True]] * 40)
    episodes.end_reason[0] = EndReason.SIDE_BOUNDARY
    verdict = apply_rule(episodes, make_baselines(episodes), sampled=episodes).as_dict()
    assert verdict["greedy"]["success"]["successes"] == 39
    assert verdict["failures"]["bound"]["successes"] == 1
    check_verdict(json.loads(json.dumps(verdict)))


ONE = {"share": 1.0, "successes": 400}
LIES = [
    {"kind": "good"},
    {"kind": "splendid"},
    {"kind": "one-sided (left)"},
    {"certain": "yes"},
    {"exit_code": 0},
    {"exit_code": None},
    {"rule": "good: this one"},
    {"error_rate": 0.5},
    {"good_share": 0.0},
    {"num_cubes": -1},
    {"num_cubes": 40},
    {"greedy": None},
    {"greedy.episodes": -5},
    {"greedy.episodes": 4000},
    {"greedy.episodes": 10**30},
    {"greedy.success.share": 7},
    {"greedy.success": {**ONE, "trials": 400, "lower95": 0.99, "upper95": 1.0}},
    {"greedy.shares.all.mean": 1e308},
    {"greedy.shares.all.mean": 1.0},
    {"greedy.shares.left.mean": 1.0},
    {"greedy.shares.left.count": 0},
    {"greedy.shares.left.lower95": 0.2},
    {"greedy.shares": {}},
    {"greedy.mean_goals": 3},
    {"greedy.mean_length": 1e9},
    {"greedy.ends.front_boundary.successes": 100},
    {"greedy.never_reached.mean": -1},
    {"sampled.success.share": 1.0},
    {"sampled.episodes": 10},
    {"baselines": {}},
    {"baselines.oracle": None},
    {"baselines.oracle.success.share": 0.1},
    {"baselines.forward.shares.all.mean": 0.0},
    {"quantities": {}},
    {"quantities.success.value": 0.1},
    {"quantities.success.lower": 0.1},
    {"quantities.success.upper": math.inf},
    {"quantities.success.thresholds": [-1.0]},
    {"quantities.success.thresholds": [0.0, 0.5]},
    {"quantities.collected left.thresholds": [0.3]},
    {"quantities.offered left.value": 0.0},
    {"quantities.offered left.lower": 0.75},
    {"quantities.collected left.value": 1.0},
    {"quantities.above forward.upper": 0.0},
    {"skill.oracle.mean": 1.0},
    {"drawing.mean": 0.5},
    {"failures.bound.successes": 0},
    {"failures.bound": {**ONE, "trials": 400, "lower95": 0.99, "upper95": 1.0}},
    {"failures.rows.0.failed": 1000},
    {"failures.rows.0.share": 0.0},
    {"failures.rows": []},
    {"failures.largest.failed": 1},
]


@pytest.mark.parametrize(
    "lie", LIES, ids=lambda lie: ",".join(f"{k}={v}" for k, v in lie.items())[:60]
)
def test_a_verdict_that_contradicts_itself_is_refused(judged, lie):
    """Of a policy that has lost its left: certainly one-sided."""
    verdict = judged(lambda i, side: side != LEFT)
    assert (verdict["kind"], verdict["certain"]) == ("one-sided (right)", True)
    with pytest.raises(InputError):
        check_verdict(changed(verdict, lie))


def test_few_episodes_can_not_be_made_certain(judged):
    verdict = judged(lambda i, side: True, number=5)
    assert not verdict["certain"]
    with pytest.raises(InputError, match="certain"):
        check_verdict({**verdict, "certain": True, "exit_code": 0})
    narrow = {
        f"quantities.{name}.{end}": quantity["value"]
        for name, quantity in verdict["quantities"].items()
        if quantity["value"] is not None
        for end in ("lower", "upper")
    }
    with pytest.raises(InputError, match="narrower"):
        check_verdict(changed(verdict, {**narrow, "certain": True, "exit_code": 0}))


def test_a_second_evaluation_of_a_name_does_not_divert_the_check(judged):
    verdict = judged(lambda i, side: side != LEFT)
    lie = changed(verdict, {"baselines.oracle.success.share": 0.1})
    with pytest.raises(InputError):
        check_verdict({**lie, "oracle": verdict["baselines"]["oracle"]})


def renamed(value, old, new):
    """A verdict whose keys have another name of a baseline or side."""
    if not isinstance(value, dict):
        return value
    return {k.replace(old, new): renamed(v, old, new) for k, v in value.items()}


def test_names_of_baselines_and_sides_may_have_several_words(judged):
    verdict = renamed(judged(lambda i, side: side != LEFT), "right", "turn right")
    assert {"turn right", "oracle"} < verdict["baselines"].keys()
    check_verdict(verdict)
    with pytest.raises(InputError, match="unsolved by turn right"):
        check_verdict(changed(verdict, {"quantities.unsolved by turn right.value": 0.1}))


def test_a_baseline_named_as_the_policy_does_not_divert_the_check(judged):
    verdict = renamed(judged(lambda i, side: side != LEFT), "random", "greedy")
    check_verdict(verdict)
    with pytest.raises(InputError, match=r"greedy\.mean_goals"):
        check_verdict(changed(verdict, {"greedy.mean_goals": 3}))
    with pytest.raises(InputError, match=r"sampled\.mean_goals"):
        named = {k.replace("forward", "sampled"): v for k, v in verdict["baselines"].items()}
        check_verdict(changed({**verdict, "baselines": named}, {"baselines.sampled.mean_goals": 3}))


def test_sides_in_another_order_are_the_same_sides(judged):
    verdict = judged(lambda i, side: side != LEFT)
    shares = verdict["greedy"]["shares"]
    verdict["greedy"]["shares"] = dict(reversed(shares.items()))
    check_verdict(verdict)


def test_an_uncertain_verdict_has_the_exit_code_of_uncertainty(judged):
    verdict = judged(lambda i, side: True, number=5)
    with pytest.raises(InputError, match="exit_code=10 is not that of its kind"):
        check_verdict({**verdict, "exit_code": 10})


def test_names_of_several_words_are_read_whole(make_episodes, make_baselines):
    """Of a task with the baseline "turn left" and the stratum "far right"."""

    class Worded(CollectCubes):
        strata = ("left", "ahead", "far right")
        blind_baselines = ("random", "turn left")

    sides = [LAYOUTS[i % 4] for i in range(40)]
    flown = make_episodes(sides, [[True, side != LEFT] for _, side in sides], task=Worded())
    baselines = make_baselines(flown)
    named = {name.replace("left", "turn left"): of for name, of in baselines.items()}
    named = {name: named[name] for name in ("random", "turn left", "oracle")}
    for of in named.values():
        of.task = flown.task
    check_verdict(json.loads(json.dumps(apply_rule(flown, named).as_dict())))


def test_failures_can_not_be_left_out(judged):
    verdict = judged(lambda i, side: i % 40 != 0)
    table, keys = verdict["failures"], ("share", "lower95", "upper95")
    rows = [
        {**r, "failed": 0, **{k: proportion(0, r["episodes"])[k] for k in keys}}
        for r in table["rows"]
    ]
    none = {**table, "rows": rows, "bound": proportion(0, 400), "largest": None}
    with pytest.raises(InputError, match="contradict the goals"):
        check_verdict({**verdict, "failures": none})


PROOF = {"refused": None, "every": True, "share": 1.0, "lost": 0.0, "undecided": 0.0}
PROOF |= {"finished": True, "checked": 1000, "wrong_at_most": 0.003, "agreeing": 400}


@pytest.mark.parametrize(
    "lie",
    [
        {"lost": 0.5},
        {"share": 0.5},
        {"agreeing": 9},
        {"agreeing": 401},
        {"checked": 1},
        {"checked": 0},
        {"wrong_at_most": 1e-9},
    ],
)
def test_a_proof_that_contradicts_itself_is_refused(judged, lie):
    verdict = judged(lambda i, side: True)
    check_verdict({**verdict, "proof": PROOF})
    with pytest.raises(InputError):
        check_verdict({**verdict, "proof": {**PROOF, **lie}})


def test_a_proof_of_every_placement_has_no_failures_beside_it(judged):
    with pytest.raises(InputError, match=r"proof\.every"):
        check_verdict({**judged(lambda i, side: side != LEFT), "proof": PROOF})


@pytest.mark.parametrize(
    "lie",
    [
        {"rounding": {"fragile": 9, "frames": 10, "fragile_rate": 0.0}},
        {"rounding": {"excessive": True}},
        {"rounding": {"decides": True}},
        {"enough": 3},
    ],
)
def test_rounding_and_certainty_go_together(judged, lie):
    with pytest.raises(InputError):
        check_verdict({**judged(lambda i, side: True), **lie})
