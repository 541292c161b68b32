"""The chapter's program for AirSim 1.1 (section 4.2): teleports and images, Algorithm 3.

python examples/airsim_chapter.py settings > chapter.json
drone-rl serve settings=chapter.json clock=lockstep    # in another terminal
python examples/airsim_chapter.py         # an oracle that sees images only: 3 cubes an episode
python examples/airsim_chapter.py train   # REINFORCE with TorchRL through the client: minutes

The oracle needs numpy and msgpack alone. The program uses `AirSimClient.py` of AirSim 1.1.7 where
that can be imported, else `Client`, which sends the same messages.
"""

import functools
import json
import socket
import sys
from collections import deque
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import msgpack
import numpy as np

Act = Callable[[np.ndarray], int]
"""From an image to an action."""
SETTINGS = {
    mode: json.dumps(
        {
            "SettingsVersion": 1,
            "SimMode": mode,
            "CameraDefaults": {
                "CaptureSettings": [{"ImageType": 0, "Width": 64, "Height": 25, "FOV_Degrees": 135}]
            },
            "Vehicles": {"Drone": {"VehicleType": "SimpleFlight", "X": 0, "Y": 0, "Z": z}},
        }
    )
    for mode, z in (("Multirotor", -2.2), ("ComputerVision", 0))
}
"""By mode. Z is 0 on the ground, but in computer-vision mode at the height of the cubes, 2.5 m."""
MOVES = ((1.0, 0.0), (0.0, -1.0), (0.0, 1.0))
"""Forward, left and right, metres."""


class Client:
    """The methods of AirSim 1.1.7's MultirotorClient, by their names."""

    def __init__(self, port: int = 41451) -> None:
        self._socket = socket.create_connection(("127.0.0.1", port), timeout=60)
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._unpacker = msgpack.Unpacker(raw=True, strict_map_key=False)
        self._number = -1

    def __getattr__(self, method: str) -> Callable[..., Any]:
        """Return a function that calls a method of the server."""
        return functools.partial(self._call, method)

    def _call(self, method: str, *args: Any) -> Any:
        self._number += 1
        packed: Any = msgpack.packb((0, self._number, method, args), use_bin_type=False)
        self._socket.sendall(packed)
        while True:
            for _, _, error, result in self._unpacker:
                if error is not None:
                    raise RuntimeError(error.decode())
                return result if method == "simGetPose" else _record(result)  # as version 1.1.7
            received = self._socket.recv(2**20)
            if not received:
                raise ConnectionError("the server has closed the connection")
            self._unpacker.feed(received)

    def close(self) -> None:
        """Close the connection."""
        self._socket.close()


def _record(value: Any) -> Any:
    if isinstance(value, list):
        return [_record(one) for one in value]
    if isinstance(value, dict):
        return SimpleNamespace(**{key.decode(): one for key, one in value.items()})
    return value


class ChapterEnv:
    """The library of Table 4: moves of one metre, and a reward for each collision."""

    num_cubes, front, side, most_steps = 3, 44.0, 26.0, 300

    def __init__(self, client: Any, *, ignore_collision: bool = True) -> None:
        """Take control of the drone; `ignore_collision` is that of all teleports."""
        self._client, self._ignore_collision = client, ignore_collision
        self.steps = self.cubes = 0
        client.enableApiControl(True)
        client.armDisarm(True)

    def reset(self) -> np.ndarray:
        """Put the drone at the origin; return the first image."""
        self._client.reset()
        self._client.enableApiControl(True)
        self._set_position(0.0, 0.0, 0.0)
        self.steps = self.cubes = 0
        return self.get_image()

    def step(self, action: int) -> tuple[np.ndarray, float, bool, int]:
        """Return image, reward, done and the number of collected cubes (Algorithm 3)."""
        (x, y, z), (dx, dy) = self._get_position(), MOVES[action]
        x, y = x + dx, y + dy
        self._set_position(x, y, z)
        self.steps += 1
        image = self.get_image()
        reward = int(self._client.getCollisionInfo().has_collided)
        self.cubes += reward
        is_outside = x > self.front or abs(y) > self.side
        done = is_outside or self.cubes == self.num_cubes or self.steps == self.most_steps
        return image, float(reward), done, self.cubes

    def get_image(self) -> np.ndarray:
        """Return red, green and blue. Shape: (H, W, 3), uint8."""
        request = {"camera_id": 0, "image_type": 0, "pixels_as_float": False, "compress": False}
        (image,) = self._client.simGetImages([request])
        pixels = np.frombuffer(image.image_data_uint8, np.uint8)
        return pixels.reshape(image.height, image.width, 4)[..., :3].copy()

    def _get_position(self) -> list[float]:
        position = self._client.simGetPose()[b"position"]
        return [position[axis] for axis in (b"x_val", b"y_val", b"z_val")]

    def _set_position(self, x: float, y: float, z: float) -> None:
        position = {"x_val": x, "y_val": y, "z_val": z}
        level = {"x_val": 0.0, "y_val": 0.0, "z_val": 0.0, "w_val": 1.0}
        pose = {"position": position, "orientation": level}
        self._client.simSetPose(pose, self._ignore_collision)


