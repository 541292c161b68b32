"""Everything about one policy, as files: `explanation.json`, `arrays.npz` and `dataset.npz`.

These files are all that a report is made of, so that it can be made again without the policy.
"""

import dataclasses
import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from tensordict.nn import TensorDictModuleBase
from torchrl.envs import TransformedEnv

from drone_rl.evaluation import run_episodes, summarise
from drone_rl.explain import class_model, contradictions, interventions, response, truth, tsne
from drone_rl.explain.attribution import Explainer
from drone_rl.explain.dataset import RolloutDataset, record
from drone_rl.explain.hooks import feature_layer, features
from drone_rl.explain.scenes import Scenes, empty_scene
from drone_rl.explain.sequence import choose_episode, key_frames
from drone_rl.explain.verdict import judge_policy
from drone_rl.policies import PolicyNetwork
from drone_rl.utils.errors import InputError

FORMAT_VERSION = 1
MIN_FRAMES = 20
"""Fewer frames than this show nothing."""
MOVED = 0.01
"""Mean effect of a change to the scene below which it counts as none."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class ExplainSettings:
    """What to compute.

    Raises:
        InputError: A value is out of range.
    """

    frames: int = 600
    """Frames in the data set."""
    episodes: int = 400
    """Episodes on which the verdict rests."""
    greedy: bool = True
    """Whether those take the most probable action; the data set's frames are always sampled."""
    layer: str | None = None
    """Layer whose features are embedded; the last one before the logits by default."""
    grad_cam_layer: str | None = None
    """Layer that Grad-CAM looks at; the last convolution's nonlinearity by default."""
    perplexity: float = 30.0
    """Of t-SNE."""
    seed: int = 0
    """Of everything that is drawn."""

    def __post_init__(self) -> None:
        """Refuses what shows nothing."""
        if self.frames < MIN_FRAMES:
            raise InputError(f"frames={self.frames} shows too little; give {MIN_FRAMES} or more")
        if self.episodes < 1:
            raise InputError(f"episodes={self.episodes} is out of range; give 1 or more")
        tsne.check_perplexity(self.perplexity, self.frames)


