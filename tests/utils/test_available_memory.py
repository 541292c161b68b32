import pytest

from drone_rl.utils import available_memory
from drone_rl.utils.available_memory import available_bytes, require_memory
from drone_rl.utils.errors import InputError


def test_a_container_limits_memory(tmp_path, monkeypatch):
    limit, used = tmp_path / "memory.max", tmp_path / "memory.current"
    monkeypatch.setattr(available_memory, "_CONTAINER", tmp_path)
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


def test_too_many_environments_are_refused():
    from drone_rl.envs import DroneEnv

    with pytest.raises(InputError, match=r"^num_envs=1000000000 needs at least"):
        DroneEnv(10**9, pixels=False)
