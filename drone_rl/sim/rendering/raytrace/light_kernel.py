"""Light on what rays hit in scenes of any geoms, and their sky, as MuJoCo's OpenGL has them.

OpenGL lights corners of triangles and interpolates their colors: see `corners_kernel`. Each light
that casts shadows is added in a pass of its own, clipped at white; a shadow removes all of it, also
its ambient part.
"""

import mujoco
import warp as wp

from drone_rl.sim.rendering.raytrace.cast_kernel import World
from drone_rl.sim.rendering.raytrace.projection_kernel import frame_attitude, rotation
from drone_rl.sim.rendering.raytrace.spans_kernel import fill
from drone_rl.sim.rendering.raytrace.structs_kernel import Camera, ViewArrays, struct
from drone_rl.sim.rendering.raytrace.surfaces_kernel import Surfaces
from drone_rl.sim.rendering.raytrace.texels_kernel import (
    Image,
    Textures,
    get_image,
    sample_cube,
)

wp.set_module_options({"enable_backward": False, "fuse_fp": False})

SPOT = wp.constant(int(mujoco.mjtLightType.mjLIGHT_SPOT))
DIRECTIONAL = wp.constant(int(mujoco.mjtLightType.mjLIGHT_DIRECTIONAL))
POINT = wp.constant(int(mujoco.mjtLightType.mjLIGHT_POINT))
CAMERA_FRAME = wp.constant(-1)
"""Frame of a headlight that is on in all environments."""

_HIDDEN = wp.constant(-5000.0)
"""Metres: a frame below is out of sight, and so are its lights and its sky."""
MOST_LIGHTS = wp.constant(8)
"""Lights that OpenGL has: later ones are off."""
_GLOBAL = wp.constant(0.3)
"""Ambient light of a scene without lights, as MuJoCo has it."""


@struct
class Light:
    """A light in its frame; its colors are in `Lighting`."""

    kind: int
    frame: int
    position: wp.vec3
    direction: wp.vec3
    attenuation: wp.vec3
    """Constant, linear and quadratic."""
    least_cosine: float
    """Of the angle to the axis of a spot light; -2 for all directions."""
    exponent: float
    """Power of that cosine."""
    range: float
    """Metres; the light ends there. Infinite for none."""
    casts: int
    """Whether it casts shadows."""
    is_head: int
    """Whether it shines along the camera's axis."""
    is_sun: int
    """Whether it is the first directional light of its frame."""


@struct
class PlacedLight:
    """A light of one environment and one camera, world frame."""

    kind: int
    position: wp.vec3
    direction: wp.vec3
    attenuation: wp.vec3
    least_cosine: float
    exponent: float
    range: float
    casts: int
    ambient: wp.vec3
    diffuse: wp.vec3
    specular: wp.vec3


@struct
class Lighting:
    """Lights and sky; the first dimension of colors: one for all environments or one each."""

    lights: wp.array[Light]
    ambient: wp.array2d[wp.vec3]
    diffuse: wp.array2d[wp.vec3]
    specular: wp.array2d[wp.vec3]
    shadows: wp.array[int]
    """Whether lights cast shadows."""
    skies: wp.array[wp.vec2i]
    """Texture of each skybox, and its frame."""
    horizon: wp.array[wp.vec3]
    """Color of the sky, 0 to 1; red below 0 for the scene's own."""
    zenith: wp.array[wp.vec3]
    sun: wp.array[wp.vec3]
    """Direction of light that travels from the sun; 0 for the model's."""
    haze: wp.array[wp.vec3]
    """Color of fog, 0 to 1."""
    extinction: wp.array[float]
    """Of fog, per metre; 0 for clear air."""
    exposure: wp.array[float]
    """Factor of all light."""


@struct
class Look:
    """Materials, textures, lights and sky of a batch of environments."""

    lighting: Lighting
    surfaces: Surfaces
    textures: Textures
    placed: wp.array2d[PlacedLight]
    """Working memory: a row for each worker."""
    keys: wp.array2d[wp.vec4i]
    """Corners whose colors are known, in working memory: see `shade_kernel`."""
    known: wp.array2d[wp.vec3]
    """Their colors, by group of lights: see `Shot.lit`."""
    lit: wp.array2d[wp.vec3]
    slopes: wp.array2d[wp.vec3]


