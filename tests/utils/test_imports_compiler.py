"""Most in a process of its own: what is imported once stays so. This one has the compiler."""

import subprocess
import sys

import torch._dynamo.eval_frame

from drone_rl.utils.imports import leave_compiler_unloaded

LOADED = "hasattr(sys.modules.get('torch._dynamo'), '__file__')"
START = """import sys
from drone_rl.utils.imports import leave_compiler_unloaded
leave_compiler_unloaded()
"""


def run(code):
    command = [sys.executable, "-W", "ignore", "-c", code]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_a_training_marking_and_inspection_do_without_it_and_the_same_is_learned(tmp_path):
    """Optimizers ask it to leave them alone, which they may be without."""
    learn = """
import torch
torch.manual_seed(0)
layer = torch.nn.Linear(3, 2)
adam = torch.optim.Adam(layer.parameters())
for _ in range(3):
    adam.zero_grad()
    layer(torch.ones(4, 3)).square().sum().backward()
    adam.step()
learned = layer.weight.tolist()
"""
    code = f"""{START}{learn}
print(learned, {LOADED})
import drone_rl
short = drone_rl.TrainerSettings(total_frames=1)
drone_rl.train(folder={str(tmp_path / "run")!r}, trainer=short)
print({LOADED})
import inspect
assert torch.compiler.assume_constant_result(lambda: 1)._dynamo_marked_constant
inspect.getmodule(torch.ones)
assert not ({LOADED}), "marking and inspection load it"
import torch._dynamo.config
print({LOADED}, torch._dynamo.config.verbose)"""
    lines = run(code).splitlines()
    with torch.random.fork_rng():
        exec(learn, here := {})
    assert (lines[0], lines[-2]) == (f"{here['learned']} False", "False")
    assert lines[-1] == "True False"  # a submodule can be imported


def test_whoever_compiles_gets_it_and_all_that_was_noted():
    """What was disabled before stays so."""
    code = f"""{START}
import torch, tensordict
@torch.compiler.disable
def plain(x):
    return x, torch.compiler.is_compiling()
assert plain(torch.ones(1))[1] is False
def outer(x):
    return plain(x)[1], torch.compiler.is_compiling()
assert not ({LOADED})
noted = sys.modules["torch._dynamo"]._allowed
assert noted
compiled = torch.compile(lambda x: 2 * x + 1, backend="eager")
assert compiled(torch.ones(2)).tolist() == [3.0, 3.0]
assert {LOADED}
from torch._dynamo import trace_rules
assert all(trace_rules.is_callable_allowed(f) for f in noted)
from torch._dynamo.eval_frame import OptimizedModule
print(torch.compile(outer, backend="eager")(torch.ones(1)))"""
    assert run(code) == "(False, True)\n"


def test_one_that_is_there_is_left_alone():
    there = sys.modules["torch._dynamo"]
    leave_compiler_unloaded()
    assert sys.modules["torch._dynamo"] is there and eval(LOADED)
