// From a pixel to its samples (CAM, LEN, SAM), and the kernels: each group takes one tile of the picture after the other,
// each thread a pixel of it.

// CAM-2, CAM-3: the ray through a place of the picture, in pixels from its top left corner; LEN-1 if there is a lens.
DEVICE Ray eye_ray(const Scene *scene, Desk *desk, real column, real row)
{
    const real x = 2 * column / (real)scene->at.width - 1, y = 1 - 2 * row / (real)scene->at.height;
    const real3 to_screen = x * triple(scene, U) + y * triple(scene, V) - triple(scene, E);
    Ray ray;
    ray.origin = triple(scene, EYE);
#if NEED_LENS
    if (scene->at.lens) {
        const Uniform numbers = draw_own(scene, desk->draws);
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
    desk->primary += desk->there;
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
// SAM-1 to SAM-3, SAM-7, and CAM-4 as one of one sample.
DEVICE real3 mean_of_samples(const Scene *scene, Desk *desk, int i, int j)
{
    const int n = scene->at.row_length, samples = scene->at.samples, sampler = scene->at.sampler;
    real3 sum = R3(0, 0, 0), line = R3(0, 0, 0);
    int s = 0;
    do {
        desk->draws.pixel = (uint)j * (uint)scene->at.width + (uint)i, desk->draws.sample = (uint)s;
        real x = R(0.5), y = R(0.5);
        if (sampler == JITTERED || sampler == SOBOL) {
            const Uniform numbers = draw_own(scene, desk->draws);
            x = numbers.u[0], y = numbers.u[1];
        }
        if (sampler != SOBOL)
            x = ((real)(s % n) + x) / (real)n, y = ((real)(s / n) + y) / (real)n;
        x = x + (number(scene, SAMPLE) - R(0.5)), y = y + (number(scene, SAMPLE + 1) - R(0.5));
        if (sampler == ONE)
            x = number(scene, SAMPLE), y = number(scene, SAMPLE + 1);
        line = line + sample_at(scene, desk, (real)i + x, (real)j + y);
        if (s % n == n - 1 || s == samples - 1) {
            sum = sum + line;
            line = R3(0, 0, 0);
        }
    } while (++s < samples);
    desk->dropped = desk->dropped / (real)samples;  // CUT-2
    return sum / (real)samples;
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
    return mean_of_samples(scene, desk, i, j);
#else
    return one_sample(scene, desk, i, j);
#endif
}

#if defined(MEMORY_CONSTANT) && !defined(__OPENCL_VERSION__)
__constant__ real constant_numbers[NUMBERS];
__constant__ int constant_integers[INTEGERS];
#endif

// What the threads of a group share: a number of each, and the scene if it is there. OpenCL gets it as arguments: PoCL 3.1
// lets groups that run at once share what is declared in the kernel.
#ifdef __OPENCL_VERSION__
#if defined(MEMORY_SHARED)
#define SHARED_ARGUMENTS , LOCAL ulong *scratch, LOCAL real *shared_numbers, LOCAL int *shared_integers
#elif STREAMED
#define SHARED_ARGUMENTS , LOCAL ulong *scratch, LOCAL real *tile
#else
#define SHARED_ARGUMENTS , LOCAL ulong *scratch
#endif
#define DECLARE_SHARED
#else
#define SHARED_ARGUMENTS
#if defined(MEMORY_SHARED)
#define DECLARE_SHARED                                                                                                 \
    LOCAL ulong scratch[THREADS];                                                                                      \
    LOCAL real shared_numbers[NUMBERS];                                                                                \
    LOCAL int shared_integers[INTEGERS];
#elif STREAMED
#define DECLARE_SHARED                                                                                                 \
    LOCAL ulong scratch[THREADS];                                                                                      \
    LOCAL real tile[TILE_NUMBERS];
#else
#define DECLARE_SHARED LOCAL ulong scratch[THREADS];
#endif
#endif

// The scene that the kernel was given; all threads of a group make it at once.
#if defined(MEMORY_SHARED)
#define SCENE_ARGUMENTS GLOBAL const real *numbers, GLOBAL const int *integers, Layout at
#define COPY(from, to, count)                                                                                          \
    for (int k = RANK_IN_GROUP; k < count; k += THREADS)                                                               \
        to[k] = from[k];
#if defined(FAULT_INDEX) || defined(FAULT_BARRIER)  // exhibits start from zeros, not from what was there before
#define EMPTIED()                                                                                                      \
    for (int k = RANK_IN_GROUP; k < NUMBERS; k += THREADS)                                                             \
        shared_numbers[k] = 0;                                                                                         \
    for (int k = RANK_IN_GROUP; k < INTEGERS; k += THREADS)                                                            \
        shared_integers[k] = 0;                                                                                        \
    BARRIER();
#else
#define EMPTIED()
#endif
#ifdef FAULT_INDEX  // of an exhibit: rows of materials counted from the group's place in the picture, not from the first
#define COPY_MATERIALS()                                                                                               \
    BARRIER();                                                                                                         \
    for (int k = RANK_IN_GROUP; k < at.air * MATERIAL; k += THREADS)                                                   \
        shared_numbers[at.materials_at + k] =                                                                          \
            numbers[at.materials_at + (k + (GROUP_ROW + GROUP_COLUMN) * MATERIAL) % (at.air * MATERIAL)];
#else
#define COPY_MATERIALS()
#endif
#ifdef FAULT_BARRIER  // of an exhibit
#define FILLED()
#else
#define FILLED() BARRIER();
#endif
#define MAKE_SCENE()                                                                                                   \
    DECLARE_SHARED                                                                                                     \
    EMPTIED()                                                                                                          \
    COPY(numbers, shared_numbers, NUMBERS)                                                                             \
    COPY(integers, shared_integers, INTEGERS)                                                                          \
    COPY_MATERIALS()                                                                                                   \
    FILLED()                                                                                                           \
    Scene scene;                                                                                                       \
    scene.numbers = shared_numbers, scene.integers = shared_integers, scene.at = at;
#elif defined(MEMORY_CONSTANT) && !defined(__OPENCL_VERSION__)
#define SCENE_ARGUMENTS Layout at
#define MAKE_SCENE()                                                                                                   \
    DECLARE_SHARED                                                                                                     \
    Scene scene;                                                                                                       \
    scene.numbers = constant_numbers, scene.integers = constant_integers, scene.at = at;
#else
#define SCENE_ARGUMENTS SCENE const real *numbers, SCENE const int *integers, Layout at
#define MAKE_SCENE()                                                                                                   \
    DECLARE_SHARED                                                                                                     \
    Scene scene;                                                                                                       \
    scene.numbers = numbers, scene.integers = integers, scene.at = at;                                                 \
    MAKE_TILE()
#if STREAMED
#define MAKE_TILE() scene.tile = tile, scene.vote = (SHARED int *)scratch;  // free until counts are added up
#else
#define MAKE_TILE()
#endif
#endif

// The counts of all threads of a group, added up in pairs: five numbers for each group.
DEVICE void add_up(SHARED ulong *scratch, const Desk *desk, GLOBAL ulong *sums)
{
    const int rank = RANK_IN_GROUP;
    int which = 0;
    do {
        BARRIER();
        scratch[rank] = which == 0   ? desk->primary
                        : which == 1 ? desk->reflected
                        : which == 2 ? desk->transmitted
                        : which == 3 ? desk->shadow
                                     : desk->non_finite;
        int left = THREADS;
        do {
            BARRIER();
            const int half_of_them = (left + 1) / 2;
            if (rank + half_of_them < left)
                scratch[rank] += scratch[rank + half_of_them];
            left = half_of_them;
        } while (left > 1);
        BARRIER();
        if (rank == 0)
            sums[which] = scratch[0];
    } while (++which < 5);
}

DEVICE Desk desk_of(const Scene *scene, GLOBAL uchar *memory)
{
    Desk desk;
    desk.reflected = desk.transmitted = desk.shadow = desk.primary = desk.non_finite = 0;
#if NEED_CSG
    desk.scratch.overflow = false;
#endif
    desk.draws.seed = (uint)scene->at.seed, desk.draws.pixel = 0, desk.draws.sample = 0;
    desk.draws.order = 0;
    desk.dropped = 0, desk.there = true;
    const int group = GROUP_ROW * GROUPS_ACROSS + GROUP_COLUMN;
    const int thread = (group * GROUP_HEIGHT + ROW_IN_GROUP) * GROUP_WIDTH + COLUMN_IN_GROUP;
    desk.memory = memory + thread * memory_bytes(&scene->at);
    return desk;
}

#define ADD_UP_COUNTS() add_up(scratch, &desk, counts + 5 * (GROUP_ROW * GROUPS_ACROSS + GROUP_COLUMN));

#if KIND_IMAGE

// picture: linear RGB of the region. dropped: of its pixels (CUT-2). corners: of its pixels, for `adaptive`. memory: of
// all threads. counts: primary, reflected, transmitted, shadow and non-finite of each group.
KERNEL render_pixels(SCENE_ARGUMENTS, GLOBAL uchar *memory, GLOBAL const real *corners, GLOBAL real *picture,
                     GLOBAL real *dropped, GLOBAL ulong *counts SHARED_ARGUMENTS)
{
    MAKE_SCENE()
    Desk desk = desk_of(&scene, memory);
    const int columns = at.x1 - at.x0, rows = at.y1 - at.y0;
    int top = GROUP_ROW * GROUP_HEIGHT;
    do {
        int left = GROUP_COLUMN * GROUP_WIDTH;
        do {
            const int row = top + ROW_IN_GROUP, column = left + COLUMN_IN_GROUP;
            desk.there = row < rows && column < columns;
            if (!STREAMED && !desk.there)
                continue;
            const real3 colour = pixel_of(&scene, &desk, corners, at.x0 + column, at.y0 + row);
            if (!desk.there)
                continue;
            GLOBAL real *pixel = picture + 3 * ((long)row * columns + column);
            pixel[0] = colour.x, pixel[1] = colour.y, pixel[2] = colour.z;
#if NEED_CUTOFF
            dropped[(long)row * columns + column] = desk.dropped;
            desk.dropped = 0;
#endif
        } while ((left += GROUPS_ACROSS * GROUP_WIDTH) < columns);
    } while ((top += GROUPS_DOWN * GROUP_HEIGHT) < rows);
    ADD_UP_COUNTS()
}

#if NEED_ADAPTIVE
// SAM-5: the corners of the region's pixels, before the picture.
KERNEL render_corners(SCENE_ARGUMENTS, GLOBAL uchar *memory, GLOBAL real *corners, GLOBAL ulong *counts SHARED_ARGUMENTS)
{
    MAKE_SCENE()
    Desk desk = desk_of(&scene, memory);
    const int columns = at.x1 - at.x0 + 1, rows = at.y1 - at.y0 + 1;
    for (int row = GROUP_ROW * GROUP_HEIGHT + ROW_IN_GROUP; row < rows; row += GROUPS_DOWN * GROUP_HEIGHT)
        for (int column = GROUP_COLUMN * GROUP_WIDTH + COLUMN_IN_GROUP; column < columns;
             column += GROUPS_ACROSS * GROUP_WIDTH) {
            const real3 colour = trace_point(&scene, &desk, (at.x0 + column) << at.levels, (at.y0 + row) << at.levels);
            GLOBAL real *corner = corners + 3 * ((long)row * columns + column);
            corner[0] = colour.x, corner[1] = colour.y, corner[2] = colour.z;
        }
    ADD_UP_COUNTS()
}
#endif

#else

// First hits. rays: origin and direction of each. hits: t, point, normal and object of each; t of a miss is infinite.
KERNEL trace_rays(SCENE_ARGUMENTS, GLOBAL uchar *memory, GLOBAL const real *rays, int count, GLOBAL real *hits
                  SHARED_ARGUMENTS)
{
    MAKE_SCENE()
    Desk desk = desk_of(&scene, memory);
    const int group = GROUP_ROW * GROUPS_ACROSS + GROUP_COLUMN;
    for (int first = group * THREADS; first < count; first += GROUPS_ACROSS * GROUPS_DOWN * THREADS) {
        const int k = first + RANK_IN_GROUP;
        desk.there = k < count;
        if (!STREAMED && !desk.there)
            continue;
        const long from = desk.there ? k : 0;
        Ray ray;
        ray.origin = LOAD3(rays + 6 * from), ray.direction = LOAD3(rays + 6 * from + 3);
        const Hit hit = search(&scene, ray, &desk, FAR, false, desk.there);
        if (!desk.there)
            continue;
        GLOBAL real *answer = hits + 8 * (long)k;
        for (int n = 0; n < 8; n++)
            answer[n] = 0;
        answer[0] = hit.shape < 0 ? (real)INFINITY : hit.t, answer[7] = -1;
        if (hit.shape >= 0) {
            const Surface at_hit = surface_of(&scene, ray, &desk, hit);
            answer[1] = at_hit.point.x, answer[2] = at_hit.point.y, answer[3] = at_hit.point.z;
            answer[4] = at_hit.normal.x, answer[5] = at_hit.normal.y, answer[6] = at_hit.normal.z;
            answer[7] = scene.integers[at.roles_at + ROLE * hit.shape + OBJECT];
        }
#if NEED_CSG
        if (desk.scratch.overflow) {  // CSG-6
            for (int n = 0; n < 8; n++)
                answer[n] = n == 0 ? (real)NAN : n == 7 ? -1 : 0;
            desk.scratch.overflow = false;
        }
#endif
    }
}

#endif

// Bytes of memory that a thread needs, and of them the rows of its walk.
KERNEL sizes(Layout at, GLOBAL ulong *bytes)
{
    bytes[0] = memory_bytes(&at), bytes[1] = rows_bytes(&at);
}
