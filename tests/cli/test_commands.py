"""The commands as a user runs them, and one line for each of the user's mistakes."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import torch

from drone_rl.cli.main import USAGE, main
from drone_rl.training import load_checkpoint

TINY = ["experiment=smoke", "logger=csv", "trainer.total_frames=400", "collector.num_envs=4"]


def drone_rl(*args, cwd, **kwargs):
    command = [sys.executable, "-m", "drone_rl.cli.main", *map(str, args)]
    return subprocess.run(
        command, cwd=cwd, capture_output=True, text=True, check=False, timeout=300, **kwargs
    )


@pytest.fixture
def in_process(monkeypatch, capsys, tmp_path):
    """Runs a command in this process, which saves the seconds that imports take."""
    # Hydra's logging set-up would close the streams that pytest captures
    monkeypatch.setattr("hydra.core.utils.configure_log", lambda *args: None)
    monkeypatch.setattr("hydra._internal.hydra.configure_log", lambda *args: None)

    def call(*args, cwd=tmp_path):
        monkeypatch.chdir(cwd)
        monkeypatch.setattr(sys, "argv", ["drone-rl", *map(str, args)])
        with pytest.raises(SystemExit) as stop:
            main()
        printed = capsys.readouterr()
        code = stop.value.code
        if isinstance(code, str):  # what Python prints for sys.exit("...")
            printed, code = printed._replace(err=printed.err + code), 1
        return subprocess.CompletedProcess(args, code, printed.out, printed.err)

    return call


def error_line(done):
    """The one line that a mistake is worth."""
    lines = [line for line in done.stderr.splitlines() if line.startswith("error: ")]
    assert done.returncode != 0, done.stdout
    assert "Traceback" not in done.stderr, done.stderr
    assert len(lines) == 1, done.stderr
    return lines[0]


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A finished training of a second."""
    folder = tmp_path_factory.mktemp("run")
    done = drone_rl("train", *TINY, "hydra.run.dir=run", cwd=folder)
    assert done.returncode == 0, done.stderr
    return folder / "run"


def test_training_leaves_everything_behind(run):
    result = json.loads((run / "result.json").read_text())
    assert result["reason"] == "frames"
    assert result["frames"] >= 400
    for name in ("checkpoints/last.pt", "checkpoints/best.pt", "metrics.csv", "run.yaml"):
        assert (run / name).stat().st_size > 0
    state = load_checkpoint(run / "checkpoints" / "last.pt")
    assert state["config"]["collector"]["num_envs"] == 4
    assert state["provenance"]["versions"]["torch"] == torch.__version__


