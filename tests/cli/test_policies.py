"""Shipped and trained policies in a table that fits a terminal."""

import json
import shutil

from drone_rl.policies.zoo import policy_names
from tests.evidence import VERDICT


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
    verdict = {**VERDICT, "kind": "poor", "certain": False}
    (runs / name / "result.json").write_text(json.dumps({**result, "verdict": verdict}))
    (runs / "broken" / "checkpoints").mkdir(parents=True)
    (runs / "broken" / "checkpoints" / "last.pt").write_text("x")
    lines = in_process("policies").stdout.splitlines()
    where = lines.index(f"outputs/train/runs/{name}")
    assert "poor (uncertain)" in lines[where + 1] and "60.0% (58.0% to 62.0%)" in lines[where + 1]
    assert any("not judged" in line for line in lines)
    assert any("can't be read" in line for line in lines)
    assert max(map(len, lines)) <= 100
    done = in_process("policies", "most=1")
    assert "and 2 older policies; list all with most=3" in done.stdout
