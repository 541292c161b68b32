"""Settings that Hydra and OmegaConf reject, choices that do not exist, files of the user."""

import re

import pytest
import yaml
from hydra.errors import HydraException

from drone_rl.cli.hydra.mistakes import (
    check_choices,
    check_launcher,
    explain,
    explain_file,
    repeated,
)
from drone_rl.cli.hydra.names import composed
from drone_rl.utils.errors import InputError
from drone_rl.utils.settings import conf_dir

pytestmark = pytest.mark.usefixtures("registered")


def said(*overrides, command="train"):
    return str(explain(HydraException("Hydra's words"), command, conf_dir(), overrides))


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("seed=x", "seed=x does not fit; type a whole number, such as seed=0"),
        ("trainer=total_frames=9", "has two equals signs; type trainer.total_frames=9$"),
        ("seed=1=2", "seed=1=2 is not a number; type seed=1$"),
        ("seed=1)", r"seed=1\) is not a number; type seed=1$"),
        ("task.max_steps=0", r"did you mean task\.step_limit=0\?"),
        ("epochs=10", r"did you mean trainer\.total_frames=VALUE\?"),
        ("seed=2..5", r"such as seed=0; for one run with each, type -m 'seed=range\(2,6\)'$"),
        ("seed=null", "seed=null does not fit; type another value, such as seed=0"),
        ("seed=none", "seed=none does not fit; type a whole number, such as seed=0"),
        ("trainer.total_episodes=none", "=none does not fit; type trainer.total_episodes=null$"),
        ("trainer.max_grad_norm=None", "=None does not fit; type trainer.max_grad_norm=null$"),
        (
            "optimizer.lr=x",
            "optimizer.lr=x does not fit; type a number, such as optimizer.lr=0.001",
        ),
        ("collector.compiled=x", "true or false, such as collector.compiled=true"),
        ("trainer.total_frames=2.5k", "such as trainer.total_frames=2500$"),
        ("trainer.total_frames=2M", "such as trainer.total_frames=2000000$"),
        ("trainer.total_frames=1.5g", "such as trainer.total_frames=1500000000$"),
        ("network.hidden=64", "network.hidden=64 has the wrong .* network.hidden=\\[64\\]"),
        ("network.hidden=[a]", "network.hidden=\\[a\\] has the wrong .* network.hidden=\\[128\\]"),
        ("network={a:1}", "network"),
        ("optimizer.lr=0,001", r"commas separate values; type optimizer.lr=0.001"),
        ("seed=0,001", "seed=0,001 gives several values"),
        ("seed=1,000", "commas separate values; type seed=1000"),
        ("seed=0,1", "for one run with each, type drone-rl train -m seed=0,1$"),
        ("network.hidden=1,2", "for a list, type network.hidden=\\[1,2\\]; "),
        ("task=pillars,collect_one", "train -m task=pillars,collect_one$"),
        ("seed=range(3)", "type drone-rl train -m 'seed=range"),
        ("seed=interval(0,1)", "add -m hydra/sweeper=optuna"),
        ("optimizer=[adam,sgd]", "optimizer is one choice; type optimizer=adam"),
        ("+seed=1", "seed exists already; type seed=1"),
        ("~x", "~x: drone-rl train has no setting x"),
        ("seed==1", "two equals signs; type seed=1"),
        ("seed=1 device=cpu", "holds two settings"),
        ("seed.=1", "'seed.' is not a valid name; type seed=1"),
        ("network.hidden=(1,2)", "square brackets; type network.hidden=\\[1,2\\]"),
        ("appearance.sun=1", "one of appearance.sun_elevation, .*, appearance.sun_color\\?"),
        ("transforms.stack.N=4", "needs transforms=stack; type transforms=stack transforms.stack"),
        ("scheduler.gamma=0.5", "^scheduler.gamma=0.5 needs scheduler=step_decay; type scheduler"),
        ("objective.epochs=3", "needs objective=ppo; type objective=ppo objective.epochs=3$"),
        ("num_steps=8", "type objective=a2c objective.num_steps=8$"),
        ("objective.critic_coeff=1", "needs objective=a2c or objective=ppo; type objective=a2c"),
        ("task.density=1", "needs task=pillars; type task=pillars task.density=1$"),
        ("task.num=1", "did you mean task.num_cubes=1\\?"),
        ("network.width=3", r"did you mean camera.width=3\? \(network has: .*hidden"),
        ("dynamics.w=1", "did you mean dynamics.wind=1\\?"),
        ("appearance.suns=1", "did you mean appearance.sun_color=1"),
        ("resume=a=b", "need quotes; type \"resume='a=b'\""),
        ("device=cpu", "device=cpu: these settings can't be read; drone-rl train --help all"),
    ],
)
def test_what_is_wrong_and_what_to_type(override, message):
    found = said("objective=reinforce", override)
    assert re.search(message, found), found


@pytest.mark.parametrize("override", ["camera=large", "camera.width=9", "+camera=large"])
def test_groups_that_a_command_lacks_are_those_of_the_policy(override):
    assert "drone-rl verdict can't change camera" in said(override, command="verdict")


def test_suggested_choices_exist():
    assert "did you mean" not in said("config=foo.yaml")
    assert "did you mean experiment=smoke?" in said("config=smoke")


