"""Usage, help, and one line for each of the mistakes that any command can be given."""

import os
import sys

import pytest

import drone_rl as drone_rl_package
from drone_rl.cli.commands import COMMANDS, TABLE
from drone_rl.cli.main import DEMO_USAGE, USAGE, find_command, main
from drone_rl.cli.settings import CommandSettings
from tests.cli.running import TINY, drone_rl, error_line


def test_help(in_process):
    text = in_process("train", "--help", "all").stdout
    assert "optimizer=adam\n      One of: adam, sgd." in text
    assert "task.num_cubes=3  (cubes)\n      Cubes placed in every episode." in text


@pytest.mark.parametrize(
    ("args", "printed"),
    [
        (["--version"], f"drone-rl {drone_rl_package.__version__}"),
        (["-V"], f"drone-rl {drone_rl_package.__version__}"),
        (["help"], USAGE),
        (["help", "demo"], DEMO_USAGE),
        (["demo", "--help"], DEMO_USAGE),
    ],
)
def test_usage_and_version_write_no_files(monkeypatch, capsys, tmp_path, args, printed):
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
        (["train", "trainer.total_frames=0"], ["total_frames=0 trains nothing", "1 or more"]),
        (["train", *(f"transforms.resize.{s}=2" for s in ("height", "width"))], ["2x2", "small"]),
        (["train", "transforms=[]"], ["needs floats", "add a transform"]),
        (["train", "transforms={}"], ["transforms={}", "[] for none"]),
        (["train", "resume=nowhere"], ["nowhere", "folder of a run"]),
        (["train", "hydra.run.dir=/dev/null/x"], ["/dev/null"]),
        (["train", "seed=0,1,2"], ["seed=0,1,2", "--multirun"]),
        (["sweep-report"], ["folder=latest", "drone-rl train -m"]),
        (["bench", "speed"], ["speed", "render"]),
        (["evaluate"], ["policy=latest", "drone-rl train"]),
        (["evaluate", "policy=no.pt"], ["no.pt", "does not exist"]),
        (["verdict", "policy=good", "require=great"], ["require='great'", "'good' or 'proved'"]),
        (["export", "policy=good", "name=mine.onnx"], ["has an extension", "name=mine"]),
        (["report", "explanations=nowhere"], ["nowhere", "explanation.json"]),
        (["check", "certificate=none.json"], ["none.json can't be read"]),
    ],
)
def test_mistakes_get_one_line_with_the_value_and_the_remedy(in_process, args, words):
    line = error_line(in_process(*args))
    assert all(word in line for word in words), line


@pytest.mark.parametrize("command", COMMANDS)
def test_each_command_has_a_class_and_help(command):
    settings = find_command(command)
    assert issubclass(settings, CommandSettings) and settings().paths.outputs == "outputs"
    assert f"\n  {command} " in USAGE
    assert TABLE[command].keys() - {"next"} == {"module", "about", "examples"}


@pytest.mark.parametrize("args", [["--help"], ["policies", "most=0"]])
def test_a_closed_pipe_is_no_error(tmp_path, args):
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


def test_a_full_disk_is_one_line_with_the_remedy(tmp_path):
    """A limit on the sizes of files stands in for a full disk."""
    limited = (
        "import resource, signal; signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (3000, -1))\n"
    )
    settings = ["train", TINY[0], *TINY[2:], "logger=tensorboard", "hydra.run.dir=full"]
    done = drone_rl(*settings, cwd=tmp_path, setup=limited)
    line = error_line(done)
    assert len(done.stderr.splitlines()) == 1
    assert "File too large" in line and "free some space" in line


def test_a_demo_evaluates_the_policy_that_it_trained(monkeypatch):
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
def test_closed_streams_are_no_error(monkeypatch, name):
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
