"""Make the files of the shipped scenes: `python -m tools.scenes`.

indoor.xml is written by hand. This script makes its meshes and textures, and all of outdoor.xml:
trees and rocks stand on a height field, so their heights follow from it.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

Points = NDArray[np.float64]
Triangles = NDArray[np.int64]
Mesh = tuple[Points, Triangles]

FILES = Path(__file__).parents[1] / "drone_rl" / "sim" / "scenes" / "files"
HALF = 30.0
"""Half of the edge of the outdoor scene, metres."""
CELLS = 96
"""Points of its height field along one edge."""
TOP = 5.0
"""Its greatest height, metres."""


def grid_faces(rows: int, columns: int) -> Triangles:
    """Return the triangles between `rows` rings of `columns` points, each ring closed."""
    row, column = np.meshgrid(np.arange(rows - 1), np.arange(columns), indexing="ij")
    right = (column + 1) % columns
    a, b = row * columns + column, row * columns + right
    c, d = a + columns, b + columns
    return np.concatenate(
        [np.stack([a, b, d], -1).reshape(-1, 3), np.stack([a, d, c], -1).reshape(-1, 3)]
    )


def closed(rings: Points) -> Mesh:
    """Return the closed surface through rings of points (rows, columns, 3), from below to above."""
    rows, columns, _ = rings.shape
    points = np.concatenate([rings.reshape(-1, 3), rings[[0, -1]].mean(1)])
    first, last = len(points) - 2, len(points) - 1
    i = np.arange(columns)
    right = (i + 1) % columns
    low = np.stack([np.full(columns, first), right, i], -1)
    base = (rows - 1) * columns
    high = np.stack([np.full(columns, last), base + i, base + right], -1)
    return points, np.concatenate([grid_faces(rows, columns), low, high])


def joined(*meshes: Mesh) -> Mesh:
    """Return several meshes as one."""
    points, faces, count = [], [], 0
    for one, triangles in meshes:
        points.append(one)
        faces.append(triangles + count)
        count += len(one)
    return np.concatenate(points), np.concatenate(faces)


def directions(rows: int, columns: int) -> Points:
    """Return unit vectors on rings from below to above, none parallel to an axis's plane."""
    up = np.pi * ((np.arange(rows) + 0.5) / rows - 0.5)
    around = 2 * np.pi * (np.arange(columns) + 0.5) / columns
    cos = np.cos(up)[:, None]
    z = np.broadcast_to(np.sin(up)[:, None], (rows, columns))
    return np.stack([cos * np.cos(around), cos * np.sin(around), z], -1)


def cushion(center: tuple, half: tuple, radius: float, detail: int = 8) -> Mesh:
    """Return a box with rounded edges."""
    unit = directions(detail, 2 * detail)
    inner = np.array(half) - radius
    return closed(np.array(center) + np.sign(unit) * inner + radius * unit)


def turned(profile: list[tuple[float, float]], columns: int = 16) -> Mesh:
    """Return the surface of revolution of (radius, height), from below to above."""
    around = 2 * np.pi * np.arange(columns) / columns
    ring = np.stack([np.cos(around), np.sin(around)], -1)
    rings = [np.column_stack([radius * ring, np.full(columns, z)]) for radius, z in profile]
    return closed(np.array(rings))


def leaf(angle: float, lift: float, length: float) -> Mesh:
    """Return a thin leaf that grows from (0, 0, 0.35), bends outwards and hangs."""
    along = np.linspace(0.02, 0.98, 12)
    around = 2 * np.pi * np.arange(8) / 8
    wide = 0.09 * np.sin(np.pi * along) + 0.004
    rings = np.zeros((12, 8, 3))
    rings[..., 0] = (length * along)[:, None] - 0.012 * np.sin(around)
    rings[..., 1] = wide[:, None] * np.cos(around)
    rings[..., 2] = (0.35 + lift * along - 0.6 * along**2)[:, None] + 0.012 * np.sin(around)
    cos, sin = np.cos(angle), np.sin(angle)
    turn = np.array([[cos, sin, 0], [-sin, cos, 0], [0, 0, 1]])
    return closed(rings @ turn)


