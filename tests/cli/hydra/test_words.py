"""Words that are no settings get an answer before Hydra reads the command line."""

import pytest

from drone_rl.cli.hydra.words import check_words, no_command, sweep_flag_first
from drone_rl.cli.main import COMMANDS
from drone_rl.utils.errors import InputError
from drone_rl.utils.settings import conf_dir

pytestmark = pytest.mark.usefixtures("registered")


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("train --seed 1", "^--seed 1: settings have no dashes; type seed=1$"),
        ("train --num-envs=8", "type collector.num_envs=8$"),
        ("train --cuda", "type device=cuda$"),
        ("train --algo", "type objective=VALUE$"),
        ("train --seed", "type seed=VALUE$"),
        ("train -m seed=0,1 resume=latest", "^resume= continues one run, .* repeat its command$"),
        ("train paths.outputs=", "^paths.outputs= has no value; type a folder, such as paths"),
        ("train hydra.run.dir=", "^hydra.run.dir= has no value; type a folder"),
        ("train --lr", "type optimizer.lr=VALUE$"),
        ("train --nope 1", "--nope 1: .* no such option"),
        ("train -s 1", "^-s 1: settings have no dashes; type seed=1$"),
        ("train -x 1", "-x 1: .* no such option"),
        ("verdict -p good", "^-p good: settings have no dashes; type policy=good$"),
        ("verdict --package good", "^--package good: .* type policy=good$"),
        ("verdict --package=good policy=good", "^--package=good: .* type policy=good$"),
        ("verdict --sampled", "type sampled=true$"),
        ("verdict good", "^good has no name before it; type policy=good$"),
        ("check x.json", "type certificate=x.json$"),
        ("check notes.txt", "type certificate=notes.txt$"),
        ("check good", "type policy=good$"),
        ("check a/last.pt", "type policy=a/last.pt$"),
        ("train ppo", "type objective=ppo$"),
        ("train seed 1", "^seed has no =; type seed=1$"),
        ("train seed device=cpu", "type seed=VALUE$"),
        ("train lr 1", "type optimizer.lr=1$"),
        ("train seed:1", "has a colon .* type seed=1$"),
        ("train seed = 1", "no spaces around =; type seed=1$"),
        ("train seed =1", "no spaces around =; type seed=1$"),
        ("train seed= 1", "no spaces around =; type seed=1$"),
        ("train device=cpu nothing", "^nothing has no =; settings are typed name=value"),
        ("train network.hidden=[64, 64]", "quotes: 'network.hidden=\\[64,64\\]'"),
        ("train network.hidden=[64", r"has no closing \]; type 'network.hidden=\[64\]'"),
        ("explain policy=[good poor]", r"quotes: 'policy=\[good,poor\]'$"),
        ("train device='cpu", "has no closing '; type \"device='cpu'\""),
    ],
)
def test_what_to_type(line, message):
    command, *words = line.split(" ")
    with pytest.raises(InputError, match=message):
        check_words(command, conf_dir(), words)


@pytest.mark.parametrize("line", ["-m a=1 b=2", "a=1 -m b=2", "a=1 b=2 -m"])
def test_the_flag_of_a_sweep_may_be_anywhere(line):
    assert sweep_flag_first(line.split()) == ["-m", "a=1", "b=2"]
    assert sweep_flag_first(line.replace("-m", "--multirun").split())[0] == "--multirun"


def test_settings_and_documented_options_are_accepted():
    words = ["-m", "seed=0,1", "--multirun", "-h", "--help", "~x", "+a.b=1", "a='b c'"]
    check_words("train", conf_dir(), [*words, "x=[1,2]", "y='[', ']'"])


@pytest.mark.parametrize(
    "option",
    [
        *("-c", "--cfg", "--resolve", "-p", "--package", "-r", "--run", "-sc", "-cp", "-cn", "-cd"),
        *("--config-path", "--config-name", "--config-dir", "--experimental-rerun", "-i", "--info"),
        *("--hydra-help", "--shell-completion"),
    ],
)
def test_all_other_options_of_hydra_are_refused(option):
    for words in ([option], [option, "job"], [f"{option}=job"]):
        with pytest.raises(InputError, match=f"^{option}.* typed? "):
            check_words("verdict", conf_dir(), words)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["trian"], "command 'trian' is unknown; did you mean drone-rl train?"),
        (["eval", "policy=x"], "did you mean drone-rl evaluate?"),
        (["qwertz"], "command 'qwertz' is unknown; use one of: train, "),
        (["-m", "train", "seed=0,1"], "type drone-rl train -m seed=0,1"),
        (["--seed=1", "train"], "the command comes first; type drone-rl train seed=1"),
        (["--policy", "good"], "first, then settings as name=value without dashes, as in drone-rl"),
        (["seed=1"], "seed=1: the command comes first; type drone-rl train seed=1"),
    ],
)
def test_no_command(words, message):
    assert message in no_command(words[0], words[1:], [*COMMANDS])


def test_a_folder_of_a_proof_is_meant_as_its_certificate(tmp_path):
    with pytest.raises(InputError, match="type policy="):
        check_words("check", conf_dir(), [f"{tmp_path}"])
    (tmp_path / "certificate.json").touch()
    with pytest.raises(InputError, match=f"type certificate={tmp_path}$"):
        check_words("check", conf_dir(), [f"{tmp_path}"])
