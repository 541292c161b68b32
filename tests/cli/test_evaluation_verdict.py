"""Verdicts of policies and their exit statuses."""

import json

import pytest

import drone_rl
from tests.verification.checker.making import of_every_place


@pytest.mark.parametrize(
    ("policy", "status", "verdict"),
    [
        ("oracle", 0, "good"),
        ("forward", 10, "poor"),
        ("right_and_forward", 11, "one-sided (right)"),
    ],
)
def test_verdicts_are_exit_statuses(in_process, tmp_path, policy, status, verdict):
    done = in_process("verdict", f"policy={policy}", "episodes=300", "seed=0", "hydra.run.dir=v")
    assert done.returncode == status, done.stderr
    assert json.loads((tmp_path / "v" / "verdict.json").read_text())["kind"] == verdict
    assert done.stdout.startswith(verdict)


LAST = "checkpoints/last.pt"
ONE = ["verdict", "policy=good", "task.num_cubes=1", "episodes=10", "sampled=false"]


@pytest.fixture
def good():
    return drone_rl.load_policy("good").in_task(num_cubes=1)


@pytest.mark.parametrize(
    ("undecided", "status", "words"),
    [
        (False, 0, "from every placement is proved"),
        (True, 16, "from 75.0% of all placements (25.0% undecided)"),
    ],
)
def test_a_proof_can_be_required(in_process, tmp_path, good, undecided, status, words):
    made = of_every_place(good, undecided=undecided)
    (tmp_path / "c.json").write_text(json.dumps(made))
    checked = [*ONE, "episodes=150", "certificate=c.json", "certificate_flights=100"]
    done = in_process(*checked, "require=proved", "hydra.run.dir=v")
    assert done.returncode == status, done.stderr
    assert words in done.stdout
    kept = json.loads((tmp_path / "v" / "verdict.json").read_text())
    assert kept["proof"]["every"] == (status == 0)
    assert kept["certificate"] == "c.json"
    assert kept["proof"]["computed"] == (status == 0)


@pytest.mark.parametrize(
    ("policy", "more", "status"),
    [
        ("oracle", ["episodes=150"], 0),
        ("oracle", ["episodes=10"], 13),
        ("oracle", ["episodes=150", "task.lateral_bound=0.5"], 18),
    ],
)
def test_good_can_be_required(in_process, policy, more, status):
    done = in_process("verdict", f"policy={policy}", "require=good", *more)
    assert done.returncode == status, done.stdout
    if status == 18:
        assert done.stdout.startswith("good, but trivial: This policy is good, but trivial: it")


@pytest.mark.parametrize(
    ("needed", "status", "words"),
    [
        ("blur: {high: 0.5, unit: pixels}", 0, "covered: 100%"),
        ("dead_rows: {low: 12, high: 12, unit: rows}", 17, "not covered: "),
    ],
)
def test_an_operating_domain_can_be_required(in_process, tmp_path, needed, status, words):
    (tmp_path / "needs.yaml").write_text(needed)
    many = [*ONE, "episodes=150", "domain_flights=40", "require_domain=needs.yaml"]
    done = in_process(*many, "hydra.run.dir=v")
    assert done.returncode == status, done.stderr
    assert f"\n{words}" in done.stdout
    kept = json.loads((tmp_path / "v" / "verdict.json").read_text())
    assert kept["required_domain"]["test"]["success"]["trials"] == 40


def test_latest_is_recorded_as_its_folder(run, in_process, tmp_path, monkeypatch, caplog):
    """Which run `latest` is changes with the next one."""
    monkeypatch.setattr("drone_rl.cli.settings.trained_policies", lambda _: [run / "checkpoints/x"])
    monkeypatch.setattr("drone_rl.policies.zoo.files.trained_policies", lambda _: [run / LAST])
    caplog.set_level("INFO")
    in_process("verdict", "policy=latest", "episodes=4", "hydra.run.dir=v")
    assert f"policy=latest is {run}" in caplog.text
    assert json.loads((tmp_path / "v" / "verdict.json").read_text())["policy"] == str(run)
