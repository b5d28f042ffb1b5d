// Candela of a direction from a grid; twin of photometry/profile.py
#include "photometry/arc.glsl"

// The angle of the direction (x, y), rad, from -pi to pi.
float angle_from_sides(float y, float x)
{
    float angle = arc_angle(abs(y), x);
    return y < 0.0 ? -angle : angle;
}

// Plane and angle, rad, of a direction; type: C 0, A 1, B 2.
vec2 profile_angles(vec3 direction, float type)
{
    vec3 s = direction * direction;
    float right = direction.x;
    float up = direction.y;
    float ahead = direction.z;
    vec4 sides = vec4(up, right, sqrt(s.x + s.y), ahead);
    sides = type > 0.5 ? vec4(right, ahead, up, sqrt(s.x + s.z)) : sides;
    sides = type > 1.5 ? vec4(right, sqrt(s.y + s.z), up, ahead) : sides;
    return vec2(angle_from_sides(sides.x, sides.y), angle_from_sides(sides.z, sides.w));
}

// Candela in a unit direction (toward C = 0, toward C = 90, along the axis), 0 outside the
// table. place: offset in the atlas, columns, rows, type; grid: first plane, planes a radian,
// first angle, angles a radian.
float profile_candela(sampler2D atlas, vec4 place, vec4 grid, vec3 direction)
{
    vec2 angles = profile_angles(direction, place.w);
    vec2 away = angles - grid.xz;
    // A type C goes once round.
    away.x -= place.w < 0.5 ? 6.28318530717959 * floor(away.x * 0.159154943091895) : 0.0;
    vec2 at = away * grid.yw;
    vec2 count = place.zy;
    bool inside = all(greaterThanEqual(at, vec2(-1e-3))) && all(lessThanEqual(at, count + 1e-3));
    vec2 cell = clamp(floor(at), vec2(0.0), count - 1.0);
    vec2 share = clamp(at - cell, 0.0, 1.0);
    int index = int(place.x) + int(cell.x) * int(place.y) + int(cell.y);
    vec4 corners = texelFetch(atlas, ivec2(index & 2047, index >> 11), 0);
    vec2 within = mix(corners.xz, corners.yw, share.y);
    return inside ? mix(within.x, within.y, share.x) : 0.0;
}
