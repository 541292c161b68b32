"""A run resumes with the settings that it began with."""

import pytest

from drone_rl.config.configuration import check_same_config
from drone_rl.utils.errors import InputError


def test_changed_config_is_named_with_both_values():
    saved = {"seed": 0, "optimizer": {"lr": 0.1}, "trainer": {"total_frames": 10}}
    check_same_config(saved, {**saved, "trainer": {"total_frames": 99}}, ["trainer.total_frames"])
    with pytest.raises(InputError, match=r"optimizer.lr=0.2: .* optimizer.lr=0.1"):
        check_same_config(saved, {**saved, "optimizer": {"lr": 0.2}}, ["trainer.total_frames"])
    with pytest.raises(InputError, match="extra=1"):
        check_same_config(saved, {**saved, "extra": 1}, [])
