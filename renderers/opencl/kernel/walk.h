// From a ray to its colour, through all the rays that come after it (WLK-1): as a loop where no ray has two children,
// with rays that wait, or by the study's table.

// A ray that waits, with what its colour counts for in the sample.
typedef struct {
    Branch branch;
    Factor weight;
    int order;
} Waiting;

// A row of the table: a ray, its light and that of its children so far, and what its colour counts for in its parent's.
typedef struct {
    Branch branch;
    real3 light;
    Factor attenuation;
    real share;
    int order, used;
} Row;

// Bytes of the rows of a thread.
DEVICE ulong rows_bytes(const Layout *at)
{
#ifdef WALK_TABLE
    return (ulong)at->rows * sizeof(Row);
#else
    return (ulong)at->rows * sizeof(Waiting);
#endif
}

#if defined(WALK_CHAIN)

DEVICE real3 colour_of(const Scene *scene, Desk *desk, Branch branch)
{
    real3 sum = R3(0, 0, 0);
    Factor weight = UNDIMMED;
    bool busy = desk->there;
    int order = 0;
    do {
        const Meeting meeting = meet(scene, desk, &branch, order, busy);
        if (!busy)
            continue;
        weight = weight * meeting.attenuation;
        sum = sum + weight * meeting.light;
        Branch child;
        const real share = child_of(scene, desk, &branch, &meeting, 0, weight, &child);
        if (share == 0) {
            if (!STREAMED)
                return sum;
            busy = false;
            continue;
        }
        weight = share * weight;
        branch = child;
        order++;
    } while (IN_STEP(busy));
    return sum;
}

#elif defined(WALK_STACK)

// The last of a ray's children is followed at once; its siblings wait, and the last that came goes first, so that of
// each order the siblings of one ray wait at most.
DEVICE real3 colour_of(const Scene *scene, Desk *desk, Branch eye)
{
    GLOBAL Waiting *waiting = (GLOBAL Waiting *)desk->memory;
    const uint children = path_base(scene);
    real3 sum = R3(0, 0, 0);
    int count = 0;
    bool busy = desk->there;
    Waiting now;
    now.branch = eye, now.weight = UNDIMMED, now.order = 0;
    do {
        const Meeting meeting = meet(scene, desk, &now.branch, now.order, busy);
        if (!busy)
            continue;
        const Factor weight = now.weight * meeting.attenuation;
        sum = sum + weight * meeting.light;
        bool more = false;
        Waiting next;
        for (uint which = 0; which < children; which++) {
            Branch child;
            const real share = child_of(scene, desk, &now.branch, &meeting, which, weight, &child);
            if (share == 0)
                continue;
            if (more)
                waiting[count++] = next;
            more = true;
            next.branch = child, next.weight = share * weight, next.order = now.order + 1;
        }
        if (!more && count == 0) {
            if (!STREAMED)
                return sum;
            busy = false;
            continue;
        }
        now = more ? next : waiting[--count];
    } while (IN_STEP(busy));
    return sum;
}

#else

// The study's rows (2.7.4): down the tree for the rays, and up again for the colours. No row is in use before or after.
DEVICE real3 colour_of(const Scene *scene, Desk *desk, Branch eye)
{
    GLOBAL Row *table = (GLOBAL Row *)desk->memory;
    const uint children = path_base(scene);
    const int rows = scene->at.rows, base = scene->at.table_base;
    table[0].branch = eye, table[0].order = 0, table[0].used = 1;
    for (int p = 0; p < rows; p++) {
        if (!table[p].used)
            continue;
        const Branch branch = table[p].branch;
        const int order = table[p].order;
        const Meeting meeting = meet(scene, desk, &branch, order, true);
        table[p].light = meeting.light, table[p].attenuation = meeting.attenuation;
        for (uint which = 0; which < children; which++) {
            Branch child;
            const real share = child_of(scene, desk, &branch, &meeting, which, UNDIMMED, &child);
            if (share == 0)
                continue;
            GLOBAL Row *below = table + p * base + 1 + which;
            below->branch = child, below->share = share, below->order = order + 1, below->used = 1;
        }
    }
    for (int p = rows - 1; p > 0; p--) {
        if (!table[p].used)
            continue;
        GLOBAL Row *above = table + (p - 1) / base;
        above->light = above->light + table[p].share * (table[p].attenuation * table[p].light);
        table[p].used = 0;
    }
    return table[0].attenuation * table[0].light;
}

#endif
