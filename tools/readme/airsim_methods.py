"""The table of the RPC methods of AirSim's client, and what the server does with each."""

from benchmarks.airsim import METHODS_1_8
from drone_rl.flight.airsim.methods import PARTLY, UNSUPPORTED


def list_airsim_methods() -> str:
    """Return a row for each method of the multirotor client 1.8.1."""
    rows = ["| method | works |", "| --- | --- |"]
    for name in sorted(METHODS_1_8):
        if name in UNSUPPORTED:
            rows.append(f"| `{name}` | no {UNSUPPORTED[name]} |")
        elif name in PARTLY:
            rows.append(f"| `{name}` | partly: {PARTLY[name]} |")
        else:
            rows.append(f"| `{name}` | yes |")
    return "\n".join(rows)
