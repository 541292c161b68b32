"""The flight that the page shows: one world, who flies it, and the messages of browsers."""

import json
import logging
import math
import struct
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

import pydantic
import torch
from PIL import Image
from torch import Tensor

from drone_rl.config.inputs import ImageInput
from drone_rl.envs import Pipeline
from drone_rl.flight.fly_page.pilots import (
    CONTROLS,
    Controls,
    VelocityPilot,
    make_pilot,
    parts_of,
)
from drone_rl.flight.fly_page.recorder import Recorder
from drone_rl.flight.fly_page.saliency import LiveSaliency
from drone_rl.flight.fly_page.world import Seen, World
from drone_rl.flight.image_types import encode
from drone_rl.flight.settings import CAMERAS, FLY_MODES, FlySettings
from drone_rl.policies.policy import Policy
from drone_rl.sim.coordinates import Attitude
from drone_rl.sim.dynamics import BodyState
from drone_rl.trust.plots.images import heated, shown_picture
from drone_rl.utils.errors import InputError
from drone_rl.utils.models import Model
from drone_rl.utils.schema import OneOf, Real, as_mapping

LIMITS = {"speed": (0.5, 10.0), "wind": (0.0, 12.0), "wind_from": (0.0, 360.0), "light": (0.2, 2.0)}
"""Lowest and highest values of the sliders: m/s, m/s, degrees, factor."""


def _message(**fields: Any) -> type[Model]:
    """Return the kind of a browser's messages with these fields, each of a type."""
    kinds: dict[str, Any] = {name: (kind, ...) for name, kind in fields.items()}
    return pydantic.create_model("Message", __base__=Model, **kinds)


_MESSAGES = {
    "hold": _message(controls=tuple[Annotated[str, OneOf(CONTROLS)], ...]),
    "pilot": _message(pilot=Literal["person", "policy"]),
    "mode": _message(mode=Annotated[str, OneOf(FLY_MODES)]),
    "camera": _message(camera=Annotated[str, OneOf(CAMERAS)]),
    "set": _message(name=Annotated[str, OneOf(tuple(LIMITS))], value=float),
    "record": _message(on=bool),
    "saliency": _message(on=bool),
    "reset": _message(),
    "take_off": _message(),
    "land": _message(),
}
"""Fields of each type of message, which are the arguments of a method of `Flight`."""
_PAUSE = 2.0
"""Seconds after an episode of the policy before the next one begins."""
_LOOK_PERIOD = 0.1
"""Seconds between two observations while a person moves freely."""
_SIZE = 1.0
"""Edge of objects on the map if the task does not state it, metres."""
_JPEG_QUALITY = 85
_ACTIONS = "the policy's actions"
_SALIENCY = {
    "off": "tested when it is switched on",
    "testing": "testing methods on this policy; this takes a minute or so",
    "shown": "bright pixels affect the most probable action; method {method}, which passed the "
    "tests on this policy",
    "none": "no method passes the tests on this policy, so none is shown",
    "failed": "the methods can't be tested: {problem}",
}
"""What the page says of heat maps, by `LiveSaliency.state`."""
_log = logging.getLogger(__name__)
_LONGEST = 0.1
"""Most seconds that pass at once; a slow machine falls behind instead."""


