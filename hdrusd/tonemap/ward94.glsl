// Ward, Graphics Gems IV, 1994; twin of tonemap/ward94.py
#include "tonemap/on_screen.glsl"

uniform float ward94_scale;  // cd/m2 of the screen per cd/m2 of the scene

// cd/m2 to display-linear [0, 1].
vec3 ward94(vec3 rgb)
{
    return on_screen(rgb * ward94_scale);
}
