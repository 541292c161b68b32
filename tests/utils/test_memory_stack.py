"""Calls at any depth of the stack need no new memory inside `with_one_stack_block`."""

import pytest

from drone_rl.utils.memory import with_one_stack_block

resource = pytest.importorskip("resource", reason="counts page faults, which Windows does not")
CALLS = 2000
DEPTHS = 150
"""More frames of `at_depth` than fit into one block of 16 KiB."""


def at_depth(depth, measure):
    return measure() if depth == 0 else at_depth(depth - 1, measure)


def faults_of_calls():
    """Page faults of many calls of a function that is empty."""

    def empty():
        pass

    before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    for _ in range(CALLS):
        empty()
    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before


def most_faults():
    """The most page faults at any depth."""
    return max(at_depth(depth, faults_of_calls) for depth in range(DEPTHS))


def test_no_loop_allocates_memory_in_each_call():
    assert with_one_stack_block(most_faults) < CALLS / 10


def test_result_and_error_of_the_function_are_passed_on():
    assert with_one_stack_block(lambda: 7) == 7
    with pytest.raises(ZeroDivisionError):
        with_one_stack_block(lambda: 1 / 0)
