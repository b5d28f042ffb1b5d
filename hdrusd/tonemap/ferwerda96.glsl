// Ferwerda, Pattanaik, Shirley, Greenberg, SIGGRAPH 1996; twin of tonemap/ferwerda96.py
#include "eye/scotopic.glsl"
#include "tonemap/on_screen.glsl"

uniform float ferwerda96_cone;  // cd/m2 of the screen per cd/m2 that cones see
uniform float ferwerda96_rod;   // and that rods see, with their weight

// cd/m2 to display-linear [0, 1].
vec3 ferwerda96(vec3 rgb)
{
    float rods = white_relative(scotopic(rgb));
    return on_screen(ferwerda96_cone * rgb + ferwerda96_rod * rods);
}
