"""Light on what rays hit in scenes of any geoms, and their sky, as MuJoCo's OpenGL has them.

OpenGL lights corners of triangles and interpolates their colors: see `corners_kernel`. Each light
that casts shadows is added in a pass of its own, clipped at white; a shadow removes all of it, also
its ambient part.
"""

import mujoco
import warp as wp

from drone_rl.sim.rendering.raytrace.cast_kernel import Hit, World, cast, is_blocked
from drone_rl.sim.rendering.raytrace.corners_kernel import Corners, find_corners
from drone_rl.sim.rendering.raytrace.intersection_kernel import PLANE
from drone_rl.sim.rendering.raytrace.projection_kernel import frame_attitude, rotation
from drone_rl.sim.rendering.raytrace.structs_kernel import NO_GEOM, Camera, ViewArrays, struct
from drone_rl.sim.rendering.raytrace.surfaces_kernel import Surfaces, sample_surface
from drone_rl.sim.rendering.raytrace.texels_kernel import Textures, sample_cube

wp.set_module_options({"enable_backward": False, "fuse_fp": False})

SPOT = wp.constant(int(mujoco.mjtLightType.mjLIGHT_SPOT))
DIRECTIONAL = wp.constant(int(mujoco.mjtLightType.mjLIGHT_DIRECTIONAL))
POINT = wp.constant(int(mujoco.mjtLightType.mjLIGHT_POINT))
CAMERA_FRAME = wp.constant(-1)
"""Frame of the headlight."""

_HIDDEN = wp.constant(-50.0)
"""Metres: a frame below is out of sight, and so are its lights and its sky."""
_OPAQUE = wp.constant(0.995)
"""Opacity from which OpenGL lets nothing through."""
_LAYERS = wp.constant(4)
"""Transparent surfaces that a ray passes."""
_OFF = wp.constant(1e-4)
"""How far off a surface rays to lights start, relative to the distance from the shot."""
_FROM_BEHIND = wp.constant(0.3)
"""Factor of the opacity of planes that are seen from behind."""
_MOST_LIGHTS = wp.constant(8)
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
    lights: wp.array[PlacedLight]
    count: int
    """Lights that are on; the array is longer."""
    ambient: float
    skybox: int
    """Texture of the sky; -1 for none."""


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
    shot.lights = look.placed[worker]
    shot.ambient = _GLOBAL
    light = int(0)
    while light < look.lighting.lights.shape[0]:
        placed = _place_light(look.lighting, light, env)
        frame = look.lighting.lights[light].frame
        if frame == CAMERA_FRAME:
            placed.direction = shot.forward
        else:
            turn = rotation(frame_attitude(frame, world.poses.attitudes[env]))
            placed.position = world.poses.positions[env, frame] + turn @ placed.position
            placed.direction = turn @ placed.direction
            sun = look.lighting.sun[env % look.lighting.sun.shape[0]]
            if look.lighting.lights[light].is_sun != 0 and wp.length_sq(sun) > 0.0:
                placed.direction = sun
        is_on = frame == CAMERA_FRAME or not _is_hidden(world, env, frame)
        if is_on and shot.count < _MOST_LIGHTS:
            shot.lights[shot.count] = placed
            shot.count += 1
            if placed.kind != POINT:
                shot.ambient = 0.0
        light += 1
    shot.skybox = -1
    sky = int(0)
    while sky < look.lighting.skies.shape[0]:
        if shot.skybox < 0 and not _is_hidden(world, env, look.lighting.skies[sky][1]):
            shot.skybox = look.lighting.skies[sky][0]
        sky += 1
    return shot


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
def sky(look: Look, direction: wp.vec3, shot: Shot) -> wp.vec3:
    """Return the color, 0 to 1, of a ray that hits nothing. `direction`: world frame."""
    lighting = look.lighting
    color = lighting.horizon[shot.env % lighting.horizon.shape[0]]
    if color[0] >= 0.0:
        zenith = lighting.zenith[shot.env % lighting.zenith.shape[0]]
        color += wp.max(direction[2], 0.0) * (zenith - color)
    elif shot.skybox >= 0:
        ray = direction / wp.dot(direction, shot.forward)
        right, down = _turn_sky(shot.right), _turn_sky(shot.down)
        color = sample_cube(look.textures, shot.skybox, _turn_sky(ray), right, down)
    else:
        color = wp.vec3()
    return _clip(lighting.exposure[shot.env % lighting.exposure.shape[0]] * color)


@wp.func
def _turn_sky(ray: wp.vec3) -> wp.vec3:
    """Return a direction in the frame of a skybox's cube map."""
    return wp.vec3(ray[0], ray[2], -ray[1])


@wp.func
def shade(look: Look, world: World, hit: Hit, direction: wp.vec3, shot: Shot) -> wp.vec3:
    """Return the color, 0 to 1, of what a ray hits, and of what is behind transparent surfaces.

    `direction` is that of the ray, world frame.
    """
    far = shot.far / wp.dot(direction, shot.forward)
    total = wp.vec3()
    left = float(1.0)
    layer = int(0)
    behind = hit
    passed = float(0.0)
    while layer < _LAYERS and behind.geom != NO_GEOM:
        opacity = _rgba(look, shot.env, behind.geom)[3]
        if behind.kind == PLANE and behind.local_normal[2] < 0.0:
            opacity *= _FROM_BEHIND
        if opacity < _OPAQUE and layer + 1 < _LAYERS:
            # OpenGL blends each transparent geom twice, from front to back and then back to front
            share = opacity * (2.0 - opacity)
            total += left * share * _shade_surface(look, world, behind, direction, shot, False)
            left *= 1.0 - share
            passed += behind.distance + _OFF * (1.0 + passed)
            beyond = shot.position + passed * direction
            behind = cast(world, shot.env, beyond, direction, far - passed)
            layer += 1
        else:
            total += left * _shade_surface(look, world, behind, direction, shot, True)
            left = 0.0
            layer = _LAYERS
    if left > 0.0:
        total += left * sky(look, direction, shot)
    return total


