"""Evaluations in Python, and how they show themselves."""

import pytest

import drone_rl
from drone_rl.config import AppearanceSettings
from drone_rl.sim.vocabulary import shipped_vocabulary
from drone_rl.trust.evaluate import Evaluation
from drone_rl.utils.errors import InputError
from drone_rl.utils.progress import silent
from tests.fake_flight import floating

CUBES = shipped_vocabulary("collect_cubes")


@pytest.fixture(scope="module")
def good():
    return drone_rl.load_policy("good")


def test_evaluation_in_python(good):
    said = []

    def note(text, done=0, total=0):
        said.append((text, done, total))

    done = drone_rl.evaluate(good, task={"num_cubes": 2}, episodes=6, num_envs=4, progress=note)
    assert set(done.figures) == {
        "greedy",
        "sampled",
        "random",
        "forward",
        "left",
        "right",
        "oracle",
    }
    assert done.figures["oracle"].mean_goals == 2.0
    assert done.success == done.greedy.success.share
    assert done.trained["frames"] > 0
    assert said[:2] == [("repeated episodes", 0, 0), ("most probable actions", 0, 3)]
    assert said[-1] == ("evaluated", 3, 3)
    assert "<td>success rate</td>" in done._repr_html_()


def test_a_missing_oracle_is_named(good):
    done = drone_rl.evaluate(good, episodes=2, num_envs=2, progress=silent)
    assert "no oracle" not in str(done.notes())
    figures = {n: of for n, of in done.figures.items() if n != "oracle"}
    kept = {"policy": "good", "terms": done.terms, "seed": 0, "seed_is_fixed": True}
    assert "There is no oracle" in str(Evaluation(**kept, **figures).notes())


def test_another_appearance_is_named(good):
    good = good.in_task(num_cubes=1)  # short episodes
    few, fog = (
        {"episodes": 4, "sampled": False, "progress": silent},
        AppearanceSettings(shadows=1.0),
    )
    done = drone_rl.judge(good, appearance=fog, **few)
    said = "It was trained with other settings: here it flew with appearance.shadows=1 instead of"
    assert said in str(done) and said in done.sentence
    assert dict(done.unlike["appearance.shadows"]) == {"own": 0.0, "flown": 1.0}
    two = {"episodes": 2, "num_envs": 2, "baselines": False, "progress": silent}
    found = drone_rl.evaluate(good, appearance=fog, **two)
    assert said in str(found) and "appearance.shadows" in found.unlike
    with pytest.raises(InputError, match="policy=forward sees no images"):
        drone_rl.judge("forward", appearance=fog, **few)


def test_other_dynamics_are_named(good, monkeypatch):
    floating(monkeypatch)
    good = good.in_task(num_cubes=1)  # short episodes
    few = {"episodes": 4, "sampled": False, "progress": silent}
    done = drone_rl.judge(good, dynamics={"mode": "simple_flight"}, **few)
    changed = {"mode": {"own": "computer_vision", "flown": "simple_flight"}}
    assert done.as_dict()["unlike"] == changed
    assert "here it flew with dynamics.mode=simple_flight instead of computer_vision." in str(done)
    assert not drone_rl.judge(good, **few).unlike
    luck = drone_rl.judge(
        "forward", task={"num_cubes": 1}, dynamics={"mode": "simple_flight"}, **few
    )
    assert not luck.unlike
    moved = good.in_dynamics(mode="simple_flight", wind=[-5.0, 0.0, 0.0])
    few = {"episodes": 2, "num_envs": 2, "seed": 1, "progress": silent}  # the same placements
    done = drone_rl.evaluate(moved, **few)
    assert "dynamics.wind=[-5, 0, 0] instead of [0, 0, 0]" in str(done)
    assert done.unlike["wind"].flown == [-5.0, 0.0, 0.0]
    steps = done.figures["forward"].mean_length  # against half a metre of wind a step
    assert steps > drone_rl.evaluate(good, **few).figures["forward"].mean_length