def sofa() -> Mesh:
    """A sofa of 2 x 0.9 m, its back to the south."""
    seats = [cushion((x, 0.08, 0.42), (0.4, 0.35, 0.1), 0.07) for x in (-0.41, 0.41)]
    backs = [cushion((x, -0.3, 0.68), (0.4, 0.12, 0.22), 0.08) for x in (-0.41, 0.41)]
    arms = [cushion((x, 0, 0.35), (0.12, 0.45, 0.28), 0.08) for x in (-0.9, 0.9)]
    return joined(cushion((0, 0, 0.2), (0.95, 0.44, 0.14), 0.04), *seats, *backs, *arms)


def chair() -> Mesh:
    """A chair of 0.45 x 0.45 m, 0.9 m high, its back to the north."""
    legs = [turned([(0.018, 0), (0.025, 0.2), (0.022, 0.43)], 10) for _ in range(4)]
    corners = [(-0.18, -0.18), (0.18, -0.18), (-0.18, 0.18), (0.18, 0.18)]
    placed = [(leg[0] + [x, y, 0], leg[1]) for leg, (x, y) in zip(legs, corners, strict=True)]
    seat = cushion((0, 0, 0.45), (0.22, 0.22, 0.03), 0.025, 10)
    back = cushion((0, 0.2, 0.74), (0.2, 0.02, 0.13), 0.018, 10)
    posts = [
        (post[0] + [x, 0.2, 0.44], post[1])
        for x in (-0.17, 0.17)
        for post in [turned([(0.02, 0), (0.016, 0.44)], 10)]
    ]
    return joined(seat, back, *placed, *posts)


def plant() -> Mesh:
    """A plant in a pot, 0.9 m high."""
    pot = turned([(0.13, 0), (0.15, 0.02), (0.2, 0.3), (0.21, 0.36), (0.17, 0.36), (0.16, 0.3)])
    leaves = [leaf(2.4 * i, 0.75 + 0.1 * (i % 4), 0.3 + 0.04 * (i % 3)) for i in range(9)]
    return joined(pot, *leaves)


def lump(seed: int, rows: int, bumps: float) -> Mesh:
    """Return a ball of radius 1 with bumps: a crown or a rock."""
    unit = directions(rows, 2 * rows)
    rng = np.random.default_rng(seed)
    waves = rng.normal(size=(6, 3)) * 2.5
    phases = rng.uniform(0, 2 * np.pi, 6)
    radius = 1 + bumps * np.sin(unit @ waves.T + phases).mean(-1, keepdims=True)
    return closed(unit * radius)


def write_mesh(name: str, mesh: Mesh) -> None:
    """Write a mesh as OBJ."""
    points, faces = mesh
    lines = [f"v {x:.4f} {y:.4f} {z:.4f}" for x, y, z in points]
    lines += [f"f {a} {b} {c}" for a, b, c in faces + 1]
    text = "\n".join(["# Made by tools/scenes.py", *lines]) + "\n"
    (FILES / "assets" / f"{name}.obj").write_text(text)


def write_texture(name: str, values: Points) -> None:
    """Write an image of values in [0, 1], shape (rows, columns, 3) or (rows, columns)."""
    pixels = np.clip(255 * values + 0.5, 0, 255).astype(np.uint8)
    image = Image.fromarray(pixels)
    if values.ndim == 3:
        image = image.quantize(16)
    image.convert("RGB" if values.ndim == 3 else "L").save(
        FILES / "assets" / f"{name}.png", optimize=True
    )


def planks() -> Points:
    """Wooden planks along x, each of another shade."""
    rng = np.random.default_rng(1)
    shade = np.repeat(rng.uniform(0.8, 1.05, (8, 2)), 8, 0).repeat(32, 1)
    shade *= 1 + 0.03 * np.repeat(rng.normal(size=(64, 1)), 64, 1)
    shade[::8] *= 0.6
    shade[:, 31] *= 0.8
    return shade[..., None] * np.array([0.72, 0.5, 0.3])


