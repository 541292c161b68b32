"""An installed wheel works outside the checkout and contains its configuration."""

import subprocess
import sys
import zipfile
from pathlib import Path

ROOT = Path(__file__).parents[1]


def test_wheel_contains_the_configuration_and_runs_without_the_checkout(tmp_path):
    build = ["-m", "hatchling", "build", "-t", "wheel", "-d", str(tmp_path)]
    subprocess.run([sys.executable, *build], cwd=ROOT, check=True, capture_output=True)
    (wheel,) = tmp_path.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
        archive.extractall(tmp_path / "site")
    configs = {p.relative_to(ROOT / "conf") for p in (ROOT / "conf").rglob("*.yaml")}
    assert {f"drone_rl/conf/{path.as_posix()}" for path in configs} <= names
    assert {"drone_rl/py.typed", "hydra_plugins/drone_rl.py"} <= names
    assert "drone_rl/explanations/report/templates/report.html" in names
    page = {f"drone_rl/flight/fly_page/{n}" for n in ("index.html", "fly.js", "fly.css")}
    assert page <= names
    scenes = (ROOT / "drone_rl/sim/scenes/files").rglob("*.*")
    assert {path.relative_to(ROOT).as_posix() for path in scenes} <= names
    policies = ("good", "poor", "right_and_forward", "proved")
    assert {f"drone_rl/policies/zoo/{n}.safetensors" for n in policies} <= names
    assert "drone_rl/policies/zoo/proved.certificate.json" in names
    code = "import sys; sys.path.insert(0, 'site'); from drone_rl.cli.main import main; "
    code += "from drone_rl.utils.settings import conf_dir; "
    code += "import hydra_plugins.drone_rl as plugins; assert 'site/' in plugins.__file__; "
    code += "assert str(conf_dir()).endswith('site/drone_rl/conf'), conf_dir(); main()"
    command = [sys.executable, "-c", code, "train", "-m", "seed=range(0)"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 2, done.stderr
    assert "a sweep of no runs" in done.stderr  # by a sweeper of the wheel
