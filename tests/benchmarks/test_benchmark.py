import torch

from benchmarks.benchmark import Setup
from drone_rl.config.commands import BenchSettings


def setup(tmp_path, **changes):
    given = {"folder": tmp_path, "quick": False, "device": "cpu", "num_envs": 512}
    return Setup(**given | {"seeds": (0,), "episodes": 10, "memory_frames": 1000} | changes)


def test_a_quick_setup_has_smaller_batches(tmp_path):
    assert setup(tmp_path).batch_size == 512
    assert setup(tmp_path, quick=True).batch_size == 64


def test_a_gpu_uses_one_rendering_thread(tmp_path):
    assert setup(tmp_path, device="cuda:1").threads == 1
    assert setup(tmp_path).threads == torch.get_num_threads()


def test_runs_are_in_a_subfolder_of_the_results(tmp_path):
    assert setup(tmp_path).runs == tmp_path / "work"


def test_a_setup_copies_the_settings(tmp_path):
    settings = BenchSettings(seeds=(4, 5), quick=True, num_envs=7, episodes=8, memory_frames=9)
    setup = Setup.from_settings(settings, tmp_path)
    assert (setup.folder, setup.quick, setup.device) == (tmp_path, True, "cpu")
    assert (setup.seeds, setup.num_envs) == ((4, 5), 7)
    assert (setup.episodes, setup.memory_frames) == (8, 9)
