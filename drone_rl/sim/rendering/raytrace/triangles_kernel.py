"""Triangles of meshes and height fields in a bounding volume hierarchy, and rays through it.

The hierarchy of a mesh is a complete binary tree in heap order: node i has the children 2i + 1 and
2i + 2, and each leaf has eight triangles, some of them empty. A ray meets a triangle where Pluecker
coordinates of its three edges have one sign, so that no ray slips through between two triangles.
"""

import warp as wp

from drone_rl.sim.rendering.raytrace.structs_kernel import struct

wp.set_module_options({"enable_backward": False, "fuse_fp": False})

WIDTH = 8
"""Triangles of a leaf."""


@struct
class Triangles:
    """Meshes one after the other, each in its own frame. Metres."""

    depth: wp.array[int]
    """Levels below the root of each mesh: 2 to the power of it is the number of its leaves."""
    node: wp.array[int]
    """First node of each mesh."""
    leaf: wp.array[int]
    """First leaf of each mesh."""
    boxes: wp.array[float]
    """Of each node: its centre and its half extents."""
    corners: wp.array[float]
    """Of each leaf: x of all first corners, y, z, then the second and third corners."""
    normals: wp.array[wp.vec3]
    """Shading normals: three a triangle."""
    texcoords: wp.array[wp.vec2]
    """Three a triangle; zero without."""


_MEET = """
    const float ax = v[k] - x, ay = v[8 + k] - y, az = v[16 + k] - z;
    const float bx = v[24 + k] - x, by = v[32 + k] - y, bz = v[40 + k] - z;
    const float cx = v[48 + k] - x, cy = v[56 + k] - y, cz = v[64 + k] - z;
    const float px = cx - bx, py = cy - by, pz = cz - bz;
    const float qx = ax - cx, qy = ay - cy, qz = az - cz;
    const float rx = bx - ax, ry = by - ay, rz = bz - az;
    const float sx = cx + bx, sy = cy + by, sz = cz + bz;
    const float tx = ax + cx, ty = ay + cy, tz = az + cz;
    const float ux = bx + ax, uy = by + ay, uz = bz + az;
    const float i = u * (py * sz - pz * sy) + w * (pz * sx - px * sz) + h * (px * sy - py * sx);
    const float j = u * (qy * tz - qz * ty) + w * (qz * tx - qx * tz) + h * (qx * ty - qy * tx);
    const float m = u * (ry * uz - rz * uy) + w * (rz * ux - rx * uz) + h * (rx * uy - ry * ux);
    const float nx = qy * rz - qz * ry, ny = qz * rx - qx * rz, nz = qx * ry - qy * rx;
    const float facing = u * nx + w * ny + h * nz;
    const float along = (ax * nx + ay * ny + az * nz) / facing;
"""
"""Meets triangle k of the leaf v with a ray from (x, y, z) along (u, w, h): `facing` < 0 if its
front is seen, `along`, and twice the weights i, j, m of its corners, by the same factor."""