def test_same_seed_gives_the_same_parameters_byte_for_byte(run, tmp_path):
    done = drone_rl("train", *TINY, "hydra.run.dir=again", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    first, again = (
        load_checkpoint(folder / "checkpoints" / "last.pt")["policy"]
        for folder in (run, tmp_path / "again")
    )
    assert all(first[k].numpy().tobytes() == again[k].numpy().tobytes() for k in first)


def test_killed_and_resumed_is_bit_for_bit_the_uninterrupted(tmp_path):
    settings = [*TINY, "trainer.total_frames=1500"]
    whole = drone_rl("train", *settings, "hydra.run.dir=whole", cwd=tmp_path)
    assert whole.returncode == 0, whole.stderr
    command = [sys.executable, "-m", "drone_rl.cli.main", "train", *settings, "hydra.run.dir=half"]
    process = subprocess.Popen(command, cwd=tmp_path, stderr=subprocess.DEVNULL)
    metrics = tmp_path / "half" / "metrics.csv"
    while not metrics.exists() or len(metrics.read_text().splitlines()) < 4:
        assert process.poll() is None
        time.sleep(0.02)
    process.send_signal(signal.SIGTERM)
    assert process.wait(60) == 128 + signal.SIGTERM
    done = drone_rl("train", "resume=half", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    one, two = (
        load_checkpoint(tmp_path / name / "checkpoints" / "last.pt") for name in ("whole", "half")
    )
    assert all(torch.equal(one["policy"][k], two["policy"][k]) for k in one["policy"])
    assert one["progress"]["running_reward"] == two["progress"]["running_reward"]
    rows = [metrics.read_text().splitlines() for metrics in tmp_path.glob("*/metrics.csv")]
    assert len(rows[0]) == len(rows[1])


def test_evaluate_writes_table_json_and_videos(run):
    args = ["evaluate", f"checkpoint={run}", "episodes=5", "videos=1", "hydra.run.dir=evaluation"]
    done = drone_rl(*args, cwd=run)
    assert done.returncode == 0, done.stderr
    assert "all cubes" in done.stdout
    assert "oracle" in done.stdout
    report = json.loads((run / "evaluation" / "evaluation.json").read_text())
    assert report["oracle"]["mean_cubes"] == 1.0
    assert report["greedy"]["episodes"] == report["sampled"]["episodes"] == 5
    assert {p.suffix for p in (run / "evaluation" / "videos").iterdir()} == {".mp4", ".gif"}


@pytest.mark.parametrize(
    ("module", "extra", "args"),
    [
        ("submitit", "slurm", ["-m", "seed=0,1", "hydra/launcher=slurm"]),
        ("ray", "ray", ["-m", "seed=0,1", "hydra/launcher=ray"]),
        ("ray", "ray", ["collector=ray", *TINY]),
        ("optuna", "optuna", ["-m", "seed=0,1", "hydra/sweeper=optuna"]),
    ],
)
def test_an_extra_that_is_not_installed(in_process, monkeypatch, module, extra, args):
    monkeypatch.setitem(sys.modules, module, None)
    assert f"pip install 'drone-rl[{extra}]'" in error_line(in_process("train", *args))


def test_usage_and_help(tmp_path):
    assert drone_rl("--help", cwd=tmp_path).stdout.strip() == USAGE.strip()
    help_text = drone_rl("train", "--help", cwd=tmp_path).stdout
    assert "optimiser: adam, sgd" in help_text
    assert "# Cubes placed in every episode." in help_text
    assert "num_cubes: 3" in help_text


@pytest.mark.parametrize(
    ("args", "words"),
    [
        (["trian"], ["trian", "train"]),
        (["train", "sed=1"], ["sed", "--help"]),
        (["train", "task.num_cubs=1"], ["num_cubs"]),
        (["train", "task.num_cubes=three"], ["three"]),
        (["train", "task.spacing=-9"], ["spacing=-9", "from 0.001"]),
        (["train", "policy=resnet"], ["network/resnet", "small_cnn"]),
        (["train", "returns.gamma=high"], ["gamma=high", "Float"]),
        (["evaluate", "episodes=many"], ["episodes=many", "Integer"]),
        (["explain", "frames=x"], ["frames=x", "Integer"]),
        (["train", "camera.height=2", "camera.width=2"], ["2x2", "too small"]),
        (["train", "seed=-1"], ["seed=-1", "0 or more"]),
        (["train", "optimiser.lr=0"], ["optimiser.lr=0.0", "above 0"]),
        (["train", "returns.gamma=2"], ["gamma=2", "0 to 1"]),
        (["train", "trainer.target_share=2.97"], ["target_share=2.97", "up to 1"]),
        (["train", "collector.num_envs=0"], ["num_envs=0", "1 or more"]),
        (["train", "resume=nowhere"], ["nowhere", "folder of a run"]),
        (["train", "hydra.run.dir=/dev/null/x"], ["/dev/null"]),
        (["evaluate"], ["policy=latest", "drone-rl train"]),
        (["evaluate", "checkpoint=no.pt"], ["no.pt", "does not exist"]),
        (["train", "-m", "no_such=1,2"], ["no_such", "--help"]),
        (["train", "-m", "seed=0,1", "hydra.launcher.num_jobs=0"], ["num_jobs=0", "1 or more"]),
        (["train", "-m", "seed=0,1", "hydra/launcher=pbs"], ["pbs", "slurm"]),
        (["train", "-m", "seed=interval(0,1)"], ["INTERVAL", "hydra/sweeper=optuna"]),
        (["sweep-report"], ["folder=latest", "drone-rl train -m"]),
        (["sweep-report", "no/such"], ["no/such", "sweep.json"]),
        (["bench", "speed"], ["speed", "render"]),
    ],
)
def test_mistakes_get_one_line_with_the_value_and_the_remedy(in_process, args, words):
    line = error_line(in_process(*args))
    assert all(word in line for word in words), line


@pytest.mark.skipif(torch.cuda.is_available(), reason="there is a GPU")
def test_cuda_without_a_gpu(in_process):
    assert "give device=cpu" in error_line(in_process("train", "device=cuda"))


def test_resume_with_a_changed_setting(run, in_process):
    before = (run / "checkpoints" / "last.pt").read_bytes()
    line = error_line(in_process("train", f"resume={run}", "optimiser.lr=0.5", cwd=run))
    assert "optimiser.lr=0.5" in line
    assert "optimiser.lr=0.002" in line
    assert (run / "checkpoints" / "last.pt").read_bytes() == before


def test_checkpoint_of_another_architecture_truncated_or_with_code(run, in_process, tmp_path):
    state = torch.load(run / "checkpoints" / "last.pt", weights_only=True)
    state["description"]["network"]["hidden"] = [7]
    torch.save(state, tmp_path / "other.pt")
    line = error_line(in_process("evaluate", "checkpoint=other.pt", cwd=tmp_path))
    assert "fc1" in line
    data = (run / "checkpoints" / "last.pt").read_bytes()
    (tmp_path / "short.pt").write_bytes(data[: len(data) // 2])
    line = error_line(in_process("evaluate", "checkpoint=short.pt", cwd=tmp_path))
    assert "damaged" in line
    torch.save({"format": "drone_rl checkpoint", "x": Path("/")}, tmp_path / "code.pt")
    line = error_line(in_process("evaluate", "checkpoint=code.pt", cwd=tmp_path))
    assert "could run code" in line


def test_nan_names_itself_and_the_last_good_checkpoint(in_process, tmp_path):
    sgd = ["optimiser=sgd", "optimiser.lr=1e38", "trainer.total_frames=4000"]
    line = error_line(in_process("train", *TINY, *sgd, "hydra.run.dir=nan"))
    assert "NaN or infinite" in line
    assert "nan/checkpoints/last.pt" in line
    state = load_checkpoint(tmp_path / "nan" / "checkpoints" / "last.pt")
    assert all(v.isfinite().all() for v in state["policy"].values())


@pytest.mark.skipif("DISPLAY" in os.environ, reason="there is a display")
def test_viewer_without_a_display(run, in_process):
    line = error_line(in_process("play", f"checkpoint={run}", "viewer=true", cwd=run))
    assert "needs a display" in line


def test_play_films(run):
    args = ["play", f"checkpoint={run}", "episodes=1", "greedy=false", "hydra.run.dir=films"]
    done = drone_rl(*args, cwd=run)
    assert done.returncode == 0, done.stderr
    assert {p.name for p in (run / "films").glob("episode_0.*")} == {
        "episode_0.mp4",
        "episode_0.gif",
    }


def test_unknown_setting_of_the_evaluated_task(run, in_process):
    line = error_line(in_process("evaluate", f"checkpoint={run}", "task.num_cubs=5", cwd=run))
    assert "num_cubs" in line
    line = error_line(in_process("evaluate", f"checkpoint={run}", "task.num_cubes=0", cwd=run))
    assert "num_cubes=0" in line


def test_full_disk_while_saving_keeps_the_previous_checkpoint(run, tmp_path):
    """A file-size limit stands in for a full disk: writing a checkpoint fails half-way."""
    code = (
        "import resource, sys, signal; signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
        "from drone_rl.training import checkpoint as c\n"
        "save = c.save_checkpoint; n = [0]\n"
        "from drone_rl.training import callbacks\n"
        "def limited(path, state):\n"
        "    n[0] += 1\n"
        "    if n[0] > 2: resource.setrlimit(resource.RLIMIT_FSIZE, (4096, -1))\n"
        "    save(path, state)\n"
        "callbacks.save_checkpoint = limited\n"
        "from drone_rl.cli.main import main; main()\n"
    )
    settings = ["train", *TINY, "hydra.run.dir=full", "trainer.checkpoint_interval_s=0"]
    command = [sys.executable, "-c", code, *settings]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert "previous checkpoint is intact" in error_line(done)
    folder = tmp_path / "full" / "checkpoints"
    assert sorted(p.name for p in folder.iterdir()) == ["best.pt", "last.pt"]
    assert load_checkpoint(folder / "last.pt")["progress"]["updates"] == 0
    assert os.path.getsize(folder / "last.pt") > 4096