def test_lists_of_numbers_are_offered_with_the_number_that_was_given():
    assert "type a list such as dynamics.wind=[5,0.0,0.0]" in said("dynamics.wind=5")


@pytest.mark.parametrize("word", ["hydra/launcher=slurm", "hydra/sweeper=optuna"])
def test_what_a_single_run_ignores_is_refused(word):
    with pytest.raises(
        InputError, match=rf"{word} has no effect .*; type drone-rl train -m {word}"
    ):
        check_launcher("train", ["seed=1", word])
    for others in (["-m"], ["sweep=seeds"], ["resume=latest"], ["hydra.mode=RUN"]):
        check_launcher("train", [*others, word])


def test_settings_that_are_given_twice():
    assert repeated(["seed=1", "policy=good", "+seed=2", "-m", "policy=poor", "x=1"]) == [
        "+seed=2",
        "policy=poor",
    ]


def test_a_group_without_a_choice_has_no_settings():
    found = said("appearance.sun_elevation=9", command="evaluate")
    assert "type appearance=minimal appearance.sun_elevation=9 (appearance is one of " in found


def test_lists_are_offered_where_they_are_accepted():
    assert "policy=[good,poor]" in said("policy=good,poor", command="explain")
    assert "[good,poor]" not in said("policy=good,poor", command="verdict")


def test_hydras_words_are_kept_if_the_user_has_files_of_settings():
    assert "Hydra's words" in said("seed=x", "hydra.searchpath=[file://my]")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "trainer:\n  target: 1",
            r"^experiment/mine\.yaml sets more .*; write # @package _global_ ",
        ),
        (
            "# @package _global_\ntrainer:\n  total_frame: 1",
            r"^experiment/mine\.yaml: .* no setting trainer\.total_frame; did you mean "
            r"trainer\.total_frames=VALUE\?",
        ),
        (
            "# @package _global_\ntrainer:\n  total_frames: 1e3",
            r"^experiment/mine\.yaml: trainer\.total_frames=1000\.0 does not fit; type a whole "
            r"number, such as trainer\.total_frames=1000$",
        ),
        ("trainer:\n\ttarget: 1", r"^line 2 of .*/mine\.yaml is no YAML .*; indent with spaces"),
        ("trainer: {target: 1", r"^line 1 of .*/mine\.yaml is no YAML .*; correct it$"),
    ],
)
def test_mistakes_in_a_file_of_the_user_name_the_file(tmp_path, text, message):
    (tmp_path / "experiment").mkdir()
    (tmp_path / "experiment" / "mine.yaml").write_text(text)
    with pytest.raises((HydraException, yaml.YAMLError)) as error:
        composed("train", conf_dir(), [f"hydra.searchpath=[file://{tmp_path}]", "experiment=mine"])
    assert re.search(message, str(explain_file(error.value, "train", conf_dir())))


def test_mistakes_elsewhere_are_not_those_of_a_file():
    error = HydraException("In 'train': Could not find 'network/x'")
    assert explain_file(error, "train", conf_dir()) is None


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("task=base_task", r"^task=base_task is unknown; .*: collect_cubes, collect_one, pillars$"),
        ("task=pillar", r"^task=pillar is unknown; did you mean task=pillars\? give one of: "),
        ("+task@task=base_pillars", "^task=base_pillars is unknown"),
        ("task=collect_one,base_task", "task=base_task"),
        ("task='pillarz'", "task=pillarz"),
        ("logger=[csv,aim]", "logger=aim is unknown; give one of: csv, mlflow, tensorboard, wandb"),
        ("sweep=nope", "sweep=nope is unknown; give one of: cubes, high_rate"),
        ("objective=sac", "^objective=sac is unknown; give one of: a2c, ppo, reinforce"),
        ("hydra/launcher=pbs", "hydra/launcher=pbs .*local, ray, slurm"),
        ("dynamics=null", "^dynamics=null: leave it out, or give one of: computer_vision, "),
    ],
)
def test_schemas_and_unknown_choices_are_refused(override, message):
    with pytest.raises(InputError, match=message):
        check_choices(["seed=1", override], conf_dir())


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("task=hurry", r"pillars; if a module of yours registers it, add plugins=\[MODULE\]$"),
        ("task=pillar", "collect_cubes, collect_one, pillars$"),  # rather a typing error
        ("sweep=nope", r"^sweep=nope is unknown; give one of: [\w, ]+$"),
    ],
)
def test_choices_of_a_users_module_need_it(override, message):
    with pytest.raises(InputError, match=message):
        check_choices([override], conf_dir(), ["task"])


def test_all_else_is_accepted():
    plain = ["task=pillars", "network=mlp,small_cnn", "sweep=seeds", "-m", "seed=1,2"]
    check_choices(
        [*plain, "resume=base_x", "task.name=base_x", "--help", "=x", "../x=base_y", "/tmp=x"],
        conf_dir(),
    )
    check_choices(["logger=[csv,tensorboard]", "task='pillars'", "task=choice(a,b)"], conf_dir())
    check_choices(["sweep=mine", "task=mine", "hydra.searchpath=[file://my]"], conf_dir())
