// Area lights: lux per candela on the axis; twin of photometry/area.py
#include "photometry/arc.glsl"

const float AREA_FAR2 = 2500.0;  // half diagonals, squared, beyond which four points stand for all
const int AREA_SIDES = 64;

// Which part of a line is above the horizon, from the heights of its ends.
vec2 seen_part(float first, float last)
{
    float cut = first / (first == last ? 1.0 : first - last);
    vec2 part = vec2(first < 0.0 ? cut : 0.0, last < 0.0 ? cut : 1.0);
    return first >= 0.0 || last >= 0.0 ? clamp(part, 0.0, 1.0) : vec2(0.0);
}

// One edge of Lambert's formula: its angle times the cosine of its plane's normal to n.
float edge_term(vec3 start, vec3 edge, vec3 n, vec2 part)
{
    vec3 turn = cross(start, edge);
    float size = sqrt(dot(turn, turn));
    float angle = arc_angle(size * (part.y - part.x), dot(start + part.x * edge, start + part.y * edge));
    return dot(n, turn) / max(size, 1e-30) * angle;
}

// Mean over p +- x +- y of cos(theta) / d^3, 1/m3.
float four_points(vec3 p, vec3 n, vec3 x, vec3 y)
{
    vec3 sum = x + y, difference = x - y;
    float total = 0.0;
    for (int i = 0; i < 4; ++i) {
        vec3 v = p + (i < 2 ? sum : difference) * ((i & 1) == 0 ? 1.0 : -1.0);
        float square = max(dot(v, v), 1e-12);
        total += max(dot(n, v), 0.0) / (square * square);
    }
    return 0.25 * total;
}

// Parallelogram of the half sides x and y.
float rect_illuminance(vec3 p, vec3 n, vec3 axis, vec3 x, vec3 y)
{
    float height = -dot(axis, p);
    vec3 size = cross(x, y);
    float total = 0.0;
    vec3 low = vec3(0.0), high = vec3(0.0);
    vec3 corner = -x - y, edge = 2.0 * x, following = 2.0 * y;
    for (int i = 0; i < 4; ++i) {
        float first = dot(n, p + corner), last = dot(n, p + corner + edge);
        vec2 part = seen_part(first, last);
        total += edge_term(p + corner, edge, n, part);
        low += first >= 0.0 && last < 0.0 ? corner + part.y * edge : vec3(0.0);
        high += first < 0.0 && last >= 0.0 ? corner + part.x * edge : vec3(0.0);
        corner += edge;
        vec3 back = -edge;
        edge = following;
        following = back;
    }
    total += edge_term(p + low, high - low, n, vec2(0.0, 1.0));
    float near = abs(total) / max(8.0 * sqrt(dot(size, size)), 1e-30);
    float far = height * four_points(p, n, x * 0.57735026919, y * 0.57735026919);
    bool beyond = dot(p, p) > AREA_FAR2 * (dot(x, x) + dot(y, y));
    return height > 0.0 ? (beyond ? far : near) : 0.0;
}

// Circular disk wholly above the horizon.
float circle_illuminance(vec3 p, vec3 n, vec3 axis, float r2)
{
    float height = -dot(axis, p);
    vec3 side = p + height * axis;
    float h2 = height * height, q2 = dot(side, side);
    float s = max(h2 + q2 + r2, 1e-30);
    h2 /= s;
    q2 /= s;
    float b = q2 - h2 - r2 / s;
    float d = sqrt(max(b * b + 4.0 * q2 * h2, 1e-30));
    float w = b > 0.0 ? 4.0 * q2 * h2 / (d + abs(b)) : d - b;
    float across = 2.0 * height * (dot(n, side) / s);
    return max(across - dot(n, axis) * w, 0.0) / (d * (d + 1.0) * s);
}

// Polygon of AREA_SIDES sides with the area of an elliptic disk.
float ellipse_illuminance(vec3 p, vec3 n, vec3 x, vec3 y)
{
    const float COS = 0.99518472667220, SIN = 0.09801714032956;  // of 2 pi / 64
    const float FIT = 1.00080377151766;                          // sqrt(2 pi / 64 / SIN)
    vec3 size = cross(x, y);
    float total = 0.0;
    vec3 low = vec3(0.0), high = vec3(0.0);
    vec3 corner = FIT * x, quarter = FIT * y;
    float first = dot(n, p + corner);
    for (int i = 0; i < AREA_SIDES; ++i) {
        vec3 following = COS * corner + SIN * quarter;
        quarter = COS * quarter - SIN * corner;
        vec3 edge = following - corner;
        float last = dot(n, p + following);
        vec2 part = seen_part(first, last);
        total += edge_term(p + corner, edge, n, part);
        low += first >= 0.0 && last < 0.0 ? corner + part.y * edge : vec3(0.0);
        high += first < 0.0 && last >= 0.0 ? corner + part.x * edge : vec3(0.0);
        corner = following;
        first = last;
    }
    total += edge_term(p + low, high - low, n, vec2(0.0, 1.0));
    return abs(total) / max(6.28318530717959 * sqrt(dot(size, size)), 1e-30);
}

