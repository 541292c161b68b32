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
print(layer.weight.tolist())
"""


def run(code):
    command = [sys.executable, "-W", "ignore", "-c", code]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stderr
    return result.stdout


def test_learning_needs_no_compiler_and_a_program_that_compiles_gets_it():
    """Also marks that were set before; without the stand-in, learning imports it."""
    code = f"""{START}{LEARN}
print({LOADED})
@torch.compiler.disable
def plain(x):
    return x, torch.compiler.is_compiling()
assert plain(torch.ones(1))[1] is False
def outer(x):
    return plain(x)[1], torch.compiler.is_compiling()
compiled = torch.compile(lambda x: 2 * x + 1, backend="eager")
assert compiled(torch.ones(2)).tolist() == [3.0, 3.0]
assert {LOADED}
print(torch.compile(outer, backend="eager")(torch.ones(1)))"""
    weights, is_loaded, compiled = run(code).splitlines()
    plain_weights, plain_is_loaded = run(f"import sys{LEARN}print({LOADED})").splitlines()
    assert weights == plain_weights
    assert (is_loaded, plain_is_loaded) == ("False", "True")
    assert compiled == "(False, True)"
