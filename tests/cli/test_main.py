"""Usage, help, and one line for each of the mistakes that any command can be given."""

import os
import sys

import pytest

import drone_rl as drone_rl_package
from drone_rl.cli.main import DEMO_USAGE, USAGE, main
from tests.cli.running import TINY, drone_rl, error_line


def test_usage_and_help(tmp_path):
    assert drone_rl("--help", cwd=tmp_path).stdout.strip() == USAGE.strip()
    help_text = drone_rl("train", "--help", cwd=tmp_path).stdout
    assert "task.num_cubes=3\n      Cubes placed in every episode." in help_text
    help_text = drone_rl("train", "--help", "all", cwd=tmp_path).stdout
    assert "optimizer: adam, sgd" in help_text
    assert "# Cubes placed in every episode." in help_text
    assert "num_cubes: 3" in help_text


@pytest.mark.parametrize(
    ("args", "printed"),
    [
        (["--version"], f"drone-rl {drone_rl_package.__version__}"),
        (["train", "--version"], f"drone-rl {drone_rl_package.__version__}"),
        (["-V"], f"drone-rl {drone_rl_package.__version__}"),
        (["help"], USAGE),
        (["help", "demo"], DEMO_USAGE),
        (["demo", "--help"], DEMO_USAGE),
        (["demo", "seed=1", "-h"], DEMO_USAGE),
    ],
)
def test_what_is_printed_without_running_anything(monkeypatch, capsys, tmp_path, args, printed):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["drone-rl", *args])
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == 0
    assert capsys.readouterr().out.strip() == printed.strip()
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("args", "words"),
    [
        (["trian"], ["trian", "train"]),
        (["train", "sed=1"], ["sed=1", "did you mean seed=1?", "--help all"]),
        (["train", "task.num_cubs=1"], ["num_cubs", "task.num_cubes=1"]),
        (["train", "task.num_cubes=three"], ["three"]),
        (["train", "trainer.total_frames=0"], ["total_frames=0 trains nothing", "1 or more"]),
        (["train", "task.spacing=-9"], ["spacing=-9", "from 0.001"]),
        (["train", "policy=resnet"], ["network=resnet", "small_cnn"]),
        (["train", "returns.gamma=high"], ["gamma=high", "a number", "gamma=0.95"]),
        (["evaluate", "episodes=many"], ["episodes=many", "a whole number", "episodes=1000"]),
        (
            ["train", *(f"transforms.resize.{side}=2" for side in ("height", "width"))],
            ["2x2", "too small"],
        ),
        (["train", "seed=-1"], ["seed=-1", "0 or more"]),
        (["train", "optimizer.lr=1e38"], ["optimizer.lr=1e+38", "up to 1e+30"]),
        (["train", "resume=nowhere"], ["nowhere", "folder of a run"]),
        (["train", "hydra.run.dir=/dev/null/x"], ["/dev/null"]),
        (["evaluate"], ["policy=latest", "drone-rl train"]),
        (["evaluate", "checkpoint=no.pt"], ["no.pt", "does not exist"]),
        (["train", "-m", "no_such=1,2"], ["no_such=1,2", "--help all"]),
        (["train", "-m", "seed=0,1", "hydra.launcher.num_jobs=0"], ["num_jobs=0", "at least 1"]),
        (["train", "-m", "seed=0,1", "hydra/launcher=pbs"], ["pbs", "slurm"]),
        (["train", "-m", "seed=interval(0,1)"], ["interval(0,1)", "hydra/sweeper=optuna"]),
        (["sweep-report"], ["folder=latest", "drone-rl train -m"]),
        (["sweep-report", "no/such"], ["no/such", "sweep.json"]),
        (["bench", "speed"], ["speed", "render"]),
        (["train", "task=base_task"], ["base_task", "collect_cubes, collect_one, pillars"]),
        (["train", "sweep=nope"], ["sweep=nope", "learning_rate"]),
        (["train", "task=nope"], ["task=nope", "one of: collect_cubes, collect_one, pillars"]),
        (["train", "-m", "task=collect_one,base_task"], ["base_task", "collect_one"]),
        (["seed=3", "evaluate"], ["drone-rl evaluate seed=3"]),
        (["train", "--num-envs", "8"], ["--num-envs 8", "collector.num_envs=8"]),
        (["train", "--wandb"], ["logger"]),
        (["verdict", "good"], ["type policy=good"]),
        (["train", "seed", "=", "1"], ["no spaces", "seed=1"]),
        (["train", "ent_coef=0.01"], ["objective.entropy_coeff=0.01"]),
        (["train", "+seed=1"], ["seed exists already"]),
        (["train", "hydra.run.dri=x"], ["hydra.run.dir=x"]),
        (["train", "optimizer=adm"], ["optimizer=adam"]),
        (["verdict", "policy=god"], ["policy=god", "did you mean good?"]),
        (["verdict", "policy=good", "camera=large"], ["can't change camera"]),
        (["train", "trainer.total_frames=100k"], ["trainer.total_frames=100000"]),
        (["train", "network.hidden=128"], ["network.hidden=[128]"]),
        (["train", "seed=0,1,2"], ["drone-rl train -m seed=0,1,2"]),
        (["train", "network.hidden=[64,64"], ["no closing ]", "network.hidden=[64,64]"]),
        (["train", "plugins=[no_such_module]"], ["no_such_module", "PYTHONPATH"]),
    ],
)
def test_mistakes_get_one_line_with_the_value_and_the_remedy(in_process, args, words):
    line = error_line(in_process(*args))
    assert all(word in line for word in words), line


