import threading

import pytest
import torch

from drone_rl.utils.threads import pool_like_caller, torch_threads


def in_new_thread():
    counts = []
    thread = threading.Thread(target=lambda: counts.append(torch.get_num_threads()))
    thread.start()
    thread.join()
    return counts[0]


@pytest.mark.parametrize("error", [None, ZeroDivisionError])
def test_only_the_block_has_other_threads(error):
    before, of_new = torch.get_num_threads(), in_new_thread()
    try:
        with torch_threads(before + 2):
            assert torch.get_num_threads() == before + 2
            assert in_new_thread() == of_new
            with pool_like_caller(1) as pool:
                assert pool.submit(torch.get_num_threads).result() == before + 2
            if error:
                raise error
    except ZeroDivisionError:
        pass
    assert (torch.get_num_threads(), in_new_thread()) == (before, of_new)