// Disk of the conjugate radii x and y.
float disk_illuminance(vec3 p, vec3 n, vec3 axis, vec3 x, vec3 y)
{
    float height = -dot(axis, p);
    float r2 = dot(x, x), other = dot(y, y), level = dot(n, p);
    float nx = dot(n, x), ny = dot(n, y);
    float reach = sqrt(nx * nx + ny * ny);
    bool circle = abs(r2 - other) <= 1e-4 * r2 && abs(dot(x, y)) <= 1e-4 * r2;
    bool near = dot(p, p) <= AREA_FAR2 * (r2 + other);
    bool exact = circle && level >= reach;
    float lux = exact ? circle_illuminance(p, n, axis, r2)
                      : height * four_points(p, n, 0.5 * x, 0.5 * y);
    // A loop, because a software device runs both sides of an if, but leaves a loop.
    bool rest = height > 0.0 && !exact && near && level > -reach;
    for (int i = 0; i < (rest ? 1 : 0); ++i)
        lux = ellipse_illuminance(p, n, x, y);
    return height > 0.0 && level > -reach ? lux : 0.0;
}

// Sphere; of a distant light with the half angle a: p unit vector, radius sin(a).
float sphere_illuminance(vec3 p, vec3 n, float radius)
{
    float r2 = max(radius * radius, 1e-20);
    float square = max(dot(p, p), 1e-20);
    float d2 = max(square, r2 * 1.000001);
    float cosine = clamp(dot(n, p) * inversesqrt(square), -1.0, 1.0);
    float sine = sqrt(max(1.0 - cosine * cosine, 1e-12));
    float sin2 = r2 / d2;
    float tangent = sqrt(r2 / (d2 - r2));
    float y = clamp(-cosine / (sine * tangent), -1.0, 1.0);
    float root = sqrt(max(1.0 - y * y, 0.0));
    float t = tangent * sine * root;
    float cut = sin2 * (cosine * arc_angle(root, y) + t) + arc_excess(t);
    bool whole = cosine * cosine >= sin2;
    return (whole ? max(cosine, 0.0) : max(cut, 0.0) / (3.14159265358979 * sin2)) / d2;
}

// Mean over p - x to p + x of cos(theta) / d^3, 1/m3.
float line_mean(vec3 p, vec3 n, vec3 x)
{
    float length2 = max(dot(x, x), 1e-30);
    float half_length = sqrt(length2);
    vec3 along = x / half_length;
    float middle = dot(p, along);
    vec3 across = p - middle * along;
    float square = max(dot(across, across), 1e-12);
    float distance_ = sqrt(square);
    float a = dot(n, across), b = dot(n, along);
    vec2 part = seen_part(a + b * (middle - half_length), a + b * (middle + half_length));
    float span = 2.0 * half_length * (part.y - part.x);
    float start = middle - half_length + 2.0 * half_length * part.x;
    float end = start + span;
    float ends = (square + start * start) * (square + end * end);
    float angle = arc_angle(distance_ * span, square + start * end);
    float near = a / (2.0 * square) * (span * (square - start * end) / ends + angle / distance_);
    near += 0.5 * b * span * (start + end) / ends;
    vec3 v = p + 0.57735026919 * x, w = p - 0.57735026919 * x;
    float v2 = max(dot(v, v), 1e-12), w2 = max(dot(w, w), 1e-12);
    float far = 0.5 * (max(dot(n, v), 0.0) / (v2 * v2) + max(dot(n, w), 0.0) / (w2 * w2));
    return dot(p, p) > AREA_FAR2 * length2 ? far : max(near, 0.0) / (2.0 * half_length);
}

// Side of a cylinder of half length x.
float cylinder_illuminance(vec3 p, vec3 n, vec3 x, float radius)
{
    const vec3 STRIPS = vec3(0.2092992179, 0.5917001814, 0.8717401485);
    const vec3 WEIGHTS = vec3(0.3943905576, 0.2216925320, 0.0505835770);
    float half2 = max(dot(x, x), 1e-30);
    vec3 across = p - dot(p, x) / half2 * x;
    float rho = sqrt(max(dot(across, across), 1e-20));
    float above = max(rho - radius, 0.0);
    float far = above * (rho + radius);
    float root = sqrt(far / (far + 4.0 * rho * radius));
    float c = sqrt(root * sqrt(root));
    float t0 = sqrt(above / (rho + radius));
    vec3 outward = -across / rho;
    vec3 side = cross(x * inversesqrt(half2), outward);
    float total = 0.0;
    for (int i = 0; i < 6; ++i) {
        int k = i >> 1;
        float bent = (1.0 - c) * STRIPS[k];
        float q = 1.0 - bent * STRIPS[k];
        float t = t0 * STRIPS[k] * c / q;
        float whole = 1.0 + t * t;
        float cosine = (1.0 - t * t) / whole, sine = ((i & 1) == 0 ? -2.0 : 2.0) * t / whole;
        float qq = q * q * whole;
        float share = WEIGHTS[k] * (1.0 + bent * STRIPS[k]) * (1.0 - bent * bent) / (qq * qq);
        total += share * line_mean(p + radius * (cosine * outward + sine * side), n, x);
    }
    return (rho + radius) * t0 * t0 * t0 * c * total;
}