@struct
class Shot:
    """What all pixels of an image share."""

    env: int
    position: wp.vec3
    """Of the camera, world frame, as all directions."""
    far: float
    """Metres along the axis beyond which nothing is rendered."""
    forward: wp.vec3
    right: wp.vec3
    """Step between pixels at distance 1 along the axis."""
    down: wp.vec3
    pixel: float
    """Length of `right`."""
    lights: wp.array[PlacedLight]
    count: int
    """Lights that are on; the array is longer."""
    num_casting: int
    """How many of them cast shadows."""
    ambient: float
    exposure: float
    horizon: wp.vec3
    """See `Lighting`."""
    zenith: wp.vec3
    haze: wp.vec3
    extinction: float
    skybox: Image
    """Texture of the sky, of width 0 for none."""
    keys: wp.array[wp.vec4i]
    known: wp.array[wp.vec3]
    lit: wp.array[wp.vec3]
    """What a point reflects of all lights without shadows, and of each that casts shadows."""
    slopes: wp.array[wp.vec3]
    """Light on two patches, by group of lights: of each half at coordinates (0, 0) and its change
    along each coordinate; see `corners_kernel`."""


@wp.func
def start_image(
    look: Look,
    world: World,
    view: ViewArrays,
    camera: Camera,
    env: int,
    worker: int,
    position: wp.vec3,
    to_world: wp.mat33,
) -> Shot:
    """Place the lights of an environment in row `worker` of `Look.placed`.

    `position` is that of the camera, and `to_world` rotates from its frame.
    """
    shot = Shot()
    pixel_width = 2.0 * camera.half_width / float(view.width)
    pixel_height = 2.0 * camera.half_height / float(view.height)
    shot.far = view.far
    shot.env = env
    shot.position = position
    shot.forward = -wp.vec3(to_world[0, 2], to_world[1, 2], to_world[2, 2])
    shot.right = pixel_width * wp.vec3(to_world[0, 0], to_world[1, 0], to_world[2, 0])
    shot.down = -pixel_height * wp.vec3(to_world[0, 1], to_world[1, 1], to_world[2, 1])
    shot.pixel = pixel_width
    shot.lights = look.placed[worker]
    shot.ambient = _GLOBAL
    light = int(0)
    while light < look.lighting.lights.shape[0]:
        placed = _place_light(look.lighting, light, env)
        frame = look.lighting.lights[light].frame
        if look.lighting.lights[light].is_head != 0:
            placed.direction = shot.forward
        else:
            turn = rotation(frame_attitude(frame, world.poses.attitudes[env]))
            placed.position = world.poses.positions[env, frame] + turn @ placed.position
            placed.direction = turn @ placed.direction
            sun = look.lighting.sun[env % look.lighting.sun.shape[0]]
            if look.lighting.lights[light].is_sun != 0 and wp.length_sq(sun) > 0.0:
                placed.direction = sun
        is_on = frame == CAMERA_FRAME or not _is_hidden(world, env, frame)
        if is_on and shot.count < MOST_LIGHTS:
            shot.lights[shot.count] = placed
            shot.count += 1
            if placed.casts != 0:
                shot.num_casting += 1
            if placed.kind != POINT:
                shot.ambient = 0.0
        light += 1
    shot.skybox = _find_sky(look, world, env)
    lighting = look.lighting
    shot.horizon = lighting.horizon[env % lighting.horizon.shape[0]]
    shot.zenith = lighting.zenith[env % lighting.zenith.shape[0]]
    shot.haze = lighting.haze[env % lighting.haze.shape[0]]
    shot.extinction = lighting.extinction[env % lighting.extinction.shape[0]]
    shot.exposure = lighting.exposure[env % lighting.exposure.shape[0]]
    shot.keys = look.keys[worker]
    shot.known = look.known[worker]
    shot.lit = look.lit[worker]
    shot.slopes = look.slopes[worker]
    fill(shot.keys, 0, shot.keys.shape[0], wp.vec4i(-1, 0, 0, 0))
    return shot


@wp.func
def _find_sky(look: Look, world: World, env: int) -> Image:
    """Return the texture of the first skybox of an environment."""
    found = Image()
    sky = int(0)
    while sky < look.lighting.skies.shape[0]:
        if found.width == 0 and not _is_hidden(world, env, look.lighting.skies[sky][1]):
            found = get_image(look.textures, look.lighting.skies[sky][0])
        sky += 1
    return found


@wp.func
def _is_hidden(world: World, env: int, frame: int) -> bool:
    return world.poses.positions[env, frame][2] < _HIDDEN