@wp.func_native(f"""
const int root = triangles.node.data[mesh], leaf = triangles.leaf.data[mesh];
const int leaves = 1 << triangles.depth.data[mesh];
const float *const boxes = triangles.boxes.data + 6 * root;
const float x = origin[0], y = origin[1], z = origin[2];
const float u = ray[0], w = ray[1], h = ray[2];
float per[3];
for (int c = 0; c < 3; ++c)
    per[c] = 1.0f / (wp::abs(ray[c]) > 1e-20f ? ray[c] : (ray[c] < 0.0f ? -1e-20f : 1e-20f));
double nearest = far;
int found = -1, depth = 1;
int stack[64];
float entered[64];
stack[0] = 0;
entered[0] = 0.0f;
while (depth > 0) {{
    --depth;
    const int at = stack[depth];
    if (entered[depth] > nearest) continue;
    if (at >= leaves - 1) {{
        const int slot = leaf + at - (leaves - 1);
        const float *const v = triangles.corners.data + 72 * slot;
        float reached[8];
        for (int k = 0; k < 8; ++k) {{
            {_MEET}
            const bool front = (facing < 0.0f) & (i >= 0.0f) & (j >= 0.0f) & (m >= 0.0f);
            const bool back = (facing > 0.0f) & (i <= 0.0f) & (j <= 0.0f) & (m <= 0.0f);
            const bool is_met = (front | (back & both)) & (along >= 0.0f);
            reached[k] = is_met ? along : 3e38f;
        }}
        for (int k = 0; k < 8; ++k)
            if (reached[k] <= nearest) {{
                nearest = reached[k];
                found = 8 * slot + k;
            }}
        if (found >= 0 && first) break;
        continue;
    }}
    float enter[2];
    for (int side = 0; side < 2; ++side) {{
        const int child = 2 * at + 1 + side;
        float in = 0.0f, out = (float)nearest;
        for (int c = 0; c < 3; ++c) {{
            const float middle = (boxes[6 * child + c] - origin[c]) * per[c];
            const float half = boxes[6 * child + 3 + c] * wp::abs(per[c]);
            in = middle - half > in ? middle - half : in;
            out = middle + half < out ? middle + half : out;
        }}
        enter[side] = in <= out * 1.000001f ? in : 3e38f;
    }}
    const int nearer = enter[1] < enter[0];
    for (int side = 0; side < 2; ++side) {{
        const int which = side == 0 ? !nearer : nearer;
        if (enter[which] <= nearest) {{
            stack[depth] = 2 * at + 1 + which;
            entered[depth] = enter[which];
            ++depth;
        }}
    }}
}}
return wp::vec_t<2, double>(found < 0 ? -1.0 : nearest, (double)found);
""")
def trace_mesh(
    triangles: Triangles,
    mesh: int,
    origin: wp.vec3,
    ray: wp.vec3,
    far: float,
    both: bool,
    first: bool,
) -> wp.vec2d:
    """Return how far a ray goes in a mesh's frame, -1 for a miss, and which triangle it meets.

    It passes the backs of triangles unless `both` sides count; with `first` that which
    is triangle
    found counts, which may not be the nearest. Distances are in units of the ray's length.
    """
    ...


@wp.func_native(f"""
const float *const v = triangles.corners.data + 72 * (triangle / 8);
const int k = triangle % 8;
const float x = origin[0], y = origin[1], z = origin[2];
const float u = ray[0], w = ray[1], h = ray[2];
{_MEET}
const float sum = i + j + m;
const float whole = sum == 0.0f ? 1.0f : 1.0f / sum;
return wp::vec_t<3, float>(i * whole, j * whole, m * whole);
""")
def triangle_weights(triangles: Triangles, triangle: int, origin: wp.vec3, ray: wp.vec3) -> wp.vec3:
    """Return the weights of a triangle's corners where a ray meets it."""
    ...


@wp.func
def triangle_normal(triangles: Triangles, triangle: int) -> wp.vec3:
    """Return the unit normal of a triangle's plane, in the mesh's frame."""
    a = triangle_corner(triangles, triangle, 0)
    b = triangle_corner(triangles, triangle, 1)
    c = triangle_corner(triangles, triangle, 2)
    return wp.normalize(wp.cross(b - a, c - a))


@wp.func
def smooth_normal(triangles: Triangles, triangle: int, weights: wp.vec3) -> wp.vec3:
    """Return the unit normal for shading, interpolated between a triangle's corners."""
    at = 3 * triangle
    normal = weights[0] * triangles.normals[at] + weights[1] * triangles.normals[at + 1]
    return wp.normalize(normal + weights[2] * triangles.normals[at + 2])


@wp.func
def triangle_corner(triangles: Triangles, triangle: int, corner: int) -> wp.vec3:
    """Return a corner of a triangle, in the mesh's frame."""
    at = 72 * (triangle / 8) + 24 * corner + triangle % 8
    return wp.vec3(triangles.corners[at], triangles.corners[at + 8], triangles.corners[at + 16])