class Flight:
    """One drone that a person or the policy flies. Not thread-safe: one thread owns it."""

    def __init__(self, policy: Policy, settings: FlySettings, demonstrations: Path) -> None:
        """Start an episode, flown by a person.

        Args:
            policy: The policy.
            settings: View, mode and seed at the start.
            demonstrations: Folder to which recorded flights are added.
        """
        self.world = World(
            policy, seed=settings.seed, greedy=settings.greedy, renderer=settings.renderer
        )
        self.controls = Controls()
        self.recorder = Recorder(self.world, demonstrations)
        self.saliency = LiveSaliency(self.world)
        self.camera, self.mode, self.pilot = settings.view, settings.mode, "person"
        self.speed = 4.0
        """Of velocity commands and of moves without dynamics, m/s."""
        self.note = ""
        """What happened last, for the person."""
        self._problem: str | None = None
        """Why the last recorded flight could not be written."""
        self.time = 0.0
        """Seconds flown since the start."""
        self._wants_saliency, self._shows_saliency = settings.saliency, settings.saliency
        self._over = 0.0
        self._seen, self._seen_at = self.world.see(), 0.0
        described = policy.description.inputs
        self._images = {n: i for n, i in described.items() if isinstance(i, ImageInput)}
        self._levels = {name: _levels(image) for name, image in self._images.items()}
        """What is shown of each image as black and as white."""
        self._number = 0
        self._flyer = make_pilot(self._kind, self.world, self._note_step)

    # Messages

    def handle(self, message: Any) -> None:
        """Do what a browser's message says; an `InputError` if it is wrong or impossible."""
        values = dict(as_mapping(message, "message"))
        kind = OneOf(tuple(_MESSAGES)).read(values.pop("type", None), "type")
        getattr(self, f"_{kind}")(**dict(_MESSAGES[kind].read(values, kind)))

    def _hold(self, controls: Sequence[str]) -> None:
        self.controls.hold(controls)

    def _take_off(self) -> None:
        self._flying("take_off").take_off()

    def _land(self) -> None:
        self._flying("land").land()

    def _pilot(self, pilot: str) -> None:
        """Hand over to the policy, or back to a person."""
        if pilot == self.pilot:
            return
        self._finish_recording()
        self.pilot = pilot
        if pilot == "policy" and self.world.is_over:
            self._reset()
        self._change_flyer()
        self.note = "You fly."
        if pilot == "policy":
            moved = ", from the task's altitude and heading" if self.mode != "actions" else ""
            self.note = f"The policy {self.world.policy.name} flies{moved}."

    def _mode(self, mode: str) -> None:
        """Choose how a person flies."""
        if mode == self.mode:
            return
        if self.pilot == "person":
            self._finish_recording()
        self.mode = mode
        if self.pilot == "person":
            self._change_flyer()

    def _reset(self) -> None:
        """Start a new episode."""
        self._finish_recording()
        self.world.reset()
        self._over = 0.0
        self.note = "A new episode begins."
        self._change_flyer()

    def _record(self, on: bool) -> None:
        """Turn recording on or off; a person then flies by the policy's actions."""
        if on and self.mode != "actions":
            self._mode("actions")
            self.note = "Demonstrations consist of the policy's actions, now your controls."
        if not on:
            self._finish_recording()
        self.recorder.is_on = on
        self._problem = None if on else self._problem

    def _camera(self, camera: str) -> None:
        self.camera = camera

    def _saliency(self, on: bool) -> None:
        self._shows_saliency = on
        self._wants_saliency |= on

    def _set(self, name: str, value: float) -> None:
        low, high = LIMITS[name]
        value = Real(low, high).read(value, name)
        if name == "speed":
            self.speed = value
        elif name == "light":
            self.world.set_light(value)
        else:
            self._finish_recording()  # under the wind so far
            speed, direction = self.world.wind
            chosen = (value, direction) if name == "wind" else (speed, value)
            self.world.set_wind(*chosen)

    def _flying(self, name: str) -> VelocityPilot:
        if not isinstance(self._flyer, VelocityPilot):
            raise InputError(f"{name} needs simple flight; choose it as your controls")
        return self._flyer

    def release(self) -> None:
        """Let go of all controls, because no browser holds them any more."""
        self.controls.release()

    @property
    def _kind(self) -> str:
        return "policy" if self.pilot == "policy" else self.mode

    def _change_flyer(self) -> None:
        if self._kind not in ("actions", "policy"):  # only these pilots take steps to record
            self.recorder.is_on = False
        self.controls.release()
        self._flyer = make_pilot(self._kind, self.world, self._note_step)

    def _note_step(self, readings: dict[str, Tensor], action: Tensor, reward: float) -> None:
        self.recorder.note(readings, action, reward)
        if self.world.is_over:
            self._finish_recording()

    def _finish_recording(self) -> None:
        try:
            self.recorder.finish(self.pilot)
        except InputError as error:
            self._problem = str(error)
            _log.error("%s", error)

    # Time

    def advance(self, seconds: float) -> None:
        """Let time pass."""
        seconds = min(seconds, _LONGEST)
        self.time += seconds
        self.controls.advance(seconds)
        self._flyer.advance(seconds, self.controls, self.speed)
        if bool(self.world.body.is_lost[0]):
            self.note = "The simulation has diverged; start a new episode."
        if self.world.is_over and self.pilot == "policy":
            self._over += seconds
            if self._over >= _PAUSE:
                self._reset()
        if self._wants_saliency:
            self.saliency.start()
        self.saliency.poll()

    def close(self) -> None:
        """Write the recorded steps, end the tests of heat maps, and close the renderer."""
        self._finish_recording()
        self.saliency.close()
        self.world.close()

    # What browsers get

    def hello(self) -> dict[str, Any]:
        """Return what does not change: actions, choices, and texts by the ids of their elements."""
        world, actions = self.world, self.world.actions
        region = world.policy.task.object_region
        task = world.task.name.replace("_", " ")
        return {
            "texts": {
                "name": world.policy.name,
                "task": f"Task: {task}. The policy's actions: {', '.join(actions.names)}.",
            },
            "object": world.task.vocabulary.target,
            "size": region.size if region else _SIZE,
            "actions": list(actions.names),
            "order": [int(part) for part in actions.order],
            "controls": list(parts_of(actions)),
            "dynamics": world.has_dynamics,
            "cameras": list(CAMERAS),
            "limits": LIMITS,
        }

    def frame(self) -> bytes:
        """Return the present state and images; see `packed`."""
        images = [
            ("view", "image/jpeg", self._view()),
            ("observation", "image/png", self._observed()),
        ]
        self._number += 1
        return packed({"frame": self._number, **self._state()}, images)

    def _state(self) -> dict[str, Any]:
        world = self.world
        seen = self._look()
        speed, direction = world.wind
        return {
            "time": round(self.time, 3),
            "episode": world.episode,
            "pilot": self.pilot,
            "mode": self.mode,
            "camera": self.camera,
            **pose_of(world.body),
            "objects": [None if place is None else _rounded(place) for place in world.objects],
            "goals": world.goals,
            "steps": int(world.worlds.state.steps[0]),
            "end": world.end,
            "probabilities": _rounded(seen.probabilities),
            "settings": {
                "speed": self.speed,
                "wind": round(speed, 2),
                "wind_from": round(direction, 1),
                "light": world.light,
            },
            "recording": {
                "on": self.recorder.is_on,
                "steps": len(self.recorder),
                "saved": self.recorder.saved,
                "problem": self._problem,
            },
            "saliency": self._shows_saliency,
            "texts": self._texts(),
        }

    def _texts(self) -> dict[str, str]:
        """Return what the page says, by the ids of its elements."""
        world, recorder, is_person = self.world, self.recorder, self.pilot == "person"
        end = ""
        if world.end and not (is_person and self.mode != "actions"):
            later = "New episode, or N, starts the next." if is_person else "The next one begins."
            end = f"Episode over, {world.end}. {later}"
        recording = (
            "Record writes what you fly by the policy's actions, or what the policy flies, as "
            "demonstrations."
        )
        if recorder.is_on or recorder.saved:
            start = "Recording" if recorder.is_on else "Recorded flights"
            recording = f"{start}: {recorder.saved} saved in {recorder.folder}."
        return {
            "flyer": f"You fly: {self.mode.replace('_', ' ').replace('actions', _ACTIONS)}"
            if is_person
            else f"The policy {world.policy.name} flies",
            "score": self._score(),
            "end": end,
            "note": self.note,
            "recording": recording,
            "vectors": self._vectors(),
            "method": _SALIENCY[self.saliency.state].format(
                problem=self.saliency.problem, method=(self.saliency.method or "").replace("_", " ")
            ),
        }

    def _score(self) -> str:
        """Return how many goals are reached."""
        (reached, total), terms = self.world.goals, self.world.task.vocabulary
        return f"{reached} of {total} {terms.goal if total == 1 else terms.goals} {terms.reached}"

    def _look(self) -> Seen:
        """Return what the policy sees; while a person moves freely, some times a second."""
        now = time.monotonic()
        is_free = self.pilot == "person" and self.mode != "actions"
        if not is_free or now - self._seen_at >= _LOOK_PERIOD:
            self._seen, self._seen_at = self.world.see(), now
        return self._seen

    def _view(self) -> bytes:
        picture = Image.fromarray(self.world.render(self.camera).numpy())
        return encode(picture, "jpeg", quality=_JPEG_QUALITY)

    def _observed(self) -> bytes:
        """Return the images among the inputs, the first with its heat map if there is one to show.

        They stand one below the other.
        """
        seen, pictures = self._look(), []
        shows = self._shows_saliency and self.saliency.state == "shown"
        for name, image in self._images.items():
            values = seen.inputs[name][0].numpy()
            picture = shown_picture(values, *self._levels[name], _channels(image))
            heat = self.saliency.heat(seen) if shows and not pictures else None
            pictures.append(Image.fromarray(picture if heat is None else heated(picture, heat)))
        size = max((p.width for p in pictures), default=1), sum(p.height for p in pictures) or 1
        whole, top = Image.new("RGB", size), 0
        for picture in pictures:
            whole.paste(picture, (0, top))
            top += picture.height
        return encode(whole, "png")

    def _vectors(self) -> str:
        """Return the vectors among the inputs, in their units, as text."""
        readings = self._look().readings
        vectors = {name: readings[name][0].tolist() for name in readings.keys() - self._images}
        texts = (
            f"{n} {' '.join(f'{v:.2f}' for v in vectors[n])}" for n in readings if n in vectors
        )
        return "; ".join(texts)


