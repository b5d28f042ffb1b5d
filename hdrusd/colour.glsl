// Luminance (ITU-R BT.709-6), gamut, what screens decode, dither; twin of colour.py

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

// Display-linear [0, 1] to code values of a screen that is a plain power, and back.
vec3 gamma_encode(vec3 linear, float gamma)
{
    return pow(linear, vec3(1.0 / gamma));
}

vec3 gamma_decode(vec3 code, float gamma)
{
    return pow(code, vec3(gamma));
}

// Display-linear [0, 1] to code values of a BT.1886 screen with black and white in cd/m2, and back.
vec3 bt1886_encode(vec3 linear, float black, float white)
{
    float low = pow(black, 1.0 / 2.4), high = pow(white, 1.0 / 2.4);
    return (pow(black + linear * (white - black), vec3(1.0 / 2.4)) - low) / (high - low);
}

vec3 bt1886_decode(vec3 code, float black, float white)
{
    float low = pow(black, 1.0 / 2.4), high = pow(white, 1.0 / 2.4);
    return (pow(low + code * (high - low), vec3(2.4)) - black) / (white - black);
}

const float PQ_PEAK = 10000.0;  // cd/m2 at the top of SMPTE ST 2084

// cd/m2 to code values [0, 1] (SMPTE ST 2084), and back.
vec3 pq_encode(vec3 light)
{
    vec3 y = pow(clamp(light / PQ_PEAK, 0.0, 1.0), vec3(0.1593017578125));
    return pow((0.8359375 + 18.8515625 * y) / (1.0 + 18.6875 * y), vec3(78.84375));
}

vec3 pq_decode(vec3 code)
{
    vec3 e = pow(code, vec3(1.0 / 78.84375));
    vec3 y = max(e - 0.8359375, 0.0) / (18.8515625 - 18.6875 * e);
    return PQ_PEAK * pow(y, vec3(1.0 / 0.1593017578125));
}

// Linear Rec. 709 in linear Rec. 2020 (ITU-R BT.2087), and back; a line a channel.
vec3 to_rec2020(vec3 rgb)
{
    return rgb * mat3(0.627403914, 0.329283039, 0.043313048,
                      0.069097292, 0.919540395, 0.011362316,
                      0.016391439, 0.088013308, 0.895595253);
}

vec3 from_rec2020(vec3 rgb)
{
    return rgb * mat3(1.660490954, -0.587641126, -0.072849828,
                      -0.124550476, 1.132899898, -0.008349426,
                      -0.018150763, -0.100578898, 1.118729661);
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
