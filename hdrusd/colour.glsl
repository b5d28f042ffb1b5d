// Luminance (ITU-R BT.709-6), sRGB (IEC 61966-2-1), gamut and dither; twin of colour.py

const vec3 LUMINANCE_WEIGHTS = vec3(0.2126, 0.7152, 0.0722);
const float BRIGHTEST = 1e12;  // cd/m2 that stand for infinity
const float DARKEST = 1e-9;    // luminance below which a colour has no chromaticity

// Linear RGB to luminance, in its unit.
float luminance(vec3 rgb)
{
    return dot(rgb, LUMINANCE_WEIGHTS);
}

// cd/m2 without NaN (becomes 0), negatives (0) and infinity (BRIGHTEST).
// Comparisons, because max() and clamp() of a NaN may be anything.
vec3 clean(vec3 rgb)
{
    return vec3(rgb.r > 0.0 ? min(rgb.r, BRIGHTEST) : 0.0,
                rgb.g > 0.0 ? min(rgb.g, BRIGHTEST) : 0.0,
                rgb.b > 0.0 ? min(rgb.b, BRIGHTEST) : 0.0);
}

// The chromaticity of rgb at the luminance target; black stays black.
vec3 with_luminance(vec3 rgb, float target)
{
    float y = luminance(rgb);
    return rgb * (y < DARKEST ? 0.0 : target / max(y, DARKEST));
}

// Display-linear RGB >= 0 of luminance y into [0, 1], toward the grey of that luminance;
// but for a rounding.
vec3 to_gamut(vec3 rgb, float y)
{
    float grey = min(y, 1.0);
    float most = max(rgb.r, max(rgb.g, rgb.b));
    float share = most > 1.0 ? (1.0 - grey) / (most - grey) : 1.0;
    return grey + share * (rgb - grey);
}

// Display-linear [0, 1] to code values [0, 1], good for 8 bits; why and how good: colour.py
vec3 srgb_encode_fit(vec3 linear)
{
    vec3 q = sqrt(sqrt(linear));
    vec3 curve = ((0.9561901 - 0.1376821 * q) * q + 0.2524340) * q - 0.0709420;
    return mix(12.92 * linear, curve, greaterThan(linear, vec3(0.0031308)));
}

// Code values [0, 1] to display-linear [0, 1].
vec3 srgb_decode(vec3 code)
{
    vec3 curve = pow((max(code, 0.04045) + 0.055) / 1.055, vec3(2.4));
    return mix(code / 12.92, curve, greaterThan(code, vec3(0.04045)));
}

// Code steps in (-0.5, 0.5) for the pixel x to the right and y down.
float dither(uint x, uint y)
{
    return float((x * 3242174889u + y * 2447445414u) >> 24) / 256.0 + (0.5 / 256.0 - 0.5);
}

// Code values [0, 1] to 0 ... 255, rounded after offset (code steps) was added; a rounding
// too many above 1 is taken off.
uvec3 quantise(vec3 code, float offset)
{
    return uvec3(min(code * 255.0 + (offset + 0.5), 255.0));
}
