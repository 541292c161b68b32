"""Where metrics go, and what is said where a logger's package is missing."""

from typing import ClassVar

import pytest

from drone_rl.config.training import Logger
from drone_rl.utils.errors import InputError


def refuse(error):
    raise error


@pytest.mark.parametrize(
    ("error", "remedy"),
    [
        (ImportError("wandb could not be imported"), "(pip install wandb), or"),
        (ImportError("MLFlow is not installed"), "(pip install mlflow), or"),
        (ImportError("Ray is required for RayLogger. Install it"), "(pip install ray), or"),
        (ModuleNotFoundError("No module named 'a.b'", name="a.b"), "(pip install a), or"),
        (ImportError("broken"), "install the package that it needs, or"),
    ],
)
def test_a_missing_package_is_one_line_that_names_it(monkeypatch, error, remedy):
    class Broken(Logger):
        target: ClassVar[str] = "os.path.join"
        is_known: ClassVar[bool] = False

    monkeypatch.setattr("os.path.join", lambda *args, **kwargs: refuse(error))
    with pytest.raises(InputError, match=r"^logger _target_=os\.path\.join can't be made") as said:
        Broken().make()
    assert remedy in str(said.value) and "\n" not in str(said.value)


@pytest.mark.parametrize(
    "error", [TypeError("no\nexp_name"), RuntimeError("not logged in"), OSError()]
)
def test_any_error_of_a_loggers_package_is_one_line(monkeypatch, error):
    class Broken(Logger):
        target: ClassVar[str] = "os.path.join"
        is_known: ClassVar[bool] = False

    monkeypatch.setattr("os.path.join", lambda *args, **kwargs: refuse(error))
    text = " ".join(str(error).split()) or "OSError"
    with pytest.raises(InputError, match=rf"can't be made \({text}\); give its arguments") as said:
        Broken().make()
    assert "\n" not in str(said.value)