@wp.func
def _place_light(lighting: Lighting, number: int, env: int) -> PlacedLight:
    """Return a light with its colors, still in its frame."""
    light = lighting.lights[number]
    row = env % lighting.ambient.shape[0]
    placed = PlacedLight()
    placed.kind = light.kind
    placed.position = light.position
    placed.direction = light.direction
    placed.attenuation = light.attenuation
    placed.least_cosine = light.least_cosine
    placed.exponent = light.exponent
    placed.range = light.range
    placed.casts = light.casts * lighting.shadows[env % lighting.shadows.shape[0]]
    placed.ambient = lighting.ambient[row, number]
    placed.diffuse = lighting.diffuse[row, number]
    placed.specular = lighting.specular[row, number]
    return placed


@wp.func
def sky(texels: wp.array[wp.uint32], ray: wp.vec3, shot: Shot) -> wp.vec3:
    """Return the color, 0 to 1, of a ray that hits nothing.

    `ray`: world frame, with length 1 along the camera's axis.
    """
    color = wp.vec3()
    if shot.horizon[0] >= 0.0:
        up = wp.max(wp.normalize(ray)[2], 0.0)
        color = shot.horizon + up * (shot.zenith - shot.horizon)
    elif shot.skybox.width > 0:
        right, down = _turn_sky(shot.right), _turn_sky(shot.down)
        color = sample_cube(texels, shot.skybox, _turn_sky(ray), right, down)
    return clip(shot.exposure * color)


@wp.func
def clip(color: wp.vec3) -> wp.vec3:
    """Return a color with its parts between 0 and 1."""
    return wp.vec3(
        wp.clamp(color[0], 0.0, 1.0), wp.clamp(color[1], 0.0, 1.0), wp.clamp(color[2], 0.0, 1.0)
    )


@wp.func
def _turn_sky(ray: wp.vec3) -> wp.vec3:
    """Return a direction in the frame of a skybox's cube map."""
    return wp.vec3(ray[0], ray[2], -ray[1])


@wp.func
def finish(color: wp.vec3, distance: float, shot: Shot) -> wp.vec3:
    """Return the color of a surface at a distance, metres, with exposure and fog."""
    total = clip(shot.exposure * color)
    if shot.extinction > 0.0:
        clear = wp.exp(-shot.extinction * distance)
        total = shot.haze + clear * (total - shot.haze)
    return total


@wp.func_native(f"""
using vec = wp::vec_t<3, float>;
vec total = group < 0 ? color * (shine[0] + ambient) : vec(0.0f);
const vec to_eye = shine[1] > 0.0f ? wp::normalize(eye - place) : vec(0.0f);
for (int k = group < 0 ? 0 : group; k < (group < 0 ? count : group + 1); ++k) {{
    const auto &light = lights.data[k];
    if (group < 0 && has_shadows && light.casts) continue;
    vec to_light = -light.direction;
    float strength = 1.0f;
    if (light.kind != {int(DIRECTIONAL)}) {{
        to_light = light.position - place;
        const float distance = wp::length(to_light);
        to_light = to_light / wp::max(distance, 1e-9f);
        const vec fade = light.attenuation;
        strength = 1.0f / wp::max(fade[0] + distance * (fade[1] + distance * fade[2]), 1e-6f);
        if (distance > light.range) continue;
        if (light.least_cosine > -1.5f) {{
            const float cosine = -wp::dot(to_light, light.direction);
            if (cosine < light.least_cosine) continue;
            strength *= wp::pow(cosine, light.exponent);
        }}
    }}
    const float facing = wp::dot(normal, to_light);
    vec reflected = light.ambient;
    if (facing > 0.0f) reflected = reflected + light.diffuse * facing;
    vec lit = wp::cw_mul(color, reflected);
    if (facing > 0.0f && shine[1] > 0.0f) {{
        const float cosine = wp::max(wp::dot(normal, wp::normalize(to_light + to_eye)), 0.0f);
        lit = lit + light.specular * (shine[1] * wp::pow(cosine, shine[2]));
    }}
    total = total + lit * strength;
}}
for (int c = 0; c < 3; ++c) total[c] = wp::min(wp::max(total[c], 0.0f), 1.0f);
return total;
""")
def light_point(
    lights: wp.array[PlacedLight],
    count: int,
    group: int,
    has_shadows: bool,
    ambient: float,
    eye: wp.vec3,
    place: wp.vec3,
    normal: wp.vec3,
    color: wp.vec3,
    shine: wp.vec3,
) -> wp.vec3:
    """Return what a point reflects of one light, or of all and what it emits: OpenGL's formula.

    `group` is the light, or -1 for all, of which those that cast shadows are left out if
    `has_shadows`. Camera `eye`, `place` and `normal` are in the world frame.
    """
    ...
