"""What is wrong on a command line, and what to type instead."""

import pytest
from hydra.errors import HydraException

from drone_rl.cli.hydra.mistakes import check_words, explain, no_command
from drone_rl.cli.main import COMMANDS
from drone_rl.utils.errors import InputError
from tests.cli.running import error_line

pytestmark = pytest.mark.usefixtures("registered")


def message(line):
    """The error about a command line that Hydra, or the check before it, rejects."""
    name, *words = line if isinstance(line, list) else line.split(" ")
    try:
        check_words(name, words)
    except InputError as error:
        return str(error)
    return str(explain(HydraException("Hydra's words"), name, words))


@pytest.mark.parametrize(
    ("line", "remedy"),
    [
        ("train --seed 1", "without dashes; did you mean seed?"),
        ("train --cuda", "did you mean device=cuda?"),
        ("train nothing", "nothing: settings are typed name=value"),
        ("train sed=1", "has no setting sed; did you mean seed?"),
        ("train task.max_steps=9", "did you mean task.step_limit?"),
        (
            "train -m hydra.sweeper.metric=success seed=1,2",
            "add hydra/sweeper=optuna, which has it",
        ),
        ("train policy=mlp", "did you mean network?"),
        ("verdict camera=large", "drone-rl verdict --help all lists the settings"),
        ("train objective.epochs=3", "objective=ppo has it"),
        (
            "train task=cubes",
            "task is one of collect_cubes, collect_one, pillars, reach, or your own",
        ),
        ("train optimizer=adm", "optimizer is one of adam, sgd; did you mean adam?"),
        ("train hydra.run.dir=", "it has no value"),
        ("train hydra/launcher=slurm", "no effect on a single run; add -m"),
        ("train inputs=[gray,foo]", "inputs is one of altitude, attitude, depth, goal, gray"),
        ("train inputs=[gray,gray]", "it has gray twice; give the other one a name of its own"),
        ("train inputs=[gray,goal] inputs.gray.stak=2", "did you mean inputs.gray.stack?"),
        (
            "train +inputs@inputs.down=depth inputs.down.camera=down inputs.dwn.stack=2",
            "inputs.dwn.stack; did you mean inputs.down.stack?",
        ),
        ("train device=cpu", "Hydra's words"),
        ("train hydra.searchpath=[file://my] sed=x", "Hydra's words"),
    ],
)
def test_a_mistake_has_a_remedy(line, remedy):
    assert remedy in message(line)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["inputs=[]"], "inputs: the policy would see nothing; give inputs"),
        (["inputs=[gray,velocity]"], "drones that move at once have no velocity"),
        (["inputs=[gray,goal]", "network=lstm"], "network=lstm takes pixels alone"),
    ],
)
def test_inputs_that_there_are_not_are_one_line(in_process, words, message):
    assert error_line(in_process("train", *words)).startswith(f"error: {message}")


def test_correct_words_pass_the_check():
    words = ["-m", "seed=0,1", "--multirun", "-h", "--help", "~x", "+a.b=1", "a='b c'"]
    words += ["inputs=[gray,goal],[gray]", "+inputs@inputs.down=depth", "x=[1,2]"]
    words += ["y='[', ']'", "hydra/launcher=slurm", "task=choice(pillars,collect_one)"]
    check_words("train", words)


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
