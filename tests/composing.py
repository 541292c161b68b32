"""Hydra's work that is the same for every command, done once: it takes half a second each time."""

import contextlib
import copy
from collections.abc import Iterator
from pathlib import Path

import pytest
from hydra._internal.core_plugins.file_config_source import FileConfigSource

from drone_rl.cli.hydra import composition
from drone_rl.config import TASKS


@contextlib.contextmanager
def composing_fast() -> Iterator[None]:
    """Keep parsed files of conf/ and registered schemas, as long as both are unchanged."""
    load, register = FileConfigSource.load_config, composition.register_schemas
    parsed, registered = {}, {}

    def load_once(self, config_path):
        file = Path(self.path, self._normalize_file_name(config_path))
        if not file.is_relative_to(composition.conf_dir()) or not file.is_file():
            return load(self, config_path)
        key = (self.provider, file, file.read_bytes())
        if key not in parsed:
            parsed[key] = load(self, config_path)
        return copy.deepcopy(parsed[key])

    def register_once(**commands):
        parts = [*composition.PARTS.values(), *composition.SEVERAL.values()]
        variants = [v for part in parts for v in part.variants()]
        known = [*TASKS.values(), *composition.GROUPS.values(), *variants]
        state = tuple((id(cls), cls.__qualname__) for cls in known)
        if state not in registered:
            registered.clear()
        done = registered.setdefault(state, {})
        if not commands.items() <= done.items():
            register(**commands)
            done.update(commands)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(FileConfigSource, "load_config", load_once)
        patch.setattr(composition, "register_schemas", register_once)
        yield
