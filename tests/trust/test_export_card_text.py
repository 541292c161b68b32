"""What a card says follows from the verdict and from where it comes."""

import pytest

from drone_rl.sim.vocabulary import TaskVocabulary
from drone_rl.trust.export import SENTENCES
from drone_rl.utils.text import said

SHARE = {"mean": 0.9, "lower95": 0.8, "upper95": 1.0}
NOT_OFFERED = {"mean": None, "lower95": 0.0, "upper95": 1.0}
SUCCESS = {"share": 0.75, "lower95": 0.7, "upper95": 0.8, "trials": 400}


def flights(share=0.9):
    sides = {"all": {**SHARE, "mean": share}, "left": NOT_OFFERED, "ahead": SHARE, "right": SHARE}
    return {"episodes": 400, "success": SUCCESS, "shares": sides}


LARGEST = {"by": "cube", "value": "first", "episodes": 400, "failed": 31, **SUCCESS}
OTHER = {**LARGEST, "by": "end", "value": "step_limit", "failed": 4}
VERDICT = {
    "kind": "poor",
    "certain": True,
    "sentence": "This policy does not do its task.",
    "error_rate": 0.05,
    "greedy": flights(),
    "sampled": flights(0.6),
    "baselines": {
        "random": flights(0.1),
        "forward": flights(0.3),
        "left": flights(0.0),
        "right": flights(0.0),
        "oracle": flights(1.0),
    },
    "failures": {
        "rows": [{**LARGEST, "value": "second", "failed": 0}, OTHER, LARGEST],
        "largest": LARGEST,
        "bound": {"share": 0.25, "lower95": 0.2, "upper95": 0.3, "trials": 400},
    },
}
TASK = {"num_cubes": 3, "cube_size": 2.5, "lateral_bound": 6.0, "vertical_bound": 0.0}
CARD = {
    "command": "drone-rl train seed=7",
    "progress": {"frames": 12345},
    "provenance": {
        "versions": {"torch": "1", "torchrl": "2", "mujoco-warp": "3"},
        "git_revision": "abc",
    },
    "verdict": VERDICT,
    "worlds": "report",
    "seed": 5,
    "chosen": None,
    "task": TASK,
}


def test_what_is_always_said():
    found = said(SENTENCES, CARD)
    assert found["card.verdict"] == (
        "**poor** (certain, with a chance of error of at most 5%): "
        "This policy does not do its task."
    )
    assert "400 episodes in environments reserved for reports (seed 5)" in found["card.reported"]
    assert "three cubes of 2.5 m, up to 6 m to either side and 0 m" in found["card.tested"]
    assert "nothing is known of other colors, light or sizes" in found["card.tested"]
    assert "not for a real drone" in found["card.use"]
    assert "not recorded" in found["card.not_chosen"]
    assert "95% intervals that count episodes" in found["card.intervals"]
    assert "card.chosen" not in found
    assert "card.greedy_only" not in found


@pytest.mark.parametrize(
    ("name", "evidence", "part"),
    [
        ("card.verdict", {"verdict": {**VERDICT, "certain": False}}, "**poor** (not certain): "),
        ("card.verdict", {"verdict": {**VERDICT, "kind": "good"}}, "**good**"),
        ("card.reported", {"seed": 9}, "(seed 9)"),
        ("card.chosen", {"chosen": {"runs": 201, "episodes": 200}}, "201 runs of a sweep, which"),
        ("card.chosen", {"chosen": {"runs": 3, "episodes": None}}, "it was not judged"),
        ("card.tested", {"task": {**TASK, "num_cubes": 7}}, "7 cubes"),
        ("card.greedy_only", {"verdict": {**VERDICT, "sampled": None}}, "were run"),
    ],
)
def test_evidence_changes_a_sentence(name, evidence, part):
    found = said(SENTENCES, {**CARD, **evidence})
    assert part in found[name]
    assert found[name] != said(SENTENCES, CARD).get(name)


BODY = {
    **{"mode": "simple_flight", "wind": [0.0, 3.0, 4.0], "gusts": 1.5, "mass": 1.2},
    **{"control_ticks": 66, "tick": 0.003},
}


def test_a_body_is_told_with_its_air():
    told = said(SENTENCES, {**CARD, "dynamics": BODY})["card.body"]
    assert "a quadrotor of 1.2 kg in wind of 5 m/s and gusts of 1.5 m/s, with" in told
    assert "every 0.198 s" in told and "other drones, air or modes" in told
    still = {**BODY, "wind": [0.0, 0.0, 0.0], "gusts": 0.0}
    assert "kg in still air" in said(SENTENCES, {**CARD, "dynamics": still})["card.body"]
    for none in (None, {**BODY, "mode": "computer_vision"}):
        assert "card.body" not in said(SENTENCES, {**CARD, "dynamics": none})


@pytest.mark.parametrize(
    ("name", "evidence"),
    [
        ("card.reported", {"worlds": "choice"}),
        ("card.not_chosen", {"chosen": {"runs": 3, "episodes": None}}),
    ],
)
def test_without_its_evidence_a_sentence_goes(name, evidence):
    assert name not in said(SENTENCES, {**CARD, **evidence})


def test_a_task_of_the_users_own_is_named():
    verdict = {**VERDICT, "terms": TaskVocabulary(goal="post").as_dict()}
    found = said(SENTENCES, {**CARD, "verdict": verdict, "task": {"name": "pass_post"}})
    assert found["card.tested"].startswith("Tested with task pass_post,")


def test_the_only_run_of_a_sweep_was_not_chosen_among_several():
    found = said(SENTENCES, {**CARD, "chosen": {"runs": 1, "episodes": 200}})
    assert found["card.chosen"].startswith("It is the only run of a sweep")


def test_another_appearance_is_not_called_the_tasks():
    told = said(SENTENCES, {**CARD, "appearance": {"fog_visibility": 40.0}})["card.tested"]
    assert "with the appearance of its training only: nothing is known" in told
    assert "this task's appearance" in said(SENTENCES, CARD)["card.tested"]
