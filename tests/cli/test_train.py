"""`drone-rl train`: repeated, killed, resumed, refused."""

import json
import logging
import re
import shlex
import shutil
import signal
import sys

import pytest
import torch

from drone_rl.config import TaskSettings
from drone_rl.config.training import TrainSettings
from drone_rl.training import CsvCallback
from drone_rl.training.demonstrations import record_oracle
from drone_rl.utils.checkpoint import load_checkpoint
from drone_rl.utils.overrides import read_overrides
from tests.cli.running import TINY, error_line


def test_files_of_a_training(run):
    result = json.loads((run / "result.json").read_text())
    assert result["reason"] == "frames"
    assert result["frames"] >= 400
    for name in ("checkpoints/last.pt", "checkpoints/best.pt", "metrics.csv", "run.yaml"):
        assert (run / name).stat().st_size > 0
    state = load_checkpoint(run / "checkpoints" / "last.pt")
    assert state["config"]["collector"]["num_envs"] == 4
    assert state["provenance"]["versions"]["torch"] == torch.__version__


@pytest.mark.parametrize(
    ("module", "extra", "args"),
    [
        ("submitit", "slurm", ["-m", "seed=0,1", "hydra/launcher=slurm"]),
        ("ray", "ray", ["collector=ray", *TINY]),
        ("optuna", "optuna", ["-m", "seed=0,1", "hydra/sweeper=optuna"]),
    ],
)
def test_an_extra_that_is_not_installed(in_process, monkeypatch, module, extra, args):
    monkeypatch.setitem(sys.modules, module, None)
    assert f"pip install -e '.[{extra}]'" in error_line(in_process("train", *args))


@pytest.mark.skipif(torch.cuda.is_available(), reason="there is a GPU")
def test_cuda_without_a_gpu(in_process):
    assert "give device=cpu" in error_line(in_process("train", "device=cuda"))


def contents(folder):
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.parametrize(
    "wrong",
    [
        ["seed=9"],
        ["logger=tensorboard", "optimizer.lr=0.5"],
        ["trainer.total_frames=800", "hydra.run.dir=elsewhere"],
    ],
)
def test_a_refused_resume_changes_nothing(run, in_process, tmp_path, wrong):
    folder = shutil.copytree(run, tmp_path / "copy")
    before = contents(folder)
    error_line(in_process("train", f"resume={folder}", *wrong))
    assert contents(folder) == before


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_the_printed_command_resumes_a_stopped_run(run, in_process, tmp_path, number, caplog):
    """Bit for bit the uninterrupted run; tests/cli/test_sweeps.py kills a process."""
    caplog.set_level(logging.INFO)

    class Stop(CsvCallback):
        def on_update(self, training, metrics):
            super().on_update(training, metrics)
            if training.progress.updates == 2:
                signal.raise_signal(number)

    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    logs = ["logger=tensorboard", "logger.tensorboard.exp_name=my logs"]  # not out of a file
    own = [*(o for o in TINY if o != "logger=csv"), *logs, "paths.outputs=my runs"]
    try:
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("drone_rl.training.train.CsvCallback", Stop)
            stopped = in_process("train", *own)
    finally:
        signal.signal(signal.SIGINT, before)
    assert stopped.returncode == 128 + number, stopped.stderr
    (folder,) = (tmp_path / "my runs" / "train" / "runs").iterdir()
    hint = re.search("resume with: drone-rl (.*)", caplog.text)
    assert hint, caplog.text
    (tmp_path / "elsewhere").mkdir()
    done = in_process(*shlex.split(hint[1]), cwd=tmp_path / "elsewhere")
    assert done.returncode == 0, done.stderr
    result = json.loads((folder / "result.json").read_text())
    assert result["reason"] == "frames"
    assert not list((tmp_path / "elsewhere").iterdir())
    one, two = (load_checkpoint(path / "checkpoints" / "last.pt") for path in (run, folder))
    assert all(torch.equal(one["policy"][k], two["policy"][k]) for k in one["policy"])
    assert one["progress"]["running_reward"] == two["progress"]["running_reward"]


def test_nan_names_the_last_good_checkpoint(in_process, tmp_path):
    sgd = ["optimizer=sgd", "optimizer.lr=1e30", "trainer.total_frames=4000"]
    line = error_line(in_process("train", *TINY, *sgd, "hydra.run.dir=nan"))
    assert "NaN or infinite" in line
    assert "nan/checkpoints/last.pt" in line
    state = load_checkpoint(tmp_path / "nan" / "checkpoints" / "last.pt")
    assert all(v.isfinite().all() for v in state["policy"].values())


def test_demonstrations_are_cloned_and_the_run_continues(in_process, tmp_path):
    """The folder of the demonstrations is neither read nor needed to resume."""
    task = TaskSettings(num_cubes=1, first_distance=8.0)
    record_oracle(tmp_path / "flights", TrainSettings(task=task), flights=2)
    own = ["task.num_cubes=1", "task.first_distance=8", "cloning.epochs=2", "collector.num_envs=4"]
    words = ["experiment=imitation", "demonstrations=flights", "logger=csv", *own]
    assert (
        in_process("train", *words, "trainer.total_frames=0", "hydra.run.dir=run").returncode == 0
    )
    first = json.loads((tmp_path / "run" / "result.json").read_text())
    assert (first["frames"], first["cloning"]["demonstrations"]) == (0, 1)
    shutil.rmtree(tmp_path / "flights")
    done = in_process("train", "resume=run", "trainer.total_frames=200")
    assert done.returncode == 0, done.stderr
    result = json.loads((tmp_path / "run" / "result.json").read_text())
    assert result["frames"] >= 200 and result["cloning"] == first["cloning"]
    line = error_line(in_process("train", *words))
    assert line.startswith("error: demonstrations=flights can't be read (No such file")
    line = error_line(in_process("train", "experiment=imitation", "logger=csv"))
    assert line.startswith("error: demonstrations=outputs/demonstrations can't be read")


def test_provable_training_in_rounds(in_process, tmp_path):
    rounds = ["provable.rounds=1", "provable.frames=100", "provable.flights=8"]
    done = in_process("train", *TINY, *rounds, "hydra.run.dir=run")
    assert done.returncode == 0, done.stderr
    noted = json.loads((tmp_path / "run" / "provable.json").read_text())
    assert noted["how"]["frames"] == 100 and len(noted["rounds"]) == 1  # the frames are spent


@pytest.mark.parametrize("command", ["train", "evaluate"])
def test_a_run_keeps_its_settings_when_another_command_names_its_folder(
    run, in_process, tmp_path, command
):
    folder = shutil.copytree(run, tmp_path / "copy")
    before = read_overrides(folder)
    words = {"train": [*TINY, "seed=9"]}.get(
        command, [f"policy={folder}", "episodes=2", "baselines=false", "videos=0"]
    )
    done = in_process(command, *words, f"hydra.run.dir={folder}")
    assert (done.returncode == 0) == (command == "evaluate"), done.stderr
    assert read_overrides(folder) == before


def test_a_finished_run_is_resumed_from_wherever_its_folder_is(run, in_process, tmp_path, caplog):
    folder = shutil.copytree(run, tmp_path / "another place")
    caplog.set_level("INFO")
    assert in_process("train", f"resume={folder}").returncode == 0
    assert "already finished (frames, " in caplog.text
    assert "give a larger trainer.total_frames" in caplog.text
    caplog.clear()
    assert in_process("train", f"resume={folder}", "trainer.total_frames=600").returncode == 0
    assert "already finished" not in caplog.text
    assert load_checkpoint(folder / "checkpoints" / "last.pt")["progress"]["frames"] >= 600
