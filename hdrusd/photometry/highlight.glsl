// Highlights of area lights by a representative point; twin of photometry/highlight.py

const float STRAIGHT = 1.27323954473516;  // k of lights with straight sides; 1 of round ones

// From the centre of a flat light to where the ray meets its plane, or far off.
vec3 plane_offset(vec3 p, vec3 r, vec3 axis)
{
    float towards = -dot(r, axis);
    float far = 1e3 * sqrt(dot(p, p));
    float way = towards > 1e-6 ? -dot(p, axis) / max(towards, 1e-6) : far;
    return r * clamp(way, 0.0, far) - p;
}

// a and b of the point a x + b y that is nearest to q.
vec2 plane_coordinates(vec3 q, vec3 x, vec3 y)
{
    float xx = dot(x, x), xy = dot(x, y), yy = dot(y, y), qx = dot(q, x), qy = dot(q, y);
    return vec2(qx * yy - qy * xy, qy * xx - qx * xy) / max(xx * yy - xy * xy, 1e-30);
}

// To the representative points.
vec3 rect_point(vec3 p, vec3 r, vec3 axis, vec3 x, vec3 y)
{
    vec2 at = clamp(plane_coordinates(plane_offset(p, r, axis), x, y), -1.0, 1.0);
    return p + at.x * x + at.y * y;
}

vec3 disk_point(vec3 p, vec3 r, vec3 axis, vec3 x, vec3 y)
{
    vec2 at = plane_coordinates(plane_offset(p, r, axis), x, y);
    at *= inversesqrt(max(dot(at, at), 1.0));
    return p + at.x * x + at.y * y;
}

vec3 sphere_point(vec3 p, vec3 r, float radius)
{
    vec3 beside = r * max(dot(p, r), 0.0) - p;
    return p + beside * min(radius * inversesqrt(max(dot(beside, beside), 1e-20)), 1.0);
}

vec3 cylinder_point(vec3 p, vec3 r, vec3 x, float radius)
{
    float along = dot(r, x), across = max(dot(x, x), 1e-20);
    float bend = max(across - along * along, 1e-6 * across);
    float at = clamp((dot(r, p) * along - dot(p, x)) / bend, -1.0, 1.0);
    return sphere_point(p + at * x, r, radius);
}

// What the half sides or radii x, y move the half vector by: sum of squares, cross product^2.
vec2 spread(vec3 p, vec3 v, vec3 x, vec3 y)
{
    float inverse = inversesqrt(max(dot(p, p), 1e-20));
    vec3 way = p * inverse;
    vec3 both = way + v;
    float size2 = max(dot(both, both), 1e-6);
    vec3 u = x - way * dot(x, way), z = y - way * dot(y, way);
    u -= both * (dot(u, both) / size2);
    z -= both * (dot(z, both) / size2);
    float scale = inverse * inverse / size2;
    vec3 turn = cross(u, z) * scale;
    return vec2((dot(u, u) + dot(z, z)) * scale, dot(turn, turn));
}

vec2 sphere_spread(vec3 p, vec3 v, float radius)
{
    float square = max(dot(p, p), 1e-20);
    vec3 both = p * inversesqrt(square) + v;
    float size2 = max(dot(both, both), 1e-6);
    float angle2 = radius * radius / max(square, radius * radius);
    return vec2(angle2 * (0.25 + 1.0 / size2), 0.25 * angle2 * angle2 / size2);
}

// By what a lobe of alpha^2 is lower.
float lobe_share(vec2 area, float k, float alpha2)
{
    return inversesqrt(1.0 + (k * area.x + k * k * area.y / alpha2) / alpha2);
}

// The factor on the illuminance of the light; nl of the representative point, middle of the centre.
float highlight_share(float share, float nl, float middle)
{
    float raised = clamp(max(nl, 0.0) / max(middle, 1e-3), 0.0, 4.0);
    return share * (1.0 + (raised - 1.0) * (1.0 - share));
}

// alpha^2 of Blinn's and Phong's lobe.
float blinn_alpha2(float shininess)
{
    return 2.0 / (shininess + 2.0);
}
