"""See the package's docstring."""

import json
import sys

from benchmarks.airsim_programs import PROGRAMS
from benchmarks.airsim_programs.session import Session

if __name__ == "__main__":
    module, port, name = sys.argv[1:]
    measured = PROGRAMS[name].run(Session(module, int(port)))
    sys.stdout.write(f"\n{json.dumps(measured)}\n")
