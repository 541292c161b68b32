import os
import subprocess
import sys
import warnings

from drone_rl.utils.imports import ignore_noise, noise_held_back, standard_error_closed


def test_nothing_gets_through_to_standard_error_until_it_is_open_again(capfd):
    with standard_error_closed():
        os.write(2, b"from below")
    os.write(2, b"again")
    assert capfd.readouterr().err == "again"


def test_what_no_user_can_do_anything_about():
    code = (
        "import logging, warnings; from drone_rl.utils.imports import ignore_noise\n"
        "logging.basicConfig(level='INFO', format='%(message)s'); ignore_noise()\n"
        "from absl import logging as absl\n"
        "warnings.simplefilter('always')  # as dm_control does\n"
        "warnings.warn('GLFWError: no X11'); warnings.warn('the DISPLAY is missing')\n"
        "absl.info('an OpenGL backend'); logging.info('ours'); absl.warning('a warning')\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stderr.splitlines() == ["ours", "a warning"]


def test_other_warnings_are_left(monkeypatch):
    seen = []
    monkeypatch.setattr(warnings, "showwarning", lambda message, *_: seen.append(message))
    ignore_noise()
    warnings.showwarning("about a tensor", UserWarning, "x", 1)
    warnings.showwarning("about GLFW", UserWarning, "x", 1)
    assert seen == ["about a tensor"]


def test_noise_is_held_back_for_a_while_alone(monkeypatch):
    seen = []
    monkeypatch.setattr(warnings, "showwarning", lambda message, *_: seen.append(message))
    with noise_held_back():
        warnings.showwarning("about GLFW", UserWarning, "x", 1)
    warnings.showwarning("about GLFW, later", UserWarning, "x", 1)
    assert seen == ["about GLFW, later"]
