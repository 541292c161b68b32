"""`torch._dynamo` is imported when a program compiles, and not before.

Programs run in processes of their own, as imports are permanent; this one has the compiler.
"""

import subprocess
import sys

LOADED = "hasattr(sys.modules.get('torch._dynamo'), '__file__')"
START = """import sys
from drone_rl.utils.unloaded_compiler import leave_compiler_unloaded
leave_compiler_unloaded()
"""
LEARN = """
import tensordict, torch
torch.manual_seed(0)
layer = torch.nn.Linear(3, 2)
adam = torch.optim.Adam(layer.parameters())
for _ in range(3):
    adam.zero_grad()
    layer(torch.ones(4, 3)).square().sum().backward()
    adam.step()
print(layer.weight.tolist(), len(sys.modules))
"""


def run(code):
    command = [sys.executable, "-W", "ignore", "-c", code]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stderr
    return result.stdout


def test_learning_needs_no_compiler_and_the_stand_in_is_still_needed():
    """Without the stand-in, the same program imports hundreds of modules of the compiler."""
    without, plain = run(f"{START}{LEARN}print({LOADED})"), run(f"import sys{LEARN}print({LOADED})")
    weights, modules, is_loaded = without.replace("]] ", "]]\n").splitlines()
    plain_weights, plain_modules, plain_is_loaded = plain.replace("]] ", "]]\n").splitlines()
    assert weights == plain_weights
    assert (is_loaded, plain_is_loaded) == ("False", "True")
    assert int(plain_modules) > int(modules) + 300


def test_a_program_that_compiles_gets_the_compiler_and_its_earlier_marks():
    code = f"""{START}
import torch, tensordict
@torch.compiler.disable
def plain(x):
    return x, torch.compiler.is_compiling()
assert plain(torch.ones(1))[1] is False
def outer(x):
    return plain(x)[1], torch.compiler.is_compiling()
assert not ({LOADED})
compiled = torch.compile(lambda x: 2 * x + 1, backend="eager")
assert compiled(torch.ones(2)).tolist() == [3.0, 3.0]
assert {LOADED}
print(torch.compile(outer, backend="eager")(torch.ones(1)))"""
    assert run(code) == "(False, True)\n"
