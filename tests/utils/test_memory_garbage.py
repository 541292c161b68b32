import gc
import subprocess
import sys

import pytest

from drone_rl.utils.memory import collecting_no_garbage


def test_the_collector_rests_and_goes_on():
    assert gc.isenabled()
    with collecting_no_garbage():
        assert not gc.isenabled()
        with collecting_no_garbage():
            assert not gc.isenabled()
        assert not gc.isenabled()
    assert gc.isenabled()


def test_it_goes_on_after_an_error():
    with pytest.raises(KeyError), collecting_no_garbage():
        raise KeyError
    assert gc.isenabled()


def test_it_keeps_nothing_from_being_collected_later():
    """In a process of its own: elsewhere frozen objects of earlier tests may be freed."""
    code = """import gc
from drone_rl.utils.memory import collecting_no_garbage
before = gc.get_freeze_count()
with collecting_no_garbage():
    pass
print(gc.get_freeze_count() == before)"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "True\n"


def test_a_program_looks_rarely_and_finds_what_there_is():
    code = """import gc, weakref
from drone_rl.utils.memory import look_for_garbage_rarely
class Loop: pass
looks = []
gc.callbacks.append(lambda phase, info: looks.append(phase))
look_for_garbage_rarely()
gc.collect(); looks.clear()
loop = Loop(); loop.itself = loop; gone = weakref.ref(loop); del loop
kept = [[] for _ in range(40_000)]
print(len(looks), gone() is None)
more = [[] for _ in range(20_000)]
print(len(looks) > 0, gone() is None)"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "0 False\nTrue True\n"


def test_after_the_first_look_it_looks_more_often():
    code = """import gc
from drone_rl.utils.memory import look_for_garbage_rarely
look_for_garbage_rarely()
print(gc.get_threshold()[0])
gc.collect()
print(gc.get_threshold()[0], len(gc.callbacks))"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "700000\n50000 0\n"


def test_what_came_with_the_imports_is_never_looked_through():
    code = """import gc, weakref
from drone_rl.utils.memory import look_for_garbage_rarely
class Loop: pass
look_for_garbage_rarely()
early = Loop(); early.itself = early; gone = weakref.ref(early); del early
before = gc.get_freeze_count()
gc.collect(0)
print(gc.get_freeze_count() > before + 1000, len(gc.get_objects()) < 100, gone() is None)
late = Loop(); late.itself = late; gone = weakref.ref(late); del late
gc.collect()
print(gone() is None)"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "True True False\nTrue\n"
