// Pattanaik, Tumblin, Yee, Greenberg, SIGGRAPH 2000; twin of tonemap/pattanaik00.py
#include "colour.glsl"
#include "eye/scotopic.glsl"

uniform vec2 pattanaik00_sigma;       // half saturation of cones and rods, cd/m2
uniform vec2 pattanaik00_pigment;     // shares that are not bleached
uniform vec2 pattanaik00_appearance;  // gain and offset of the response
uniform vec2 pattanaik00_display;     // the viewer's half saturation, cd/m2; response to white
uniform vec2 pattanaik00_screen;      // black and white, cd/m2

const float PATTANAIK00_EXPONENT = 0.73;

// Response of cones and rods, 0 to 2, to luminances in cd/m2, the rods' white-relative.
float pattanaik00_response(float y, float rods)
{
    vec2 power = pow(max(vec2(y, rods), 0.0) / pattanaik00_sigma, vec2(PATTANAIK00_EXPONENT));
    return dot(pattanaik00_pigment, power / (1.0 + power));
}

// Exponent of C/Y: how colourful the scene is seen over how colourful the display is.
float pattanaik00_saturation(float y, float shown)
{
    vec2 sigma = vec2(pattanaik00_sigma.x, pattanaik00_display.x);
    vec2 power = pow(max(vec2(y, shown), 0.0) / sigma, vec2(PATTANAIK00_EXPONENT));
    vec2 slope = power / ((1.0 + power) * (1.0 + power));
    return min(pattanaik00_pigment.x * slope.x / max(slope.y, 1e-12), 1.0);
}

// cd/m2 to display-linear [0, 1].
vec3 pattanaik00(vec3 rgb)
{
    float y = luminance(rgb);
    float seen = pattanaik00_response(y, white_relative(scotopic(rgb)));
    seen = clamp(pattanaik00_appearance.x * seen + pattanaik00_appearance.y, 0.0,
                 pattanaik00_display.y);
    float shown = pattanaik00_display.x * pow(seen / (1.0 - seen), 1.0 / PATTANAIK00_EXPONENT);
    float exponent = pattanaik00_saturation(y, shown);
    vec3 colour = pow(max(rgb / max(y, DARKEST), 1e-6), vec3(exponent));
    float value = clamp((shown - pattanaik00_screen.x)
                        / (pattanaik00_screen.y - pattanaik00_screen.x), 0.0, 1.0);
    return to_gamut(with_luminance(colour, value), value);
}
