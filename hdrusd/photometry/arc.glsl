// The arctangent, because drivers' may be worse; twin of photometry/arc.py

// (arctan(t) / t - 1) / t^2 for t^2 from 0 to 1: Abramowitz and Stegun 4.4.49, good to 2e-8 in
// the arctangent.
float arctan_rest(float t2)
{
    float p = 0.0028662257 * t2 - 0.0161657367;
    p = p * t2 + 0.0429096138;
    p = p * t2 - 0.0752896400;
    p = p * t2 + 0.1065626393;
    p = p * t2 - 0.1420889944;
    p = p * t2 + 0.1999355085;
    return p * t2 - 0.3333314528;
}

// rad of sine >= 0 and cosine times any positive number; 0 of none.
float arc_angle(float sine, float cosine)
{
    float c = abs(cosine);
    float t = min(sine, c) / max(max(sine, c), 1e-30);
    float t2 = t * t;
    float angle = t + t * t2 * arctan_rest(t2);
    angle = sine > c ? 1.57079632679490 - angle : angle;
    return cosine < 0.0 ? 3.14159265358979 - angle : angle;
}

// arctan(t) - t for t >= 0, without a difference where t is small.
float arc_excess(float tangent)
{
    float t2 = min(tangent * tangent, 1.0);
    return tangent < 1.0 ? tangent * t2 * arctan_rest(t2) : arc_angle(tangent, 1.0) - tangent;
}
