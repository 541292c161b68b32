"""Shipped and trained policies in a table that fits a terminal."""

import json
import shutil

import pytest

from drone_rl.policies.zoo import policy_names


def test_shipped_policies_with_their_verdicts(in_process, tmp_path):
    done = in_process("policies")
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert max(map(len, lines)) <= 100
    rows = {line.split()[0]: line for line in lines[1:]}
    assert rows.keys() >= set(policy_names())
    assert "collect_cubes  good" in rows["good"] and "%" in rows["good"]
    assert "one-sided (right)" in rows["right_and_forward"]
    assert rows["pillars_reckless"].split()[1] == "pillars"
    assert "no trained policies under outputs/train" in lines[-1]
    assert not list(tmp_path.iterdir())


def test_trained_policies_newest_first(run, in_process, tmp_path):
    runs = tmp_path / "outputs" / "train" / "runs"
    for name in ("2026-01-01_00-00-00-000001", "2026-01-01_00-00-00-000002"):
        shutil.copytree(run, runs / name)
    result = json.loads((runs / name / "result.json").read_text())
    success = {"share": 0.5, "lower95": 0.4, "upper95": 0.6}
    verdict = {"kind": "poor", "certain": False, "greedy": {"success": success}}
    (runs / name / "result.json").write_text(json.dumps({**result, "verdict": verdict}))
    (runs / "broken" / "checkpoints").mkdir(parents=True)
    (runs / "broken" / "checkpoints" / "last.pt").write_text("x")
    lines = in_process("policies").stdout.splitlines()
    where = lines.index(f"outputs/train/runs/{name}")
    assert "poor (uncertain)" in lines[where + 1] and "50.0% (40.0 to 60.0)" in lines[where + 1]
    assert any("not judged" in line for line in lines)
    assert any("can't be read" in line for line in lines)
    assert max(map(len, lines)) <= 100
    done = in_process("policies", "most=1")
    assert "and 2 older policies; list all with most=3" in done.stdout


@pytest.mark.parametrize(("kind", "more"), [("splendid", 1), ("\x1b[2Jsplendid", 0)])
def test_a_verdict_of_another_checkpoint_or_of_no_text_is_not_listed(
    run, in_process, tmp_path, kind, more
):
    folder = tmp_path / "outputs" / "train" / "runs" / "2026-01-01_00-00-00-000001"
    shutil.copytree(run, folder)
    result = json.loads((folder / "result.json").read_text())
    success = {"share": 1.0, "lower95": 0.9, "upper95": 1.0}
    result["verdict"] = {"kind": kind, "certain": True, "greedy": {"success": success}}
    result["frames"] += more
    (folder / "result.json").write_text(json.dumps(result))
    printed = in_process("policies").stdout
    assert "splendid" not in printed and "not judged" in printed