def speckled(color: tuple, seed: int) -> Points:
    """A plain color with noise that repeats without seams."""
    noise = np.random.default_rng(seed).normal(size=(64, 64))
    near = np.zeros((64, 64))
    for shift in np.ndindex(3, 3):
        near += np.roll(noise, shift, (0, 1))
    return (1 + 0.07 * near / 3)[..., None] * np.array(color)


def heights() -> Points:
    """Return the heights of the outdoor scene, metres. Shape: (y, x)."""
    axis = np.linspace(-1, 1, CELLS)
    y, x = np.meshgrid(axis, axis, indexing="ij")
    z = 0.8 * np.sin(3.1 * x + 0.5) * np.cos(2.7 * y) + 0.45 * np.sin(6.3 * x - 4.1 * y)
    z += 0.25 * np.cos(9.1 * y + 1) * np.sin(7.7 * x)
    rim = np.maximum(np.abs(x), np.abs(y))
    z += 3.0 * np.clip((rim - 0.75) / 0.25, 0, 1) ** 2
    level = np.round(255 * (z - z.min()) / (z.max() - z.min()))
    return TOP * level / 255


def height_at(field: Points, x: float, y: float) -> float:
    """Return the height at a place, between the points of the field."""
    column, row = ((v / HALF + 1) / 2 * (CELLS - 1) for v in (x, y))
    i, j = min(int(row), CELLS - 2), min(int(column), CELLS - 2)
    s, t = row - i, column - j
    low = (1 - t) * field[i, j] + t * field[i, j + 1]
    high = (1 - t) * field[i + 1, j] + t * field[i + 1, j + 1]
    return float((1 - s) * low + s * high)


def scattered(rng: np.random.Generator, count: int, apart: float, taken: list) -> list:
    """Return places at least `apart` metres from each other, from starts and from the goal."""
    found: list[tuple[float, float]] = []
    while len(found) < count:
        x, y = rng.uniform(-24, 24, 2).tolist()
        if all(np.hypot(x - a, y - b) >= apart for a, b in taken + found):
            found.append((x, y))
    return found


def outdoor() -> str:
    """Return the outdoor scene as MJCF."""
    field = heights()
    write_texture("hills", field[::-1] / TOP)
    rng = np.random.default_rng(5)
    start, goal = (-22.0, -20.0), (21.0, 19.0)
    taken = [start, goal, (start[0] + 4, start[1]), (start[0], start[1] + 4)]
    trees = scattered(rng, 26, 4.5, taken)
    rocks = scattered(rng, 12, 3.5, taken + trees)
    geoms = []
    for i, (x, y) in enumerate(trees):
        z = height_at(field, x, y)
        tall = float(rng.uniform(2.2, 3.6))
        geoms.append(
            f'    <body name="tree_{i}" pos="{x:.2f} {y:.2f} {z - 0.2:.2f}">\n'
            f'      <geom class="trunk" fromto="0 0 0 0 0 {tall:.2f}"/>\n'
        )
        if i % 3 == 2:
            geoms.append(f'      <geom class="fir" pos="0 0 {tall + 1:.2f}"/>\n    </body>\n')
        else:
            kind = ("oak", "birch")[i % 3]
            turn = rng.uniform(0, 360)
            geoms.append(
                f'      <geom class="{kind}" pos="0 0 {tall + 0.9:.2f}" euler="0 0 {turn:.0f}"/>\n'
                "    </body>\n"
            )
    for i, (x, y) in enumerate(rocks):
        z = height_at(field, x, y) + 0.15
        turn = rng.uniform(0, 360)
        kind = ("rock", "boulder")[i % 2]
        geoms.append(
            f'    <geom name="rock_{i}" class="{kind}" pos="{x:.2f} {y:.2f} {z:.2f}" '
            f'euler="0 0 {turn:.0f}"/>\n'
        )
    ground = height_at(field, *goal)
    high = height_at(field, *start)
    return OUTDOOR.format(
        half=HALF, top=TOP, geoms="".join(geoms).rstrip(),
        start=f"{start[0]:g} {start[1]:g} {high + 1.8:.2f}",
        goal=f"{goal[0]:g} {goal[1]:g} {ground + 2:.2f}",
        post=f"{goal[0]:g} {goal[1]:g} {ground + 0.6:.2f}",
    )  # fmt: skip


