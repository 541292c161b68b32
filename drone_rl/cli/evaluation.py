"""`drone-rl evaluate`, `play`, `verdict`, `shifts`, `bodies` and `export`: their settings."""

import logging
from pathlib import Path
from typing import Annotated, Any, Literal

import drone_rl
from drone_rl.cli.settings import CommandSettings, RolloutCommandSettings, finish
from drone_rl.config import AppearanceSettings
from drone_rl.config.camera import DeviceSettings
from drone_rl.config.commands import (
    BodiesSettings,
    EvaluateSettings,
    HeldOutSettings,
    JudgeSettings,
    ShiftSettings,
)
from drone_rl.config.values import NumEpisodes, Seed
from drone_rl.utils.models import Seeded
from drone_rl.utils.overrides import COMMAND
from drone_rl.utils.progress import bar_or_lines, log
from drone_rl.utils.schema import FileName, Whole

_log = logging.getLogger(__name__)


class AppearanceCommandSettings(RolloutCommandSettings):
    """Settings of a command in which the appearance can be changed."""

    appearance: AppearanceSettings | None = None
    """Appearance of the scenes (see conf/appearance); null for that of the policy's training."""

    def load_policy(self) -> Any:
        """Return the policy with the changes of task, dynamics and appearance."""
        policy = super().load_policy()
        return policy if self.appearance is None else policy.in_appearance(self.appearance)


class EvaluateCommand(AppearanceCommandSettings, EvaluateSettings):
    """Measure a policy's success rate and reward in held-out episodes.

    The random and constant baselines and the oracle are evaluated in the same episodes.
    """

    videos: Annotated[int, Whole(0, unit="episodes")] = 2
    """Episodes recorded as MP4 and GIF; 0 for none."""
    greedy: bool = True
    """Whether the videos show the most probable actions instead of sampled ones."""

    def run(self, folder: Path) -> tuple[int, float]:
        """Evaluate one policy; return the exit status and the success rate."""
        policy = self.load_policy()
        result = drone_rl.evaluate(policy, self, progress=log)
        _log.info("policy: %s", policy.path)
        finish(result, folder / "evaluation.json")
        _draw_maps(policy, folder, self, result)
        if self.videos:
            from drone_rl.trust.video import film

            film(
                policy,
                folder / "videos",
                self.videos,
                greedy=self.greedy,
                seed=result.seed or 0,
                device=self.device,
                renderer=self.renderer,
            )
        return 0, result.success


def _draw_maps(policy: Any, folder: Path, settings: HeldOutSettings, result: Seeded) -> None:
    """Draw the map of each scene file of a policy's task, if there is one."""
    if getattr(policy.task, "scene", None):
        from drone_rl.trust.scene_map import save_maps

        for path in save_maps(policy, folder, settings, result.seed or 0):
            _log.info("written: %s", path)


class PlayCommand(AppearanceCommandSettings, DeviceSettings):
    """Film a policy as MP4 and GIF, or watch it in dm_control's viewer."""

    episodes: NumEpisodes = 3
    """Episodes to record, each in files of its own."""
    greedy: bool = True
    """Whether to take the most probable action instead of sampling."""
    seed: Seed = 0
    """Root of the environments' random streams."""
    viewer: bool = False
    """Whether to open dm_control's viewer, which needs a display, instead of recording."""

    def ends_alone(self) -> bool:
        """See `CommandSettings`."""
        return not self.viewer

    def run(self, folder: Path) -> tuple[int, None]:
        """Record a policy's episodes, or open the viewer; return the exit status."""
        policy = self.load_policy()
        options = {k: getattr(self, k) for k in ("greedy", "seed", "device", "renderer")}
        from drone_rl.trust.video import film, view  # slow to import

        if self.viewer:
            view(policy, **options)
        else:
            film(policy, folder, self.episodes, **options)
        return 0, None


class VerdictCommand(AppearanceCommandSettings, JudgeSettings):
    """Judge a policy as good, one-sided or poor in held-out episodes.

    Exit status: 0 good, 10 poor, 11 one-sided, 12 none of these, 13 not certain (too few episodes,
    or repeated ones end otherwise), 18 good but trivial (a baseline that ignores observations
    succeeds, too, or the policy does not use its camera), 16 not proved
    (require=proved), 17 outside the required operating domain (require_domain=FILE).
    policy=random, oracle, forward, left or right judges a baseline, task=NAME in another task.
    """

    certificate: str | None = None
    """Certificate file to quote; null takes the one next to the policy, if it matches:
    certificate.json in the folder of a run, NAME.certificate.json next to NAME.safetensors."""
    require: Literal["good", "proved"] | None = None
    """good or null: exit status 0 only if the policy is certainly good, otherwise one per kind.
    proved: in addition there must be a certificate of success from every placement that episodes
    do not refute and a new proof confirms (minutes), otherwise 16."""
    shifts: str | None = None
    """File shifts.json to quote; null takes the one next to the policy, otherwise the newest under
    outputs/shifts of this network and task."""
    require_domain: str | None = None
    """Operating domain in which the policy must be good, otherwise exit status 17: a YAML or JSON
    file with a range for each axis, such as domain.yaml of drone-rl shifts; null requires none."""

    def run(self, folder: Path) -> tuple[int, str]:
        """Judge one policy; return the exit status and the kind's name."""
        names = ("dynamics", "appearance", "certificate", "require", "shifts", "require_domain")
        options = {name: getattr(self, name) for name in names}
        options |= {"progress": bar_or_lines(), **self.shared()}
        result = drone_rl.judge(self.policy, self, **options)
        finish(result, folder / "verdict.json")
        if result.camera is not None:  # it is no baseline
            _draw_maps(self.load_policy(), folder, self, result)
        if self.require == "proved" and result.proof is None:
            _log.info(
                "the policy has no certificate; make one with drone-rl prove, or give certificate="
            )
        return result.status(self.require), result.kind.value


