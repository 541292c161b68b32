"""Evaluations and verdicts in Python, and how they show themselves."""

import json
import re
from unittest.mock import patch

import pytest

import drone_rl
from drone_rl.config import TASKS
from drone_rl.sim.tasks.task import MAKERS
from drone_rl.sim.tasks.term_task import define_task
from drone_rl.trust.judge import Judgement, Judgements
from drone_rl.utils.errors import InputError
from drone_rl.utils.progress import silent
from drone_rl.utils.seeding import RootSeed
from tests.evidence import VERDICT, changed
from tests.verification.checker.making import of_every_place


@pytest.fixture(scope="module")
def good():
    return drone_rl.load_policy("good")


def test_verdict_in_python(good):
    few = drone_rl.judge(good, episodes=8, sampled=False, progress=silent)
    assert (few.verdict.kind, few.verdict.certain) == ("good", False)
    assert str(few).startswith("good (not certain): ")
    assert few.as_dict()["policy"] == "good"
    assert "good (not certain): " in few._repr_html_()


def refused(*_):
    raise AssertionError("episodes were flown")


def test_several_policies(good):
    done = drone_rl.judge(["oracle", "left"], episodes=150, progress=silent)
    assert [one.policy for one in done] == ["oracle", "left"] and len(done) == 2
    assert done[1].verdict.kind == "poor" and done[:1][0] is done[0]
    assert str(done).splitlines()[1].split()[:3] == ["oracle", "good", "yes"]
    assert "<td>poor</td>" in done._repr_html_()
    seed = done[0].seed
    assert done[1].seed == seed and not done[1].seed_is_fixed
    fresh = RootSeed(seed, False)
    alone = drone_rl.judge("left", episodes=150, progress=silent, drawn_seed=fresh)
    assert alone == done[1]
    both = drone_rl.judge((good, "oracle"), episodes=2, sampled=False, progress=silent)
    assert [one.policy for one in both] == ["good", "oracle"]
    with pytest.raises(InputError, match=r"policy=\[\] is empty"):
        drone_rl.judge([])
    with pytest.raises(InputError, match="policy=nope does not exist"):
        drone_rl.judge(["oracle", "nope"], progress=refused)
    for policies in ("oracle", ["oracle"]):
        with pytest.raises(InputError, match=r"^settings=\(dict\) is no JudgeSettings"):
            drone_rl.judge(policies, {"episodes": 2}, progress=refused)


def test_verdict_with_a_certificate(good, tmp_path):
    path = tmp_path / "certificate.json"
    path.write_text(json.dumps(of_every_place(good.in_task(num_cubes=1))))
    how = {"certificate": path, "episodes": 8, "sampled": False, "progress": silent}
    one = {**how, "task": {"num_cubes": 1}, "certificate_flights": 50}
    read = drone_rl.judge(good, **one)
    assert "A certificate of success from every placement is not refuted" in str(read)
    assert "is not refuted by 50 episodes from fresh placements" in str(read)
    assert (read.certificate, read.is_proved, read.status("proved")) == (str(path), False, 16)
    proved = drone_rl.judge(good, require="proved", **one)
    assert "from every placement is proved: computed here" in str(proved)
    assert (proved.is_proved, proved.status("proved")) == (True, 13)  # of 8 episodes
    assert read.proof.seed != proved.proof.seed
    with pytest.raises(InputError, match="require='prooved'"):
        drone_rl.judge(good, require="prooved", **one)
    with pytest.raises(InputError, match="another task: num_cubes=1, not 3"):
        drone_rl.judge(good, **how)
    with pytest.raises(InputError, match="policy=oracle has no network; give certificate= with"):
        drone_rl.judge("oracle", **how)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"episodes": 0}, "episodes=0"),
        ({"wind": 1}, r"^wind is a setting of dynamics; give dynamics=\{'wind': 1\}$"),
    ],
)
def test_wrong_arguments(change, message):
    with pytest.raises(InputError, match=f"^{message}"):
        drone_rl.judge("random", progress=silent, **change)


def test_seeds_are_fresh_and_reproduce_a_verdict(good):
    how = {"episodes": 12, "sampled": True, "task": {"num_cubes": 1}, "progress": silent}
    one, other = (drone_rl.judge(good, **how) for _ in range(2))
    first, second = one, other
    assert first.seed != second.seed
    assert not first.seed_is_fixed
    printed = re.search(r"environments: seed (\d+) \(fresh\)", str(one))
    assert printed is not None
    again = drone_rl.judge(good, seed=int(printed[1]), **how)
    assert again == first.replace(seed_is_fixed=True)


def test_changes_are_refused_before_any_episode(good):
    with pytest.raises(InputError, match=r"^task\.num_cubes is unknown"):
        drone_rl.judge([good, "pillars_good"], task={"num_cubes": 2}, progress=refused)
    with pytest.raises(InputError, match=r"^policy=oracle sees no images"):
        drone_rl.judge([good, "oracle"], appearance="fog", progress=refused)


def test_table_of_judgements():
    share = {"share": 0.95, "lower95": 0.9, "upper95": 1.0, "successes": 95, "trials": 100}
    good = {"kind": "good", "greedy.success": share}
    judged = {"a": changed(VERDICT, good), "<b>": changed(VERDICT, {"certain": False})}
    both = Judgements(tuple(Judgement(policy=n, **v) for n, v in judged.items()))
    assert both.rows() == [
        ["policy", "verdict", "certain", "success rate (95% CI)"],
        ["a", "good", "yes", "95.0% (90.0% to 100%)"],
        ["<b>", "none of these", "no", "60.0% (58.0% to 62.0%)"],
    ]


@pytest.mark.parametrize("task", ["pillars", {"name": "pillars", "num_rows": 2}])
def test_baselines_of_any_task_are_judged_by_name(task):
    done = drone_rl.judge("oracle", task=task, episodes=4, progress=silent)
    assert done.terms.goals == "rows" and done.greedy.success.share == 1.0


def test_a_baseline_of_a_task_of_terms_is_judged_and_its_oracle_is_missed():
    with patch.dict(TASKS), patch.dict(MAKERS):
        define_task(
            "near_ball",
            objects={"ball": {"role": "goal", "x": 4.0, "y": 0.0, "z": 2.5}},
            reward=["reached"],
            success=["all_goals"],
        )
        done = drone_rl.judge("forward", task="near_ball", episodes=4, progress=silent)
        assert done.greedy.success.share == 1.0
        with pytest.raises(InputError, match="task=near_ball has no oracle"):
            drone_rl.judge("oracle", task="near_ball", progress=silent)
