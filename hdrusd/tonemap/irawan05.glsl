// Irawan, Ferwerda, Marschner, EGSR 2005: the curve of an adapting eye; twin of tonemap/irawan05.py
#include "tonemap/curve.glsl"

#define PLAIN_CURVE  // it is curve() and no more

// cd/m2 to display-linear [0, 1].
vec3 irawan05(vec3 rgb)
{
    return curve(rgb);
}
