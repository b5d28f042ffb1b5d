// Luminances that a screen shall show; twin of tonemap/on_screen.py
#include "colour.glsl"

uniform float screen_black;  // cd/m2 seen at the screen's black
uniform float screen_white;  // and at its white

// Light to be seen in cd/m2 to display-linear [0, 1].
vec3 on_screen(vec3 rgb)
{
    float y = luminance(rgb);
    float shown = max((y - screen_black) / (screen_white - screen_black), 0.0);
    return to_gamut(rgb * (shown > 0.0 ? shown / y : 0.0), shown);
}
