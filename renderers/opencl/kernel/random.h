// Numbers that are a function of what they are for (RND-1 to RND-3, SOB-1 to SOB-4): without a state, so any thread may
// draw.

// Who draws: a sample of a pixel, by a ray of an order. What the numbers are for comes with each draw.
typedef struct {
    uint pixel, sample, seed;
    int order;
} Draws;

typedef struct {
    real u[4];
} Uniform;

DEVICE Uniform draw(Draws who, uint path, uint use)
{
    uint c0 = who.pixel, c1 = who.sample, c2 = path, c3 = use, k0 = who.seed, k1 = 0;
    for (int round = 0; round < 10; round++) {
        const uint low0 = 0xD2511F53u * c0, high0 = mul_hi(0xD2511F53u, c0);
        const uint low1 = 0xCD9E8D57u * c2, high1 = mul_hi(0xCD9E8D57u, c2);
        c0 = high1 ^ c1 ^ k0, c1 = low1;
        c2 = high0 ^ c3 ^ k1, c3 = low0;
        k0 += 0x9E3779B9u, k1 += 0xBB67AE85u;
    }
    Uniform numbers;
    numbers.u[0] = (real)(c0 >> 8) * R(0x1p-24), numbers.u[1] = (real)(c1 >> 8) * R(0x1p-24);
    numbers.u[2] = (real)(c2 >> 8) * R(0x1p-24), numbers.u[3] = (real)(c3 >> 8) * R(0x1p-24);
    return numbers;
}

#if NEED_SOBOL
enum { PLACE = 0, ON_LENS = 2, DIMENSIONS = 64, BITS = 32 };  // the first two are purposes (SOB-1)

// SOB-4: the digits x, the first in the lowest bit, by a key; then all in the other order.
DEVICE uint scrambled(uint x, uint key)
{
    x ^= x * 0x3d20adeau;
    x += key;
    x *= key >> 16 | 1u;
    x ^= x * 0x05526c56u;
    x ^= x * 0x53a22864u;
    x = x >> 16 | x << 16;
    x = (x & 0xff00ff00u) >> 8 | (x & 0x00ff00ffu) << 8;
    x = (x & 0xf0f0f0f0u) >> 4 | (x & 0x0f0f0f0fu) << 4;
    x = (x & 0xccccccccu) >> 2 | (x & 0x33333333u) << 2;
    return (x & 0xaaaaaaaau) >> 1 | (x & 0x55555555u) << 1;
}

// SOB-1 to SOB-4: numbers 0 and 1 are those of point `index` of a purpose.
DEVICE Uniform point_of_sequence(const Scene *scene, Draws who, uint path, uint purpose, uint index)
{
    uint x = 0, y = 0;
    SCENE const int *row = scene->integers + scene->at.sobol_at + purpose * BITS;  // SOB-2
    for (; index != 0; index >>= 1, row++)
        if (index & 1)
            x ^= (uint)row[0], y ^= (uint)row[BITS];
    uint v0 = who.pixel, v1 = path, v2 = purpose, v3 = who.seed;  // SOB-3: pcg4d
    v0 = v0 * 1664525u + 1013904223u, v1 = v1 * 1664525u + 1013904223u;
    v2 = v2 * 1664525u + 1013904223u, v3 = v3 * 1664525u + 1013904223u;
    v0 += v1 * v3, v1 += v2 * v0, v2 += v0 * v1, v3 += v1 * v2;
    v0 ^= v0 >> 16, v1 ^= v1 >> 16, v2 ^= v2 >> 16, v3 ^= v3 >> 16;
    v0 += v1 * v3, v1 += v2 * v0;
    Uniform numbers;
    numbers.u[0] = (real)(scrambled(x, v0) >> 8) * R(0x1p-24), numbers.u[1] = (real)(scrambled(y, v1) >> 8) * R(0x1p-24);
    numbers.u[2] = numbers.u[3] = 0;
    return numbers;
}
#endif

// A sample's own numbers: of its place in the pixel, 0 and 1, or on the lens, 2 and 3.
DEVICE Uniform draw_own(const Scene *scene, Draws who)
{
#if NEED_SOBOL
    if (scene->at.sampler == SOBOL) {
        Uniform numbers = point_of_sequence(scene, who, 0, PLACE, who.sample);
        if (scene->at.lens) {
            const Uniform lens = point_of_sequence(scene, who, 0, ON_LENS, who.sample);
            numbers.u[2] = lens.u[0], numbers.u[3] = lens.u[1];
        }
        return numbers;
    }
#endif
    return draw(who, 0, 0);
}

// SOF-2: numbers 0 and 1 of feeler f to a light.
DEVICE Uniform draw_for_feeler(const Scene *scene, Draws who, uint path, uint light, uint f)
{
    const uint feelers = (uint)scene->at.feelers;
#if NEED_SOBOL
    const uint purpose = (uint)(scene->at.first_light + who.order * scene->at.each_order) + 2 * light;
    if (scene->at.sampler == SOBOL && purpose < DIMENSIONS)
        return point_of_sequence(scene, who, path, purpose, who.sample * feelers + f);
#endif
    return draw(who, path, 1 + light * feelers + f);
}

// GLO-2: numbers 0 and 1 of glossy ray g.
DEVICE Uniform draw_for_lobe(const Scene *scene, Draws who, uint path, uint g)
{
#if NEED_SOBOL
    const uint purpose = (uint)(scene->at.first_light + who.order * scene->at.each_order + scene->at.light_dimensions);
    if (scene->at.sampler == SOBOL && purpose < DIMENSIONS)
        return point_of_sequence(scene, who, path, purpose, who.sample * (uint)scene->at.glossy_rays + g);
#endif
    return draw(who, path, 0x80000000u + g);
}
