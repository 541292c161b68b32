import json
from pathlib import Path

from benchmarks import verdicts
from benchmarks.scripted_policies import SCRIPTS


def entry(kind, certain, truth):
    return {"kind": kind, "certain": certain, "is": truth}


def test_right_and_certain_verdicts_are_counted():
    found = verdicts.count(
        {
            "right": entry("good", True, "good"),
            "wrong": entry("good", True, "poor"),
            "open": entry("good", False, "poor"),
        }
    )
    figures = [found[f"verdicts_{name}"] for name in ("right", "certain", "total")]
    assert figures == [1, 2, 3]


def test_enough_policies_are_judged():
    trained = len(verdicts.RATES) * len(verdicts.SEEDS)
    assert len(SCRIPTS) + len(verdicts.SHIPPED) + len(verdicts.BASELINES) + trained >= 50


def test_the_true_kind_comes_from_other_environments(monkeypatch):
    random_states = []
    run_baselines = verdicts.run_baselines

    def record(num_envs, task, state, episodes):
        random_states.append(state["random_states"][0])
        return run_baselines(20, task, {"random_states": state["random_states"][:20]}, episodes)

    monkeypatch.setattr(verdicts, "run_baselines", record)
    monkeypatch.setattr(verdicts, "_NUM_ENVS", 20)
    monkeypatch.setattr(verdicts, "_sizes", lambda quick: (20, 40))
    verdicts._baselines.cache_clear()
    found = verdicts._judge_script(SCRIPTS["turns the wrong way"], quick=True)
    verdicts._baselines.cache_clear()
    assert found == {"kind": "poor", "certain": False, "is": "poor"}
    assert len(random_states) == 2
    assert random_states[0] != random_states[1]


def test_each_policy_is_trained_and_judged_twice(monkeypatch, tmp_path):
    called = []

    def call(*args, statuses=(0,)):
        called.append(args)
        folder = Path(args[-1].removeprefix("hydra.run.dir="))
        if args[0] == "verdict":
            folder.mkdir(parents=True)
            truth = "poor" if "seed=1" in args else "good"
            (folder / "verdict.json").write_text(json.dumps({"kind": truth, "certain": True}))
            assert set(statuses) == {0, 10, 11, 12, 13, 18}

    monkeypatch.setattr(verdicts, "call", call)
    monkeypatch.setattr(verdicts, "SCRIPTS", {})
    found = verdicts.bench_verdicts(tmp_path, "cpu", quick=False)
    assert found["verdicts"]["lr=0.007 seed=2"] == entry("good", True, "poor")
    assert (found["verdicts_right"], found["verdicts_certain"]) == (0, 20)
    judged = [args for args in called if args[0] == "verdict"]
    assert [args[2] for args in judged[:2]] == ["episodes=400", "episodes=5000"]
    assert judged[0][1] == judged[1][1] == "policy=good"
    assert sum(args[0] == "train" for args in called) == 12
    assert judged[-1][1] == f"policy={tmp_path / 'verdict_0.01_3' / 'checkpoints' / 'last.pt'}"
