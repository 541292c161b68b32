"""Command lines of a page, composed as the program would, but not run."""

import functools
import re
import shlex

from hydra import compose, initialize_config_dir
from hydra.core.global_hydra import GlobalHydra
from hydra.core.hydra_config import HydraConfig
from omegaconf import open_dict

from drone_rl.cli.hydra import composition
from drone_rl.cli.hydra.composition import adding, import_plugins, read_settings
from drone_rl.cli.main import COMMANDS, find_command
from drone_rl.utils.errors import InputError
from drone_rl.utils.settings import conf_dir

COMMAND = re.compile(r"^(?:[A-Z]+=\S+ )?drone-rl ([a-z-]+)(.*)$", re.MULTILINE)
_SWEPT = re.compile(r"=(?:range\((\d+)\)|(?:tag\(log,)?(?:interval\()?([^\[\]{},(]+),.*)$")


def check_commands(text):
    """Composes every command line of a text. Returns how many there are."""
    found = COMMAND.findall(text)
    for name, words in found:
        if name != "demo":
            check_command(name, *shlex.split(words, comments=True))
    return len(found)


@functools.cache
def check_command(name, *words):
    """Makes sure that a command knows all it is told; of a sweep's values the first."""
    assert name in COMMANDS, name
    command = find_command(name)
    told = [word for word in words if word not in ("-m", "--help") and "resume=" not in word]
    told = [re.sub(r"(=\[[^\]]*\]),\[.*", r"\1", word) for word in told]  # a sweep of lists
    told = [re.sub("[<>]", "", _SWEPT.sub(lambda m: f"={m[2] or 0}", word)) for word in told]
    file = name.replace("-", "_")
    told = command.prepare(told)
    if any(word.startswith("plugins=") for word in told):
        try:
            import_plugins(told)
        except InputError:
            return  # of a tutorial, whose own test has the module
    told = adding(told)  # after the plugins, whose tasks it knows
    composition.store_defaults({file: command})
    GlobalHydra.instance().clear()
    with initialize_config_dir(str(conf_dir()), version_base="1.3"):
        config = compose(file, told, return_hydra_config=True)
    with open_dict(config.hydra.runtime):
        config.hydra.runtime.output_dir = "folder of the run"  # which loggers refer to
    HydraConfig.instance().set_config(config)
    del config.hydra
    if "sweep" in config:
        del config.sweep
    try:
        read_settings(command, config)
    finally:
        HydraConfig.instance().cfg = None