OUTDOOR = """\
<!-- Hills with trees and rocks, 60 x 60 m, made by tools/scenes.py. Metres, z up.
     Episodes start in the south-west; the goal is above the red post in the north-east. -->
<mujoco model="outdoor">
  <compiler angle="degree"/>
  <visual>
    <headlight ambient="0.35 0.35 0.38" diffuse="0 0 0" specular="0 0 0"/>
    <map znear="0.002" zfar="3"/>
    <global offwidth="1024" offheight="1024"/>
    <quality shadowsize="4096"/>
  </visual>
  <statistic center="0 0 2" extent="60"/>

  <asset>
    <texture name="sky" type="skybox" builtin="gradient" rgb1="0.85 0.92 1" rgb2="0.3 0.5 0.85"
             width="64" height="384"/>
    <texture name="grass" type="2d" file="assets/grass.png"/>
    <material name="grass" texture="grass" texrepeat="20 20" specular="0"/>
    <material name="bark" rgba="0.36 0.25 0.16 1" specular="0"/>
    <material name="stone" rgba="0.5 0.49 0.47 1" specular="0.1"/>
    <hfield name="hills" file="assets/hills.png" size="{half:g} {half:g} {top:g} 1"/>
    <mesh name="oak" file="assets/crown.obj" scale="1.7 1.7 1.4"/>
    <mesh name="birch" file="assets/crown.obj" scale="1.1 1.1 1.5"/>
    <mesh name="rock" file="assets/rock.obj" scale="0.8 0.6 0.5"/>
    <mesh name="boulder" file="assets/rock.obj" scale="1.1 1.3 0.9"/>
  </asset>

  <default>
    <site group="4"/>
    <default class="trunk">
      <geom type="capsule" size="0.18" material="bark"/>
    </default>
    <default class="fir">
      <geom type="ellipsoid" size="0.9 0.9 1.9" rgba="0.1 0.3 0.16 1"/>
    </default>
    <default class="oak">
      <geom type="mesh" mesh="oak" rgba="0.2 0.42 0.12 1"/>
    </default>
    <default class="birch">
      <geom type="mesh" mesh="birch" rgba="0.45 0.55 0.15 1"/>
    </default>
    <default class="rock">
      <geom type="mesh" mesh="rock" material="stone"/>
    </default>
    <default class="boulder">
      <geom type="mesh" mesh="boulder" material="stone"/>
    </default>
  </default>

  <worldbody>
    <light name="sun" type="directional" dir="0.5 0.6 -1" diffuse="0.75 0.72 0.65"
           specular="0.1 0.1 0.1"/>
    <geom name="hills" type="hfield" hfield="hills" material="grass"/>
    <geom name="post" type="cylinder" pos="{post}" size="0.25 0.7" rgba="0.85 0.1 0.1 1"/>
{geoms}

    <site name="start" type="box" pos="{start}" size="4 4 0.5"/>
    <site name="goal" type="sphere" pos="{goal}" size="0.5"/>
  </worldbody>
</mujoco>
"""


def main() -> None:
    """Write all files."""
    (FILES / "assets").mkdir(parents=True, exist_ok=True)
    for name, mesh in (
        ("sofa", sofa()),
        ("chair", chair()),
        ("plant", plant()),
        ("crown", lump(2, 12, 0.35)),
        ("rock", lump(7, 9, 0.3)),
    ):
        write_mesh(name, mesh)
        print(f"{name}.obj: {len(mesh[1])} triangles")
    write_texture("planks", planks())
    write_texture("carpet", speckled((0.5, 0.46, 0.58), 3))
    write_texture("grass", speckled((0.36, 0.5, 0.22), 4))
    (FILES / "outdoor.xml").write_text(outdoor())


if __name__ == "__main__":
    main()
