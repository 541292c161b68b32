import subprocess
import sys

import pytest
import torch

from drone_rl.sim.rendering.devices import check_device
from drone_rl.utils.errors import InputError


def test_an_unknown_device_is_refused():
    with pytest.raises(InputError, match="device=tpu is unknown; give cpu, cuda or cuda:N"):
        check_device("tpu")


@pytest.mark.skipif(torch.cuda.is_available(), reason="there is a GPU")
def test_cuda_without_gpu_is_refused():
    with pytest.raises(InputError, match="give device=cpu"):
        check_device("cuda")


def test_warp_starts_without_a_word():
    code = "from drone_rl.sim.rendering.devices import start_warp; start_warp('cpu')"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert (done.stdout, done.stderr) == ("", "")
