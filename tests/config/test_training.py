from typing import ClassVar

import pytest

from drone_rl.config.training import Logger
from drone_rl.utils.errors import InputError


@pytest.mark.parametrize(
    "error", [ImportError("wandb could not be imported"), TypeError("no\nexp_name"), OSError()]
)
def test_errors_of_loggers_are_one_line(monkeypatch, error):
    class Broken(Logger):
        target: ClassVar[str] = "os.path.join"
        is_known: ClassVar[bool] = False

    del Logger.registry["broken"]

    def refuse(*args, **kwargs):
        raise error

    monkeypatch.setattr("os.path.join", refuse)
    text = " ".join(str(error).split()) or "OSError"
    with pytest.raises(InputError, match=rf"can't be made \({text}\)") as refused:
        Broken().make()
    assert "\n" not in str(refused.value)
