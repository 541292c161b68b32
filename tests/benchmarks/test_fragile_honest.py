from types import SimpleNamespace

import pytest

from benchmarks import fragile_honest
from benchmarks.registry import BENCHMARKS

FOUND = {
    "good": {"decides": False, "fragile_rate": 0.001, "fragile_episodes_rate": 0.06},
    "poor": {"decides": True, "fragile_rate": 0.5, "fragile_episodes_rate": 0.0},
    "seed_7": {"decides": False, "fragile_rate": 0.0, "fragile_episodes_rate": 0.0},
    "seed_8": {"decides": True, "fragile_rate": 0.0, "fragile_episodes_rate": 1.0},
}


@pytest.mark.parametrize(
    ("quick", "episodes", "count", "total"), [(True, 50, 1, 3), (False, 400, 2, 4)]
)
def test_policies_whose_verdict_depends_on_rounding_are_counted(
    monkeypatch, tmp_path, quick, episodes, count, total
):
    trained, sizes = [], set()

    def judge(policy, settings, progress):
        sizes.add(settings.episodes)
        evidence = {"rounding": FOUND[policy]}
        return SimpleNamespace(verdict=SimpleNamespace(evidence=evidence))

    monkeypatch.setattr(fragile_honest, "judge", judge)
    monkeypatch.setattr(fragile_honest, "policy_names", lambda: ["good", "poor"])
    monkeypatch.setattr(fragile_honest, "load_policy", lambda of: getattr(of, "name", of))
    monkeypatch.setattr(fragile_honest, "train", lambda run, seed: trained.append((run.name, seed)))
    done = fragile_honest.bench_fragile_honest(tmp_path, [7, 8], quick)
    assert done == {
        "fragile_honest": count,
        "fragile_honest_total": total,
        "fragile_frames_most": 0.5,
        "fragile_episodes_most": 0.06 if quick else 1.0,
    }
    assert trained == [("seed_7", "seed=7"), ("seed_8", "seed=8")][: total - 2]
    assert sizes == {episodes}
    assert BENCHMARKS["fragile_honest"].group == "adversarial"