def _levels(image: ImageInput) -> tuple[float, float]:
    """Return the least and greatest value of an image after its transforms."""
    transforms = [transform.make() for transform in image.without_errors().transforms]
    most, dtype = (1.0, torch.float32) if image.frame.is_float else (255, torch.uint8)
    frames = [torch.full((1, *image.frame.shape), v, dtype=dtype) for v in (0, most)]
    dark, light = (Pipeline(transforms)(frame) for frame in frames)
    return float(dark.min()), float(light.max())


def _channels(image: ImageInput) -> str:
    """Return the channels of an image, see `shown_picture`."""
    colors = [step.name for step in image.transforms if step.name in ("rgb", "chromaticity")]
    return {"normals": "rgb", "segmentation": "classes"}.get(image.modality, [*colors, "gray"][0])


def packed(state: Mapping[str, Any], images: Sequence[tuple[str, str, bytes]]) -> bytes:
    """Return a frame for browsers, of a state and images: names, media types and contents.

    A little-endian uint32 is the length of the JSON text that follows; then come the images that
    its "images" lists by name, type and size.
    """
    listed = [{"name": n, "type": t, "size": len(data)} for n, t, data in images]
    whole = {**state, "images": listed}
    text = json.dumps(whole, allow_nan=False, separators=(",", ":")).encode()
    return b"".join([struct.pack("<I", len(text)), text, *(data for *_, data in images)])


def pose_of(body: BodyState) -> dict[str, Any]:
    """Return the position, attitude in degrees and speed of a single drone, for browsers."""
    attitude = Attitude.of(body.attitude[0].tolist())
    return {
        "position": _rounded(body.position[0].tolist()),
        "attitude": _rounded((attitude.roll, attitude.pitch, attitude.yaw)),
        "velocity": round(float(body.velocity[0].norm()), 2),
    }


def _rounded(values: Any) -> list[float]:
    return [round(value, 3) if math.isfinite(value) else 0.0 for value in values]