@wp.func
def _rgba(look: Look, env: int, geom: int) -> wp.vec4:
    return look.surfaces.color[env % look.surfaces.color.shape[0], geom]


@wp.func
def _shade_surface(
    look: Look, world: World, hit: Hit, direction: wp.vec3, shot: Shot, has_shadows: bool
) -> wp.vec3:
    depth = wp.dot(hit.point - shot.position, shot.forward)
    corners = find_corners(look.surfaces, world, hit, shot.position, depth * wp.length(shot.right))
    total = _light_by_group(look, hit, corners, shot, -1, has_shadows)
    light = int(0)
    while light < shot.count and has_shadows:
        if shot.lights[light].casts != 0:
            lit = _light_by_group(look, hit, corners, shot, light, True)
            if wp.length_sq(lit) > 0.0 and not _is_in_shadow(world, hit, shot, light):
                total += lit
        light += 1
    row = shot.env % look.surfaces.texture.shape[0]
    if look.surfaces.texture[row, hit.geom] >= 0:
        flat = direction / wp.dot(direction, shot.forward)
        against = wp.dot(hit.face_normal, flat)
        right = shot.right - wp.dot(hit.face_normal, shot.right) / against * flat
        below = shot.down - wp.dot(hit.face_normal, shot.down) / against * flat
        back = depth * wp.transpose(hit.axes)
        texel = sample_surface(
            look.surfaces, look.textures, world, hit, back @ right, back @ below, row
        )
        total = wp.cw_mul(total, texel)
    lighting = look.lighting
    total = _clip(lighting.exposure[shot.env % lighting.exposure.shape[0]] * total)
    extinction = lighting.extinction[shot.env % lighting.extinction.shape[0]]
    if extinction > 0.0:
        haze = lighting.haze[shot.env % lighting.haze.shape[0]]
        clear = wp.exp(-extinction * wp.length(hit.point - shot.position))
        total = haze + clear * (total - haze)
    return total


@wp.func
def _light_by_group(
    look: Look, hit: Hit, corners: Corners, shot: Shot, only: int, has_shadows: bool
) -> wp.vec3:
    """Return what a surface emits and reflects of the lights without shadows, or of one with."""
    rgba = _rgba(look, shot.env, hit.geom)
    color, shine = wp.vec3(rgba[0], rgba[1], rgba[2]), look.surfaces.shine[hit.geom]
    centre = hit.point - hit.axes @ hit.local
    total = wp.vec3()
    corner = int(0)
    while corner < corners.count:
        place = centre + hit.axes @ corners.places[corner]
        normal = hit.axes @ corners.normals[corner]
        lit = wp.vec3()
        if only >= 0:
            lit = _light_corner(shot, only, place, normal, color, shine)
        else:
            lit = (shine[0] + shot.ambient) * color
            light = int(0)
            while light < shot.count:
                if shot.lights[light].casts == 0 or not has_shadows:
                    lit += _light_corner(shot, light, place, normal, color, shine)
                light += 1
        total += corners.weights[corner] * _clip(lit)
        corner += 1
    return total


@wp.func
def _is_in_shadow(world: World, hit: Hit, shot: Shot, light: int) -> bool:
    towards = -shot.lights[light].direction
    distance = float(1e6)
    if shot.lights[light].kind != DIRECTIONAL:
        towards = shot.lights[light].position - hit.point
        distance = wp.length(towards)
        towards = towards / distance
    if wp.dot(hit.face_normal, towards) <= 0.0:
        return True
    start = hit.point + _OFF * (1.0 + hit.distance) * hit.face_normal
    return is_blocked(world, shot.env, start, towards, distance)


@wp.func
def _light_corner(
    shot: Shot, number: int, place: wp.vec3, normal: wp.vec3, color: wp.vec3, shine: wp.vec3
) -> wp.vec3:
    """Return the light that a corner reflects, world frame: OpenGL's formula."""
    light = shot.lights[number]
    to_light = -light.direction
    strength = float(1.0)
    if light.kind != DIRECTIONAL:
        to_light = light.position - place
        distance = wp.length(to_light)
        to_light = to_light / wp.max(distance, 1e-9)
        fade = light.attenuation
        strength = 1.0 / wp.max(fade[0] + distance * (fade[1] + distance * fade[2]), 1e-6)
        if distance > light.range:
            strength = 0.0
        if light.least_cosine > -1.5:
            cosine = -wp.dot(to_light, light.direction)
            if cosine < light.least_cosine:
                strength = 0.0
            else:
                strength *= wp.pow(cosine, light.exponent)
    if strength == 0.0:
        return wp.vec3()
    facing = wp.dot(normal, to_light)
    reflected = wp.vec3(light.ambient)
    if facing > 0.0:
        reflected += light.diffuse * facing
    lit = wp.cw_mul(color, reflected)
    if facing > 0.0 and shine[1] > 0.0:
        half = wp.normalize(to_light + wp.normalize(shot.position - place))
        lit += light.specular * (shine[1] * wp.pow(wp.max(wp.dot(normal, half), 0.0), shine[2]))
    return strength * lit


@wp.func
def _clip(color: wp.vec3) -> wp.vec3:
    return wp.vec3(
        wp.clamp(color[0], 0.0, 1.0), wp.clamp(color[1], 0.0, 1.0), wp.clamp(color[2], 0.0, 1.0)
    )