class _Explanation:
    """Collects one policy's numbers and arrays, section by section."""

    def __init__(
        self,
        env: TransformedEnv,
        actor: TensorDictModuleBase,
        network: PolicyNetwork,
        settings: ExplainSettings,
    ) -> None:
        self.env, self.actor, self.network, self.settings = env, actor, network, settings
        self.scenes = Scenes(env)
        self.layer = settings.layer or feature_layer(network)
        absent = self.scenes.observe(empty_scene(self.scenes))[0]
        self.explainer = Explainer(network, absent, settings.grad_cam_layer)
        self.numbers: dict[str, Any] = {}
        self.arrays: dict[str, NDArray] = {}

    def evaluate(self) -> None:
        episodes = run_episodes(
            self.env, self.actor, self.settings.episodes, greedy=self.settings.greedy
        )
        summary = summarise(episodes)
        num_cubes = self.scenes.worlds.settings.num_cubes
        verdict = judge_policy(summary, num_cubes)
        self.numbers["evaluation"] = summary
        self.numbers["verdict"] = verdict.as_dict()

    def record(self) -> None:
        self.dataset = record(
            self.env,
            self.actor,
            self.network,
            self.settings.frames,
            layers=(self.layer,),
            meta={"layer": self.layer, "seed": self.settings.seed},
        )
        probs = self.dataset.probabilities.astype(np.float64)
        entropy = -(probs * np.log(np.maximum(probs, 1e-12))).sum(-1) / np.log(probs.shape[-1])
        counts = np.bincount(self.dataset.actions, minlength=probs.shape[-1])
        self.numbers["dataset"] = {
            "frames": len(self.dataset),
            "episodes": len(np.unique(self.dataset.episode)),
            "action_shares": (counts / counts.sum()).tolist(),
            "mean_entropy": float(entropy.mean()),
            "cubes_collected": int(self.dataset.rewards.sum()),
        }

    def embed(self) -> None:
        self.numbers["tsne"] = {}
        for name, originals in (
            ("features", self.dataset.features[self.layer]),
            ("pixels", self.dataset.observations),
        ):
            perplexity = self.settings.perplexity
            found = tsne.embed(originals, perplexity=perplexity, seed=self.settings.seed)
            self.arrays[f"tsne_{name}"] = found.points
            self.numbers["tsne"][name] = {
                "layer": self.layer if name == "features" else None,
                "perplexity": perplexity,
                "trustworthiness": found.trustworthiness,
                "neighbours_kept": found.neighbours_kept,
                "neighbours_chance": found.neighbours_chance,
            }

    def contradict(self) -> None:
        pairs = contradictions.find_pairs(self.dataset)
        loops = contradictions.find_loops(self.dataset)
        self.numbers["contradictions"] = {
            **contradictions.summarise_pairs(pairs),
            "list": [dataclasses.asdict(pair) for pair in pairs],
        }
        self.numbers["loops"] = {
            **contradictions.summarise_loops(self.dataset, loops),
            "list": [dataclasses.asdict(loop) for loop in loops],
        }

    def class_models(self) -> None:
        statistics = class_model.PictureStatistics.of(self.dataset.tensor("observations"))
        self.numbers["class_model"] = {"statistics": dataclasses.asdict(statistics)}
        for objective in ("probability", "logit"):
            best, tried = class_model.search(
                self.network, statistics, objective, seed=self.settings.seed
            )
            self.arrays[f"class_model_{objective}"] = best.pictures.numpy()
            self.numbers["class_model"][objective] = {
                "probabilities": best.probabilities.tolist(),
                "each_start": best.each_start.tolist(),
                "roughness": best.roughness,
                "settings": dataclasses.asdict(best.settings),
                "tried": tried,
            }

    def attribute(self) -> None:
        self.maps = {
            name: method(self.dataset.tensor("observations"), self.dataset.tensor("actions"))
            for name, method in self.explainer.methods().items()
        }
        self.frame_maps = {name: self.scenes.to_frame(maps) for name, maps in self.maps.items()}
        for name, maps in self.frame_maps.items():
            peak = maps.flatten(1).amax(1).clamp_min(1e-30)[:, None, None]
            self.arrays[f"map_{name}"] = (maps / peak).numpy().astype(np.float16)
        episode = choose_episode(self.dataset)
        self.numbers["attribution"] = {
            "layer": self.explainer.layer,
            "methods": list(self.maps),
            "episode": episode,
            "sequence": [
                {"frame": frame, "why": why} for frame, why in key_frames(self.dataset, episode)
            ],
        }

    def check_truth(self) -> None:
        data, network = self.dataset, self.network
        observations, actions = data.tensor("observations"), data.tensor("actions")
        state = data.state().to(self.env.device)
        changes = interventions.intervene(
            self.scenes, network, state, data.tensor("regions"), seed=self.settings.seed
        )
        methods = {}
        for name, maps in self.maps.items():
            on_frame, episode = self.frame_maps[name], data.episode
            methods[name] = {
                "pointing": truth.pointing_game(on_frame.numpy(), data.regions, episode),
                "heat": truth.heat_shares(on_frame.numpy(), data.regions, episode),
                "curves": truth.deletion_insertion(
                    network, observations, actions, maps, self.explainer.absent, episode
                ),
                "randomisation": truth.randomisation_test(
                    self.explainer, name, observations, actions, seed=self.settings.seed
                ),
                "causal": interventions.agreement(on_frame, changes, episode),
            }
        random = torch.rand(
            self.maps["saliency"].shape,
            generator=torch.Generator().manual_seed(self.settings.seed),
        )
        effects = {c.name: truth.mean_interval(c.effect, data.episode) for c in changes}
        moved = max((effect["mean"] or 0.0) for effect in effects.values())
        self.numbers["truth"] = {
            "methods": methods,
            "random_map": truth.deletion_insertion(
                network, observations, actions, random, self.explainer.absent, data.episode
            ),
            "interventions": effects,
            "moved_by_anything": moved >= MOVED,
            "trusted": _trusted(methods) if moved >= MOVED else None,
        }
        shown = int(np.argmax(np.nan_to_num(changes[0].effect)))
        self.numbers["truth"]["shown_frame"] = shown
        self.arrays["interventions"] = np.stack([c.frames[shown].cpu().numpy() for c in changes])

    def respond(self) -> None:
        found = response.response_map(self.scenes, self.network)
        for field in dataclasses.fields(found):
            self.arrays[f"response_{field.name}"] = getattr(found, field.name)
        self.arrays["response_blind"] = found.blind
        summary = self.numbers["response"] = found.summary()
        self.numbers["verdict"]["evidence"] = {
            "mean_entropy": self.numbers["dataset"]["mean_entropy"],
            **{f"{side}_answered": summary[f"{side}_answered"] for side in ("left", "right")},
        }
        self.numbers["asymmetry"] = {
            "dataset": response.asymmetry(
                self.network, self.dataset.tensor("observations"), self.dataset.episode
            ),
            "grid": response.grid_asymmetry(found),
        }


