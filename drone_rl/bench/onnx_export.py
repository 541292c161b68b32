"""Do the policies that travel with the package do the same as ONNX models?"""

from pathlib import Path

from drone_rl.api.exporting import export_onnx
from drone_rl.zoo import policy_names


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
    names = policy_names()[: 1 if quick else None]
    found = [export_onnx(name, folder / f"{name}.onnx") for name in names]
    return {
        "onnx_max_difference": max(f.difference for f in found),
        "onnx_actions_differ": sum(f.actions_differ for f in found),
        "onnx_frames": sum(f.frames for f in found),
    }
