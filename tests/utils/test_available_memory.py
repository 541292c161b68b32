import subprocess
import sys

import pytest

from drone_rl.utils import available_memory
from drone_rl.utils.available_memory import available_bytes, require_memory
from drone_rl.utils.errors import InputError


@pytest.mark.parametrize("files", [("memory.max", "memory.current"), ("limit", "usage")])
def test_a_container_limits_memory(files, tmp_path, monkeypatch):
    limit, used = (tmp_path / name for name in files)
    monkeypatch.setattr(available_memory, "_LIMITS", [(limit, used)])
    limit.write_text("max\n")
    used.write_text("4000\n")
    assert available_bytes() != 1000
    limit.write_text("5000\n")
    assert available_bytes() == 1000
    (tmp_path / "memory.stat").write_text("anon 7\ninactive_file 300\nactive_file 200\n")
    assert available_bytes() == 1500
    (tmp_path / "memory.stat").unlink()
    require_memory(1000, "num_envs=2", "give fewer")
    with pytest.raises(InputError, match=r"^num_envs=2 needs at least .* available; give fewer$"):
        require_memory(1001, "num_envs=2", "give fewer")


def test_a_limit_of_the_address_space_counts():
    code = (
        "import resource; from drone_rl.utils.available_memory import available_bytes\n"
        "resource.setrlimit(resource.RLIMIT_AS, (2**30, resource.RLIM_INFINITY))\n"
        "assert 0 < available_bytes() < 2**30"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_too_many_environments_are_refused():
    from drone_rl.envs import DroneEnv

    with pytest.raises(InputError, match=r"^num_envs=1000000000 needs at least"):
        DroneEnv(10**9, pixels=False)
