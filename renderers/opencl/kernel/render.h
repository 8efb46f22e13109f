// The kernels. Each group takes one tile of the picture after the other, each thread a pixel of it.

#if defined(MEMORY_CONSTANT) && !defined(__OPENCL_VERSION__)
__constant__ real constant_numbers[NUMBERS];
__constant__ int constant_integers[INTEGERS];
#endif

// What the threads of a group share: a number of each, and the scene if it is there. OpenCL gets it as arguments: PoCL 3.1
// lets groups that run at once share what is declared in the kernel.
#define THREADS (GROUP_WIDTH * GROUP_HEIGHT)
#ifdef __OPENCL_VERSION__
#ifdef MEMORY_SHARED
#define SHARED_ARGUMENTS , LOCAL ulong *scratch, LOCAL real *shared_numbers, LOCAL int *shared_integers
#else
#define SHARED_ARGUMENTS , LOCAL ulong *scratch
#endif
#define DECLARE_SHARED
#else
#define SHARED_ARGUMENTS
#ifdef MEMORY_SHARED
#define DECLARE_SHARED                                                                                                 \
    LOCAL ulong scratch[THREADS];                                                                                      \
    LOCAL real shared_numbers[NUMBERS];                                                                                \
    LOCAL int shared_integers[INTEGERS];
#else
#define DECLARE_SHARED LOCAL ulong scratch[THREADS];
#endif
#endif

// The scene that the kernel was given; all threads of a group make it at once.
#if defined(MEMORY_SHARED)
#define SCENE_ARGUMENTS GLOBAL const real *numbers, GLOBAL const int *integers, Layout at
#define COPY(from, to, count)                                                                                          \
    for (int k = ROW_IN_GROUP * GROUP_WIDTH + COLUMN_IN_GROUP; k < count; k += THREADS)                                \
        to[k] = from[k];
#if defined(FAULT_INDEX) || defined(FAULT_BARRIER)  // exhibits start from zeros, not from what was there before
#define EMPTIED()                                                                                                      \
    for (int k = ROW_IN_GROUP * GROUP_WIDTH + COLUMN_IN_GROUP; k < NUMBERS; k += THREADS)                              \
        shared_numbers[k] = 0;                                                                                         \
    for (int k = ROW_IN_GROUP * GROUP_WIDTH + COLUMN_IN_GROUP; k < INTEGERS; k += THREADS)                             \
        shared_integers[k] = 0;                                                                                        \
    BARRIER();
#else
#define EMPTIED()
#endif
#ifdef FAULT_INDEX  // of an exhibit: rows of materials counted from the group's place in the picture, not from the first
#define COPY_MATERIALS()                                                                                               \
    BARRIER();                                                                                                         \
    for (int k = ROW_IN_GROUP * GROUP_WIDTH + COLUMN_IN_GROUP; k < at.air * MATERIAL; k += THREADS)                    \
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
    scene.numbers = numbers, scene.integers = integers, scene.at = at;
#endif

// The counts of all threads of a group, added up in pairs: five numbers for each group.
DEVICE void add_up(SHARED ulong *scratch, ulong mine, GLOBAL ulong *sum)
{
    const int rank = ROW_IN_GROUP * GROUP_WIDTH + COLUMN_IN_GROUP;
    BARRIER();
    scratch[rank] = mine;
    for (int left = THREADS; left > 1;) {
        BARRIER();
        const int half_of_them = (left + 1) / 2;
        if (rank + half_of_them < left)
            scratch[rank] += scratch[rank + half_of_them];
        left = half_of_them;
    }
    BARRIER();
    if (rank == 0)
        *sum = scratch[0];
}

DEVICE Desk desk_of(const Scene *scene, GLOBAL uchar *memory)
{
    Desk desk;
    desk.reflected = desk.transmitted = desk.shadow = desk.primary = desk.non_finite = 0;
#if NEED_CSG
    desk.scratch.overflow = false;
#endif
    desk.draws.seed = (uint)scene->at.seed, desk.draws.pixel = 0, desk.draws.sample = 0;
    desk.dropped = 0;
    const int group = GROUP_ROW * GROUPS_ACROSS + GROUP_COLUMN;
    const int thread = (group * GROUP_HEIGHT + ROW_IN_GROUP) * GROUP_WIDTH + COLUMN_IN_GROUP;
    desk.memory = memory + thread * memory_bytes(&scene->at);
    return desk;
}

#define ADD_UP_COUNTS()                                                                                                \
    GLOBAL ulong *of_group = counts + 5 * (GROUP_ROW * GROUPS_ACROSS + GROUP_COLUMN);                                  \
    add_up(scratch, desk.primary, of_group);                                                                           \
    add_up(scratch, desk.reflected, of_group + 1);                                                                     \
    add_up(scratch, desk.transmitted, of_group + 2);                                                                   \
    add_up(scratch, desk.shadow, of_group + 3);                                                                        \
    add_up(scratch, desk.non_finite, of_group + 4);

#if KIND_IMAGE

// picture: linear RGB of the region. dropped: of its pixels (CUT-2). corners: of its pixels, for `adaptive`. memory: of
// all threads. counts: primary, reflected, transmitted, shadow and non-finite of each group.
KERNEL render_pixels(SCENE_ARGUMENTS, GLOBAL uchar *memory, GLOBAL const real *corners, GLOBAL real *picture,
                     GLOBAL real *dropped, GLOBAL ulong *counts SHARED_ARGUMENTS)
{
    MAKE_SCENE()
    Desk desk = desk_of(&scene, memory);
    const int columns = at.x1 - at.x0, rows = at.y1 - at.y0;
    for (int row = GROUP_ROW * GROUP_HEIGHT + ROW_IN_GROUP; row < rows; row += GROUPS_DOWN * GROUP_HEIGHT)
        for (int column = GROUP_COLUMN * GROUP_WIDTH + COLUMN_IN_GROUP; column < columns;
             column += GROUPS_ACROSS * GROUP_WIDTH) {
            const real3 colour = pixel_of(&scene, &desk, corners, at.x0 + column, at.y0 + row);
            GLOBAL real *pixel = picture + 3 * ((long)row * columns + column);
            pixel[0] = colour.x, pixel[1] = colour.y, pixel[2] = colour.z;
#if NEED_CUTOFF
            dropped[(long)row * columns + column] = desk.dropped;
            desk.dropped = 0;
#endif
        }
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
    const int thread = group * THREADS + ROW_IN_GROUP * GROUP_WIDTH + COLUMN_IN_GROUP;
    for (int k = thread; k < count; k += GROUPS_ACROSS * GROUPS_DOWN * THREADS) {
        Ray ray;
        ray.origin = LOAD3(rays + 6 * (long)k), ray.direction = LOAD3(rays + 6 * (long)k + 3);
        const Hit hit = search(&scene, ray, &desk, FAR, false);
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
