import torch

from drone_rl.bench.benchmark import Setup


def setup(tmp_path, **changes):
    given = {"folder": tmp_path, "quick": False, "device": "cpu", "num_envs": 512}
    return Setup(**given | {"seeds": (0,), "episodes": 10, "memory_frames": 1000} | changes)


def test_a_quick_one_takes_fewer_worlds(tmp_path):
    assert setup(tmp_path).worlds == 512
    assert setup(tmp_path, quick=True).worlds == 64


def test_a_gpu_draws_with_one_thread(tmp_path):
    assert setup(tmp_path, device="cuda:1").threads == 1
    assert setup(tmp_path).threads == torch.get_num_threads()


def test_runs_are_kept_beside_the_results(tmp_path):
    assert setup(tmp_path).runs == tmp_path / "runs"
