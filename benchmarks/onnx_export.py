"""Do the policies that travel with the package do the same as ONNX models?"""

from pathlib import Path

from drone_rl.policies.policy import load_policy
from drone_rl.policies.zoo import policy_names
from drone_rl.verdicts.onnx_export import export_onnx


def bench_onnx(folder: Path, quick: bool) -> dict[str, float]:
    """Exports them and compares each with PyTorch on 10,000 pictures of its own flights.

    Args:
        folder: Where the models are left.
        quick: Whether one of them will do.

    Returns:
        "onnx_max_difference" in any probability, "onnx_actions_differ" (pictures of which another
        action is the most probable), and "onnx_frames" that were compared.
    """
    folder.mkdir(parents=True, exist_ok=True)
    names = [name for name in policy_names() if load_policy(name).description.frames == 1]
    found = [export_onnx(n, folder / f"{n}.onnx") for n in names[: 1 if quick else None]]
    return {
        "onnx_max_difference": max(f.difference for f in found),
        "onnx_actions_differ": sum(f.actions_differ for f in found),
        "onnx_frames": sum(f.frames for f in found),
    }
