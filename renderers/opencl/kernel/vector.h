// Points, directions and colours.

DEVICE real dot3(real3 a, real3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
DEVICE real length3(real3 a) { return sqrt(dot3(a, a)); }
DEVICE real3 normalise3(real3 a) { return a / length3(a); }

DEVICE real3 cross3(real3 a, real3 b)
{
    return R3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}

DEVICE real least(real a, real b) { return b < a ? b : a; }
DEVICE real most(real a, real b) { return a < b ? b : a; }
DEVICE real largest(real3 a) { return most(most(fabs(a.x), fabs(a.y)), fabs(a.z)); }

// NUM-4: of a direction that a surface made.
DEVICE real3 renormalise(real3 d)
{
#ifdef RENORMALISE_OFF
    return d;
#else
    return normalise3(d);
#endif
}

// CNT-2. Of the bits, since fast-math (NUM-3) believes every number finite.
DEVICE bool is_finite(real x)
{
#ifndef __OPENCL_VERSION__
#ifdef PRECISION_FLOAT32
    return (BITS(x) & 0x7f800000u) != 0x7f800000u;
#else
    return (BITS(x) & 0x7ff0000000000000ull) != 0x7ff0000000000000ull;
#endif
#elif defined(PRECISION_FLOAT32)
    return (as_uint(x) & 0x7f800000u) != 0x7f800000u;
#else
    return (as_ulong(x) & 0x7ff0000000000000ul) != 0x7ff0000000000000ul;
#endif
}

typedef struct {
    real3 origin, direction;  // the direction has unit length (HIT-1)
} Ray;

// The place where a ray ends.
typedef struct {
    real3 point, normal;
    real size;  // of the shape, for OFF-1
} Surface;

DEVICE Surface surface_at(real3 point, real3 normal, real size)
{
    Surface at;
    at.point = point, at.normal = normal, at.size = size;
    return at;
}

// ε of OFF-1
DEVICE real shift_of(Surface at, real epsilon)
{
#if defined(OFFSET_NONE)
    return 0;
#elif defined(OFFSET_FIXED)
    return epsilon;
#elif defined(OFFSET_RELATIVE)
    return epsilon * most(largest(at.point), at.size);
#else
    const real along = fabs(at.normal.x * at.point.x) + fabs(at.normal.y * at.point.y) + fabs(at.normal.z * at.point.z);
    return epsilon * (at.size + along / 8);
#endif
}

// LOC-2: ε at a light, with the largest size of all shapes.
DEVICE real room_at_light(real epsilon, real size, real3 place)
{
#if defined(OFFSET_NONE)
    return 0;
#elif defined(OFFSET_FIXED)
    return epsilon;
#else
    return epsilon * (size + largest(place));
#endif
}

// OFF-1: where a ray starts that leaves on the side the normal points to (+1) or on the other (-1).
DEVICE real3 leave(Surface at, real side, real epsilon)
{
#if defined(OFFSET_NONE)
    return at.point;
#else
    return at.point + side * shift_of(at, epsilon) * at.normal;
#endif
}
