"""All of them, in short form."""

import pytest

from drone_rl.bench.peers.contenders import LABELS
from drone_rl.bench.peers.side_by_side import bench_peers, train_theirs


@pytest.mark.slow
def test_all_of_them(tmp_path):
    pytest.importorskip("stable_baselines3", reason="Stable-Baselines3 is not installed")
    found = bench_peers(tmp_path / "runs" / "peers", [5], 3, quick=True)["peers"]
    assert [*found] == ["reinforce", "a2c", "ppo", "sb3_ppo", "sb3_a2c", "torchrl"] == [*LABELS]
    for measured in found.values():
        assert {len(values) for values in measured.values()} == {1}
        assert 0 < measured["seconds_without_imports"][0] < measured["seconds"][0]
        assert measured["is_solved"] == [False] and 0 <= measured["success_lower95"][0] < 1
        assert measured["frames"][0] > 0
    assert (tmp_path / "peers.png").stat().st_size > 10_000


def test_a_peer_that_fails_says_why():
    with pytest.raises(RuntimeError, match="no_such failed"):
        train_theirs("no_such", {}, seed=0, episodes=1, max_frames=1)
