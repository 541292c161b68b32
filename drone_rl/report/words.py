"""What was found, in sentences made of the numbers."""

from typing import Any

from drone_rl.report.explanation import ACTIONS, Explanation
from drone_rl.report.plots import NAMES


def sentences(explanation: Explanation) -> dict[str, str]:
    """One finding a section, for a person."""
    numbers = explanation.numbers
    return {
        "dataset": _dataset(numbers),
        "tsne": _tsne(numbers["tsne"]),
        "contradictions": _contradictions(numbers["contradictions"]),
        "loops": _loops(numbers["loops"]),
        "class_model": _class_model(numbers["class_model"]),
        "attribution": _attribution(numbers),
        "truth": _truth(numbers["truth"]),
        "response": _response(numbers["response"]),
        "asymmetry": _asymmetry(numbers["asymmetry"]),
    }


def percent(share: float | None) -> str:
    """A share for people."""
    return "none" if share is None else f"{100 * share:.0f}%"


def _dataset(numbers: dict[str, Any]) -> str:
    data = numbers["dataset"]
    shares = ", ".join(
        f"{percent(s)} {a}" for s, a in zip(data["action_shares"], ACTIONS, strict=True)
    )
    text = f"{data['frames']} frames from {data['episodes']} episodes; actions: {shares}. "
    text += f"Mean entropy of the policy: {data['mean_entropy']:.2f} of 1 (1 is a coin toss)."
    if max(data["action_shares"]) > 0.99:
        only = ACTIONS[data["action_shares"].index(max(data["action_shares"]))]
        text += f" Whatever it sees, this policy goes {only}."
    if data["cubes_collected"] == 0:
        text += " No cube was collected in these frames."
    return text


def _tsne(numbers: dict[str, Any]) -> str:
    one, two = numbers["features"], numbers["pixels"]
    return (
        f"How faithful the maps are: of the 10 nearest neighbours in truth, "
        f"{percent(one['neighbours_kept'])} (features of layer {one['layer']}) and "
        f"{percent(two['neighbours_kept'])} (pixels) are among the nearest here "
        f"(chance: {percent(one['neighbours_chance'])}); trustworthiness "
        f"{one['trustworthiness']:.3f} and {two['trustworthiness']:.3f} of 1."
    )


def _contradictions(numbers: dict[str, Any]) -> str:
    if not numbers["pairs"]:
        return "No two frames look alike and are answered with opposite actions."
    text = f"{numbers['pairs']} pairs of alike frames are answered in opposite ways: "
    text += f"{numbers['contradictions']} are contradictions (the next cube stands alike in both), "
    text += f"{numbers['justified']} are justified (it does not)."
    if numbers["contradictions"]:
        text += f" In the worst, the wish to turn swings by {numbers['worst_opposition']:.2f} of 1."
    return text


def _loops(numbers: dict[str, Any]) -> str:
    if not numbers["loops"]:
        return "The drone never moves back and forth in a loop."
    return (
        f"The drone moves back and forth in {numbers['loops']} loops, in "
        f"{numbers['episodes_with_loops']} of {numbers['episodes']} episodes; the longest takes "
        f"{numbers['longest']} frames, all together {percent(numbers['frames_share'])} of the time."
    )


def _class_model(numbers: dict[str, Any]) -> str:
    reached = numbers["logit"]["probabilities"]
    listed = ", ".join(f"{a} {p:.3f}" for a, p in zip(ACTIONS, reached, strict=True))
    never = [a for a, p in zip(ACTIONS, reached, strict=True) if p < 0.5]
    text = f"Probability reached by the pictures sought by logit: {listed}."
    if never:
        text += f" No picture found makes this policy go {' or '.join(never)}."
    return text


def _attribution(numbers: dict[str, Any]) -> str:
    layer = numbers["attribution"]["layer"]
    if layer is None:
        return "This policy has no convolution, so Grad-CAM can't be had; saliency is shown."
    empty = numbers["truth"]["methods"]["grad_cam"]["pointing"]["maps_without_heat"]
    text = f"Grad-CAM of layer {layer}, on an episode chosen by rule."
    if empty:
        text += f" {empty} of {numbers['dataset']['frames']} maps of the probability hold no heat"
        text += " (the policy is so sure that the derivative vanishes); the logit's stands in."
    return text


def _truth(numbers: dict[str, Any]) -> str:
    trusted = numbers["trusted"]
    if not numbers["moved_by_anything"]:
        return (
            "Nothing that is changed in the scene moves this policy, so there is nothing that a "
            "map of it could be true about: trust none of them."
        )
    if trusted is None:
        return (
            "No method's maps may be trusted on this policy: none both changes with the weights "
            "and agrees with what changing the scene does."
        )
    causal = numbers["methods"][trusted]["causal"]
    pointing = numbers["methods"][trusted]["pointing"]
    text = f"The map to trust is {NAMES.get(trusted, trusted)}: what it claims agrees best with "
    text += f"what changing the scene does (rank correlation {causal['correlation']:.2f}, 95%: "
    text += f"{causal['lower95']:.2f} to {causal['upper95']:.2f}), and it changes with the weights."
    if pointing["hit"]["mean"] is not None:
        text += f" Its brightest pixel is on the next cube in {percent(pointing['hit']['mean'])} "
        text += f"of frames (chance: {percent(pointing['chance']['mean'])})."
    return text


def _response(numbers: dict[str, Any]) -> str:
    text = "On its way to a cube, the policy turns to it in time in "
    text += f"{percent(numbers['left_answered'])} of the places on the left and "
    text += f"{percent(numbers['right_answered'])} of those on the right; it does at once what the "
    text += f"oracle does in {percent(numbers['agrees_with_oracle'])} of all places."
    for side in ("left", "right"):
        if numbers[f"{side}_answered"] < 0.5 and numbers[f"{side}_blind"] > 0.05:
            blind = percent(numbers[f"{side}_blind"])
            text += f" It is blind to {blind} of the places on the {side}."
    return text


def _asymmetry(numbers: dict[str, Any]) -> str:
    signed, absolute = numbers["dataset"]["signed"], numbers["dataset"]["absolute"]
    text = f"On average the policy differs from its mirror image by {absolute['mean']:.2f} "
    text += f"(0: perfectly symmetric, 1: always opposite; 95%: {absolute['lower95']:.2f} to "
    text += f"{absolute['upper95']:.2f}); on the grid by {numbers['grid']['absolute']:.2f}. "
    if signed["lower95"] <= 0 <= signed["upper95"]:
        return text + "Neither side is preferred beyond chance."
    side = "left" if signed["mean"] > 0 else "right"
    return text + f"It prefers the {side} (by {abs(signed['mean']):.2f} in probability)."
