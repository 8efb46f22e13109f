// From a pixel to its samples (CAM, LEN, SAM).

// CAM-2, CAM-3: the ray through a place of the picture, in pixels from its top left corner; LEN-1 if there is a lens.
DEVICE Ray eye_ray(const Scene *scene, Desk *desk, real column, real row)
{
    const real x = 2 * column / (real)scene->at.width - 1, y = 1 - 2 * row / (real)scene->at.height;
    const real3 to_screen = x * triple(scene, U) + y * triple(scene, V) - triple(scene, E);
    Ray ray;
    ray.origin = triple(scene, EYE);
#if NEED_LENS
    if (scene->at.lens) {
        const Uniform numbers = draw(desk->draws, 0, 0);
        const real rho = sqrt(numbers.u[2]), turn = 2 * numbers.u[3];
        const real3 h = rho * cospi(turn) * triple(scene, LENS_U) + rho * sinpi(turn) * triple(scene, LENS_V);
        ray.origin = ray.origin + h;
        ray.direction = normalise3(number(scene, FOCUS) * to_screen - h);
        return ray;
    }
#endif
    ray.direction = normalise3(to_screen);
    return ray;
}

// A sample at a place of the picture.
DEVICE real3 sample_at(const Scene *scene, Desk *desk, real column, real row)
{
    Branch eye;
    eye.ray = eye_ray(scene, desk, column, row);
    eye.inside = (ulong)(uint)scene->at.eye_high << 32 | (ulong)(uint)scene->at.eye_low;
    eye.path = 0;
    real3 colour = colour_of(scene, desk, eye);
#if NEED_CSG
    if (desk->scratch.overflow) {  // CSG-6
        colour = R3(NAN, NAN, NAN);
        desk->scratch.overflow = false;
    }
#endif
    desk->primary++;
    desk->non_finite += is_finite(colour.x) && is_finite(colour.y) && is_finite(colour.z) ? 0 : 1;
    return colour;
}

// CAM-4
DEVICE real3 one_sample(const Scene *scene, Desk *desk, int i, int j)
{
    desk->draws.pixel = (uint)j * (uint)scene->at.width + (uint)i, desk->draws.sample = 0;
    return sample_at(scene, desk, (real)i + number(scene, SAMPLE), (real)j + number(scene, SAMPLE + 1));
}

#if NEED_SUPERSAMPLING
// SAM-1 to SAM-3
DEVICE real3 mean_of_samples(const Scene *scene, Desk *desk, int i, int j)
{
    const int n = scene->at.samples;
    real3 sum = R3(0, 0, 0);
    for (int s = 0; s < n * n; s++) {
        desk->draws.pixel = (uint)j * (uint)scene->at.width + (uint)i, desk->draws.sample = (uint)s;
        real x = R(0.5), y = R(0.5);
        if (scene->at.sampler == JITTERED) {
            const Uniform numbers = draw(desk->draws, 0, 0);
            x = numbers.u[0], y = numbers.u[1];
        }
        x = ((real)(s % n) + x) / (real)n + (number(scene, SAMPLE) - R(0.5));
        y = ((real)(s / n) + y) / (real)n + (number(scene, SAMPLE + 1) - R(0.5));
        sum = sum + sample_at(scene, desk, (real)i + x, (real)j + y);
    }
    desk->dropped = desk->dropped / ((real)n * (real)n);  // CUT-2
    return sum / ((real)n * (real)n);
}
#endif

#if NEED_ADAPTIVE
#define MOST_LEVELS 8  // of a job

// SAM-5: a point of the lattice inside a pixel.
typedef struct {
    real3 colour;
    int traced;
} Point;

// SAM-4: a point of the lattice.
DEVICE real3 trace_point(const Scene *scene, Desk *desk, int a, int b)
{
    const int side = 1 << scene->at.levels;
    desk->draws.pixel = (uint)b * ((uint)side * (uint)scene->at.width + 1) + (uint)a, desk->draws.sample = 0;
    const real x = (real)a / (real)side + (number(scene, SAMPLE) - R(0.5));
    return sample_at(scene, desk, x, (real)b / (real)side + (number(scene, SAMPLE + 1) - R(0.5)));
}