@pytest.mark.parametrize("args", [["--help"], ["export", "--help"], ["policies", "most=0"]])
def test_a_reader_that_leaves_is_no_error(tmp_path, args):
    """As in `drone-rl --help | head -1`; lines are written at once, as some are of long outputs."""
    reader, writer = os.pipe()
    os.close(reader)
    unbuffered = "import sys; sys.stdout.reconfigure(line_buffering=True)"
    done = drone_rl(*args, cwd=tmp_path, stdout=writer, setup=unbuffered)
    os.close(writer)
    assert (done.returncode, done.stderr) == (141, "")


def test_an_output_that_is_full_is_one_line(tmp_path):
    with open("/dev/full", "w") as full:
        done = drone_rl(cwd=tmp_path, stdout=full.fileno())
    assert done.returncode == 2
    assert done.stderr == "error: standard output can't be written (No space left on device)\n"


@pytest.mark.parametrize(
    ("limit", "file"), [(300, "config.yaml"), (3000, "full/.hydra/config.yaml")]
)
def test_a_full_disk_is_one_line_with_path_and_remedy(tmp_path, limit, file):
    """A limit on the sizes of files stands in for a full disk, of Hydra's files and of others."""
    limited = (
        "import resource, signal; signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
        f"resource.setrlimit(resource.RLIMIT_FSIZE, ({limit}, -1))\n"
    )
    settings = ["train", TINY[0], *TINY[2:], "logger=tensorboard", "hydra.run.dir=full"]
    done = drone_rl(*settings, cwd=tmp_path, setup=limited)
    line = error_line(done)
    assert len(done.stderr.splitlines()) == 1
    assert file in line and "File too large" in line and "free some space" in line


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda run: (run / ".lock").mkdir(), [".lock", "Is a directory", "move it away"]),
        (lambda run: (run / "train.log").mkdir(), ["train.log", "Is a directory"]),
    ],
)
def test_a_folder_where_a_file_should_be_is_one_line(tmp_path, make, words):
    (tmp_path / "run").mkdir()
    make(tmp_path / "run")
    done = drone_rl("train", *TINY, "hydra.run.dir=run", cwd=tmp_path)
    assert len(done.stderr.splitlines()) == 1
    assert all(word in error_line(done) for word in words), done.stderr


def test_a_setting_that_is_given_twice_is_pointed_out(in_process):
    done = in_process("train", "seed=1", "seed=2", "task.num_cubes=2", "--help")
    assert done.stderr == "warning: seed is given several times; seed=2 counts\n"
    assert in_process("train", "seed=1", "--help").stderr == ""


def test_a_demo_goes_on_with_the_policy_that_it_trained(monkeypatch):
    ran = []

    def note(name, command, overrides):
        ran.append((name, overrides))
        return 0

    monkeypatch.setattr("drone_rl.cli.hydra.composition.run_command", note)
    line = ["drone-rl", "demo", "seed=1", "paths.outputs=o", "hydra.run.dir=r"]
    monkeypatch.setattr(sys, "argv", line)
    with pytest.raises(SystemExit):
        main()
    same = ["paths.outputs=o", "policy=r"]
    assert ran == [("train", line[2:]), ("evaluate", same), ("explain", same)]


@pytest.mark.parametrize("name", ["stdout", "stderr"])
def test_a_stream_that_was_closed_before_the_start_is_no_error(monkeypatch, name):
    monkeypatch.setattr(sys, name, None)
    monkeypatch.setattr(sys, "argv", ["drone-rl", "--version"])
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == 0
    assert not getattr(sys, name).isatty()


def test_ctrl_c_before_a_command_begins_is_one_line(monkeypatch, capsys):
    def interrupted(args):
        raise KeyboardInterrupt

    monkeypatch.setattr("drone_rl.cli.main._main", interrupted)
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == 130
    assert capsys.readouterr().err == "error: interrupted\n"
