"""Agreement of the shipped policies with their ONNX exports."""

from benchmarks.benchmark import Setup
from drone_rl.policies.policy import load_policy
from drone_rl.policies.zoo import policy_names
from drone_rl.trust.onnx_export import export_onnx


def bench_onnx(setup: Setup) -> dict[str, float]:
    """Export the policies and compare each with PyTorch on 10,000 observations of its rollouts.

    Returns:
        "onnx_max_difference" of any probability, "onnx_actions_differ" (frames with another
        greedy action), and "onnx_frames" (compared frames).
    """
    folder = setup.runs / "onnx"
    folder.mkdir(parents=True, exist_ok=True)
    names = [name for name in policy_names() if load_policy(name).description.frames == 1]
    agreements = [export_onnx(n, folder / f"{n}.onnx") for n in names[: 1 if setup.quick else None]]
    return {
        "onnx_max_difference": max(f.difference for f in agreements),
        "onnx_actions_differ": sum(f.actions_differ for f in agreements),
        "onnx_frames": sum(f.frames for f in agreements),
    }
