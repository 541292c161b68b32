"""What is wrong on a command line, and what to type instead."""

import shlex

import pytest
from hydra.errors import HydraException

from drone_rl.cli.hydra.mistakes import check_words, explain, no_command
from drone_rl.cli.main import COMMANDS
from drone_rl.utils.errors import InputError
from drone_rl.utils.settings import conf_dir

pytestmark = pytest.mark.usefixtures("registered")


def message(line):
    """The error about a command line that Hydra, or the check before it, rejects."""
    name, *words = line if isinstance(line, list) else line.split(" ")
    try:
        check_words(name, conf_dir(), words)
    except InputError as error:
        return str(error)
    return str(explain(HydraException("Hydra's words"), name, conf_dir(), words))


@pytest.mark.parametrize(
    ("line", "suggestion"),
    [
        # other spellings of name=value
        ("train --seed 1", "seed=1"),
        ("train --cuda", "device=cuda"),
        ("verdict --sampled", "sampled=true"),
        ("train seed = 1", "seed=1"),
        ("train seed= 1", "seed=1"),
        ("train seed 1", "seed=1"),
        ("train seed:1", "seed=1"),
        ("train seed==1", "seed=1"),
        ("train trainer=total_frames=9", "trainer.total_frames=9"),
        ("train network.hidden=[64, 64]", "'network.hidden=[64,64]'"),
        ("explain policy=[good poor]", "'policy=[good,poor]'"),
        ("train network.hidden=[64", "'network.hidden=[64]'"),
        ("train resume=a=b", "\"resume='a=b'\""),
        # names that are missing
        ("verdict good", "policy=good"),
        ("check x.json", "certificate=x.json"),
        ("train ppo", "objective=ppo"),
        # other names
        ("train sed=1", "seed=1"),
        ("train task.num=1", "task.num_cubes=1"),
        ("train task.max_steps=9", "task.step_limit=9"),
        ("train max_iterations=10", "trainer.total_frames=VALUE"),
        ("train hydra.run.dri=x", "hydra.run.dir=x"),
        ("train policy=mlp", "network=mlp"),
        ("train policy=runs/a", "resume=runs/a"),
        ("train +seed=1", "seed=1"),
        # settings of another choice
        ("train objective.epochs=3", "objective=ppo objective.epochs=3"),
        ("train num_steps=8", "objective=a2c objective.num_steps=8"),
        # values
        ("train optimizer=adm", "optimizer=adam"),
        ("train trainer.total_frames=2.5k", "trainer.total_frames=2500"),
        ("train trainer.total_frames=9.0", "trainer.total_frames=9"),
        ("train trainer.max_grad_norm=None", "trainer.max_grad_norm=null"),
        ("train network.hidden=64", "'network.hidden=[64]'"),
        ("train network.hidden=(1,2)", "'network.hidden=[1,2]'"),
        ("train optimizer.lr=0,001", "optimizer.lr=0.001"),
        ("train seed=1,000", "seed=1000"),
        # several values
        ("train network.hidden=1,2", "'network.hidden=[1,2]'"),
        ("explain policy=good,poor", "'policy=[good,poor]'"),
        ("verdict policy=good,poor", "drone-rl verdict -m policy=good,poor"),
        ("train seed=0,1", "drone-rl train -m seed=0,1"),
        ("train task=pillars,collect_one", "drone-rl train -m task=pillars,collect_one"),
        ("train hydra/launcher=slurm", "drone-rl train -m hydra/launcher=slurm"),
    ],
)
def test_suggestion(line, suggestion):
    assert message(line).endswith(f"; type {suggestion}"), message(line)


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        ("train seed=x", "seed=x: it needs a whole number, such as seed=0"),
        ("train -m seed=0,x", "seed=0,x: it needs a whole number, such as seed=0"),
        ("train optimizer.lr=x", "it needs a number, such as optimizer.lr=0.001"),
        ("train collector.compiled=x", "true or false, such as collector.compiled=true"),
        ("train network.hidden=[a]", "it needs a list, such as network.hidden=[128]"),
        ("verdict task=pillars", "task is a group of settings, as in task.NAME=VALUE"),
        ("train task=base_task", "task is one of collect_cubes, collect_one, pillars"),
        ("verdict camera=large", "drone-rl verdict has no setting camera"),
        ("train ~x", "drone-rl train has no setting x"),
        ("train hydra.run.dir=", "it has no value"),
        ("train nothing", "settings are typed name=value, without dashes"),
        ("verdict --cfg=job", "settings are typed name=value, without dashes"),
        ("verdict --shell-completion", "settings are typed name=value, without dashes"),
        ("train device=cpu", "Hydra's words"),
        ("train hydra.searchpath=[file://my] seed=x", "Hydra's words"),
    ],
)
def test_reason_without_a_suggestion(line, reason):
    assert reason in message(line) and "; type" not in message(line)


def test_a_folder_with_a_certificate_is_meant_as_certificate(tmp_path):
    assert message(["check", f"{tmp_path}"]).endswith(f"type policy={tmp_path}")
    (tmp_path / "certificate.json").touch()
    assert message(["check", f"{tmp_path}"]).endswith(f"type certificate={tmp_path}")


def test_suggestions_are_quoted_for_a_shell():
    line = message(["train", "resume=a $b=c"])
    assert shlex.split(line.partition("; type ")[2]) == ["resume='a $b=c'"]


def test_correct_words_pass_the_check():
    words = ["-m", "seed=0,1", "--multirun", "-h", "--help", "~x", "+a.b=1", "a='b c'"]
    words += ["x=[1,2]", "y='[', ']'", "hydra/launcher=slurm", "task=choice(pillars,collect_one)"]
    check_words("train", conf_dir(), words)


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (["trian"], "command 'trian' is unknown; did you mean drone-rl train?"),
        (["eval", "policy=x"], "did you mean drone-rl evaluate?"),
        (["qwertz"], "command 'qwertz' is unknown; use one of: train, "),
        (["-m", "train", "seed=0,1"], "as in drone-rl train -m seed=0,1"),
        (["seed=1"], "seed=1: the command comes first, as in drone-rl train seed=1"),
    ],
)
def test_unknown_commands(words, text):
    assert text in no_command(words[0], words[1:], [*COMMANDS])
