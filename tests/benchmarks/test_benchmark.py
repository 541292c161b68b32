import torch

from benchmarks.benchmark import Setup
from drone_rl.config.commands import BenchSettings


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
    assert setup(tmp_path).runs == tmp_path / "work"


def test_a_setup_is_what_the_settings_ask_for(tmp_path):
    told = BenchSettings(seeds=(4, 5), quick=True, num_envs=7, episodes=8, memory_frames=9)
    setup = Setup.of(told, tmp_path)
    assert (setup.folder, setup.quick, setup.device) == (tmp_path, True, "cpu")
    assert (setup.seeds, setup.num_envs) == ((4, 5), 7)
    assert (setup.episodes, setup.memory_frames) == (8, 9)
