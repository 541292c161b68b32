"""Hydra's work that is the same for every command, done once: it takes half a second each time."""

import contextlib
import copy
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from hydra.core.config_store import ConfigStore
from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.core.plugins import Plugins
from hydra.plugins.config_source import ConfigSource

from drone_rl.cli.hydra import composition
from drone_rl.config import TASKS


@contextlib.contextmanager
def composing_fast() -> Iterator[None]:
    """Keep parsed files of conf/, parsed overrides and stored defaults while unchanged."""
    with pytest.MonkeyPatch.context() as patch:
        _keep_files(patch)
        _keep_overrides(patch)
        _keep_defaults(patch)
        yield


def _keep_files(patch: pytest.MonkeyPatch) -> None:
    sources: list[Any] = [*Plugins.instance().discover(ConfigSource)]
    source = next(source for source in sources if source.scheme() == "file")
    load, kept = source.load_config, {}

    def load_once(self, config_path):
        file = Path(self.path, self._normalize_file_name(config_path))
        if not file.is_relative_to(composition.conf_dir()) or not file.is_file():
            return load(self, config_path)
        key = (self.provider, file, file.read_bytes())
        if key not in kept:
            kept[key] = load(self, config_path)
        return copy.deepcopy(kept[key])

    patch.setattr(source, "load_config", load_once)


def _keep_overrides(patch: pytest.MonkeyPatch) -> None:
    parse, kept = OverridesParser.parse_rule, {}

    def parse_once(self, text, rule):
        if (text, rule) not in kept:
            kept[text, rule] = parse(self, text, rule)
        return copy.deepcopy(kept[text, rule])

    patch.setattr(OverridesParser, "parse_rule", parse_once)


def _keep_defaults(patch: pytest.MonkeyPatch) -> None:
    register, kept = composition.store_defaults, {}

    def register_once(commands):
        parts = [*composition.PARTS.values(), *composition.SEVERAL.values()]
        known = [*TASKS.values(), *(v for part in parts for v in part.registry.values())]
        state = tuple((id(cls), cls.__qualname__) for cls in known)
        if state not in kept:
            kept.clear()
        done = kept.setdefault(state, {})
        if not commands.items() <= done.items():
            register(commands)
            done.update(commands)

    patch.setattr(composition, "store_defaults", register_once)
    # Hydra copies the store for every command, but changes only copies of its nodes.
    patch.setattr(ConfigStore, "__deepcopy__", lambda store, memo: store, raising=False)