class ShiftsCommand(RolloutCommandSettings, ShiftSettings):
    """Measure how robust a policy is to perturbations, and the range in which it stays good.

    Writes JSON and figures. Axes, by group: color (object_color, object_white, floor_color), camera
    angle (camera_yaw, camera_pitch, camera_roll), camera position (camera_height, camera_sideways),
    field of view (field_of_view), light (sun, brightness), fog (fog), object size (object_size),
    distractors (distractors), sensor (noise, slow_noise, blur, dead_rows, frozen_frames,
    late_frames), dynamics (step_length, action_delay).
    """

    def run(self, folder: Path) -> tuple[int, float]:
        """Measure robustness; return the exit status and the mean area under the success curves."""
        settings = self.as_base(ShiftSettings)
        result = drone_rl.shifts(
            self.policy, settings, dynamics=self.dynamics, **self.shared(), progress=log
        )
        ranges = "" if result.domain is None else "domain.yaml, "
        finish(result, folder, f"shifts.json, {ranges}shifts.png and strips.png")
        return 0, result.area


class BodiesCommand(CommandSettings, BodiesSettings):
    """Compare the verdicts of policies under several vehicle dynamics.

    Writes a table, JSON, PNG and SVG. Dynamics: computer vision, simple flight, wind 2 m/s,
    wind 5 m/s, wind 8 m/s (from the right, with gusts of a quarter), motors twice as slow,
    camera on the body.
    """

    def run(self, folder: Path) -> tuple[int, int]:
        """Judge policies under several dynamics; return the exit status and number of verdicts."""
        settings = self.as_base(BodiesSettings)
        result = drone_rl.bodies(settings=settings, outputs=self.paths.outputs, progress=log)
        finish(result, folder, "bodies.json, bodies.png and bodies.svg")
        return 0, sum(map(len, result.policies.values()))


class ExportCommand(CommandSettings, HeldOutSettings):
    """Write a policy with a model card, or as an ONNX model.

    The files are NAME.safetensors and NAME.md, or NAME.onnx for any program with onnxruntime
    (pip install -e '.[onnx]').
    """

    policy: str = "latest"
    """Policy: a .pt or .safetensors file, folder of a run, latest, or name of a shipped policy."""
    name: Annotated[str, FileName()] = "policy"
    """Name of the files, without extension."""
    format: Literal["safetensors", "onnx"] = "safetensors"
    """safetensors with model card, or onnx: a model from RGB image to action probabilities."""
    command: Annotated[str, COMMAND] | None = None
    """Training command for the card or the ONNX metadata; null takes that of the policy's run."""
    certificate: str | None = None
    """Certificate file for the card; null takes the one next to the policy, if it matches."""
    shifts: str | None = None
    """File shifts.json for the card; null takes the one next to the policy, otherwise the newest
    under outputs/shifts of this network and task."""

    def check(self) -> None:
        """Reject extensions, and files for the model card with an ONNX model, which has none."""
        stem, _, extension = self.name.rpartition(".")
        if extension in ("safetensors", "onnx", "pt"):
            self.refuse("name", f"has an extension; give name={stem or 'policy'}")
        for name in ("certificate", "shifts"):
            if self.format == "onnx" and getattr(self, name) is not None:
                self.refuse(name, "is for a model card, which format=onnx does not write; omit it")

    def run(self, folder: Path) -> tuple[int, str]:
        """Export one policy; return the exit status and the file's path."""
        from drone_rl.sweeps.rows import choice_in_sweep
        from drone_rl.trust.export import export
        from drone_rl.trust.onnx_export import export_onnx
        from drone_rl.trust.recorded import record_verdict
        from drone_rl.utils.seeding import root_seed  # imports torch
        from drone_rl.verification.claim import find_claim

        policy = drone_rl.load_policy(self.policy, outputs=self.paths.outputs)
        target = folder / f"{self.name}.{self.format}"
        recorded_command, choice = choice_in_sweep(policy.path) or (None, None)
        command = self.command or recorded_command
        if self.format == "onnx":
            _log.info("compares the model with PyTorch in the policy's episodes")
            seed = root_seed(self.seed)
            exported = export_onnx(policy, target, command=command, seed=seed.value)
            difference = f"{exported.difference:.1e} in {exported.frames:,} images"
            print(f"differs from PyTorch by at most {difference}")
            seeded = Seeded(**seed.as_dict())
        else:
            _log.info("judges the policy in %s episodes for the model card", f"{self.episodes:,}")
            seeded = export(
                policy,
                target,
                self,
                command=command,
                chosen=choice,
                certificate=self.certificate,
                shifts=self.shifts,
                outputs=self.paths.outputs,
                find_claim=find_claim,
            )
            record_verdict(folder, policy, seeded)
            print(seeded.line)
        _log.info("written: %s; %s", target, seeded.seed_line())
        return 0, str(target)