// SAM-5: the point (a, b) of the lattice of pixel (i, j). corners: of the region's pixels.
DEVICE real3 point_of(const Scene *scene, Desk *desk, GLOBAL const real *corners, int i, int j, int a, int b)
{
    const int side = 1 << scene->at.levels;
    if (a % side == 0 && b % side == 0) {
        const int row = j - scene->at.y0 + b / side, column = i - scene->at.x0 + a / side;
        return LOAD3(corners + 3 * (row * (scene->at.x1 - scene->at.x0 + 1) + column));
    }
    GLOBAL Point *point = (GLOBAL Point *)(desk->memory + rows_bytes(&scene->at)) + b * (side + 1) + a;
    if (!point->traced) {
        point->colour = trace_point(scene, desk, i * side + a, j * side + b);
        point->traced = 1;
    }
    return point->colour;
}

DEVICE bool spread(real a, real b, real c, real d, real threshold)
{
    return most(most(a, b), most(c, d)) - least(least(a, b), least(c, d)) > threshold;
}

// SAM-4: the squares of pixel (i, j), from the whole pixel down to the lattice: `square` has the open square of each
// level, its top left point and how many of its quarters are done, `quarter` the colours of its corners, then quarters.
DEVICE real3 adaptive(const Scene *scene, Desk *desk, GLOBAL const real *corners, int i, int j)
{
    const int side = 1 << scene->at.levels;
    GLOBAL Point *points = (GLOBAL Point *)(desk->memory + rows_bytes(&scene->at));
    for (int k = 0; k < (side + 1) * (side + 1); k++)
        points[k].traced = 0;
    real3 quarter[MOST_LEVELS + 1][4];
    int square[MOST_LEVELS + 1][3], level = 0, a = 0, b = 0;
    for (;;) {
        int size = side >> level;
        real3 *c = quarter[level];
        for (int k = 0; k < 4; k++)
            c[k] = point_of(scene, desk, corners, i, j, a + (k & 1) * size, b + (k >> 1) * size);
        const real threshold = number(scene, THRESHOLD);
        if (size > 1 && (spread(c[0].x, c[1].x, c[2].x, c[3].x, threshold) ||
                         spread(c[0].y, c[1].y, c[2].y, c[3].y, threshold) ||
                         spread(c[0].z, c[1].z, c[2].z, c[3].z, threshold))) {
            square[level][0] = a, square[level][1] = b, square[level][2] = 0;
            level++;
            continue;
        }
        real3 colour = ((c[0] + c[1]) + (c[2] + c[3])) / R(4);
        for (;;) {
            if (level == 0)
                return colour;
            const int done = square[level - 1][2]++;
            quarter[level - 1][done] = colour;
            if (done < 3) {
                size = side >> level;
                a = square[level - 1][0] + ((done + 1) & 1) * size, b = square[level - 1][1] + ((done + 1) >> 1) * size;
                break;
            }
            level--;
            c = quarter[level];
            colour = ((c[0] + c[1]) + (c[2] + c[3])) / R(4);
        }
    }
}
#endif

// Bytes of memory of a thread: rows of its walk, and points of a lattice.
DEVICE ulong memory_bytes(const Layout *at)
{
    ulong bytes = rows_bytes(at);
#if NEED_ADAPTIVE
    const int points = (1 << at->levels) + 1;
    if (at->sampler == ADAPTIVE)
        bytes += (ulong)points * points * sizeof(Point);
#endif
    return bytes;
}

// Pixel (i, j) of the picture.
DEVICE real3 pixel_of(const Scene *scene, Desk *desk, GLOBAL const real *corners, int i, int j)
{
#if NEED_ADAPTIVE
    if (scene->at.sampler == ADAPTIVE)
        return adaptive(scene, desk, corners, i, j);
#endif
#if NEED_SUPERSAMPLING
    if (scene->at.sampler != ONE)
        return mean_of_samples(scene, desk, i, j);
#endif
    return one_sample(scene, desk, i, j);
}