def oracle(image: np.ndarray) -> int:
    """Return the action towards the nearest cube in an image, which fills the most rows."""
    red, green, blue = np.moveaxis(image.astype(int), -1, 0)
    rows = (red > 2 * np.maximum(green, blue)).sum(0)
    highest = rows.max()
    if highest == 0:
        return 0
    columns = np.flatnonzero(rows == highest) + 0.5 - len(rows) / 2
    most_ahead = columns[np.abs(columns).argmin()]
    offset = columns[np.abs(columns - most_ahead) <= highest].mean()
    if abs(offset) <= 0.5 + 0.3 * highest:  # half a pixel, and 0.75 m of a cube of 2.5 m
        return 0
    return 1 if offset < 0 else 2


def fly(env: ChapterEnv, act: Act, episodes: int) -> list[int]:
    """Return the cubes that are collected in each episode."""
    found = []
    for _ in range(episodes):
        image, done = env.reset(), False
        while not done:
            image, _, done, _ = env.step(act(image))
        found.append(env.cubes)
    return found


def train(
    env: ChapterEnv,
    *,
    batches: int = 100,
    frames: int = 1000,
    lr: float = 1.5e-3,
    target: float = 2.97,
    seed: int = 0,
) -> Act:
    """Train drone_rl's network by REINFORCE; return its most probable action.

    Args:
        env: Where to collect episodes.
        batches: Most updates.
        frames: Steps for each update.
        lr: Learning rate.
        target: Mean cubes of the last 100 episodes at which the training ends.
        seed: Of weights and actions.
    """
    import gymnasium
    import torch
    from tensordict import TensorDict
    from torchrl.collectors import Collector
    from torchrl.envs import Compose, GymWrapper, RewardSum, TransformedEnv

    from drone_rl.envs import GrayPixels, StandardizePixels
    from drone_rl.objectives import LeaveOneOut, ReinforceLoss
    from drone_rl.policies import SmallCNN, make_actor

    class GymEnv(gymnasium.Env):
        action_space = gymnasium.spaces.Discrete(len(MOVES))
        observation_space = gymnasium.spaces.Dict(
            {"pixels": gymnasium.spaces.Box(0, 255, env.reset().shape, np.uint8)}
        )

        def reset(self, *, seed: Any = None, options: Any = None) -> Any:
            return {"pixels": env.reset()}, {}

        def step(self, action: Any) -> Any:
            image, reward, done, _ = env.step(int(action))
            return {"pixels": image}, reward, done, False, {}

    wrapped: Any = GymWrapper(env=GymEnv(), categorical_action_encoding=True)
    wrapped = TransformedEnv(wrapped, Compose(GrayPixels(), StandardizePixels(), RewardSum()))
    pixels_of = Compose(GrayPixels(), StandardizePixels())
    generator = torch.Generator().manual_seed(seed)
    shape = wrapped.observation_spec["pixels"].shape
    network = SmallCNN(shape, len(MOVES), hidden=(128,), generator=generator)
    actor = make_actor(network, wrapped.action_spec, generator)
    collector = Collector(
        wrapped,
        actor,
        frames_per_batch=frames,
        total_frames=frames * batches,
        reset_at_each_iter=True,
        postproc=LeaveOneOut(0.95, scale=True),
        auto_register_policy_transforms=False,
    )
    loss = ReinforceLoss(actor, entropy_coeff=0.0)
    optimizer = torch.optim.Adam(loss.parameters(), lr=lr)
    cubes: deque[float] = deque(maxlen=100)
    for number, batch in enumerate(collector, 1):
        cubes += batch["next", "episode_reward"][batch["next", "done"]].tolist()
        print(f"{number * frames} frames: {np.mean(cubes):.2f} cubes an episode", flush=True)
        if len(cubes) == cubes.maxlen and np.mean(cubes) >= target:
            break
        optimizer.zero_grad()
        loss(batch)["loss_actor"].backward()
        optimizer.step()
    collector.shutdown(close_env=False)

    @torch.no_grad()
    def act(image: np.ndarray) -> int:
        pixels = pixels_of(TensorDict({"pixels": torch.tensor(image)}))["pixels"]
        return int(network(pixels).argmax())

    return act


def main(command: str = "oracle", choice: str = "") -> None:
    """Print the settings of a mode, or fly 20 episodes by the oracle, or train and fly 100.

    `choice` is the mode, else the port.
    """
    if command == "settings":
        print(SETTINGS[choice or "Multirotor"])
        return
    try:
        from AirSimClient import MultirotorClient  # pyright: ignore[reportMissingImports]

        client = MultirotorClient()  # its port is always 41451
        client.confirmConnection()
    except ImportError:
        client = Client(int(choice or 41451))
    env = ChapterEnv(client)
    cubes = fly(env, train(env), 100) if command == "train" else fly(env, oracle, 20)
    print(f"{np.mean(cubes):.2f} cubes, all three in {np.mean(np.equal(cubes, 3)):.0%}")


if __name__ == "__main__":
    main(*sys.argv[1:])