def explain_policy(
    env: TransformedEnv,
    actor: TensorDictModuleBase,
    network: PolicyNetwork,
    folder: Path,
    settings: ExplainSettings,
    *,
    name: str,
    provenance: dict[str, Any],
    tell: Callable[[str], None] = lambda _: None,
) -> dict[str, Any]:
    """Computes everything about one policy and writes it to a folder.

    Args:
        env: A batch of held-out worlds.
        actor: The policy.
        network: Its network, on the CPU.
        folder: Where to; made if need be.
        settings: What to compute.
        name: Of the policy, for people.
        provenance: Where it comes from, as plain values.
        tell: Called with what is being done.

    Returns:
        The numbers, as in `explanation.json`.

    Raises:
        InputError: The folder can't be written or a setting doesn't fit the policy.
    """
    work = _Explanation(env, actor, network, settings)
    features(network, work.explainer.absent[None], work.layer)  # refuses an unknown layer now
    sections = {
        "evaluation and verdict": work.evaluate,
        "data set": work.record,
        "t-SNE": work.embed,
        "contradictions and loops": work.contradict,
        "class models": work.class_models,
        "attribution": work.attribute,
        "truth tests": work.check_truth,
        "response map": work.respond,
    }
    seconds = {}
    for title, section in sections.items():
        tell(title)
        began = time.perf_counter()
        section()
        seconds[title] = round(time.perf_counter() - began, 2)
    numbers = {
        "format": "drone_rl explanation",
        "format_version": FORMAT_VERSION,
        "name": name,
        "settings": dataclasses.asdict(settings),
        "seconds": seconds,
        **work.numbers,
        "provenance": provenance,
    }
    _write(folder, numbers, work.arrays, work.dataset)
    return numbers


def _trusted(methods: dict[str, Any]) -> str | None:
    """The method whose claims agree best with the interventions, among those that may be trusted.

    It must pass the randomisation test, and the whole interval of its agreement must lie above 0.
    """
    able = {
        name: found["causal"]["correlation"]
        for name, found in methods.items()
        if found["randomisation"]["passed"] and (found["causal"]["lower95"] or -1.0) > 0
    }
    return max(able, key=lambda name: able[name]) if able else None


def _write(
    folder: Path, numbers: dict[str, Any], arrays: dict[str, NDArray], dataset: RolloutDataset
) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        dataset.save(folder / "dataset.npz")
        np.savez_compressed(folder / "arrays.npz", **arrays)
        (folder / "explanation.json").write_text(json.dumps(numbers, indent=1))
    except OSError as error:
        raise InputError(
            f"explanation {folder} can't be written ({error.strerror}); choose another folder"
        ) from error
