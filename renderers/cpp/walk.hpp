// From a ray to its colour, through all the rays that come after it (WLK-1).
#pragma once
#include "trace.hpp"

#include <cstdio>

// A ray that waits, with what its colour counts for in the pixel.
template<typename Real>
struct Waiting {
    Branch<Real> branch;
    Factor<Real> weight;
    int order;
};

// A row of the table: a ray, its light and that of its children so far, and what its colour counts for in its parent's.
template<typename Real>
struct Row {
    Branch<Real> branch;
    Vec3<Real> light;
    Factor<Real> attenuation;
    Real share;
    int order;
    bool used;
};

// The memory of a walk: one for each thread.
template<typename Real>
struct WalkRows {
    std::vector<Waiting<Real>> stack;
    std::vector<Row<Real>> table;
};

// WLK-2
inline void require_chain(Walk walk, int children)
{
    if (walk == Walk::chain && children > 1)
        throw Unsupported("a chain is for one child of each ray, here one can have " + std::to_string(children));
}

template<typename Real>
class Walker {
public:
    Walker(const Tracer<Real>& tracer, Walk asked, double cutoff = 0)
        : tracer(tracer), children(tracer.children()), walk(asked), cutoff(cutoff > 0 ? Real(cutoff) : -1)
    {
        if (walk == Walk::least)
            walk = children == 1 ? Walk::chain : Walk::stack;
        require_chain(walk, children);
        if (needs::cutoff && cutoff > 0 && walk != Walk::chain && walk != Walk::stack)  // CUT-4
            throw Unsupported("a cutoff needs the walk chain or stack, which know the weight of a ray when it leaves");
        if (walk == Walk::stack)
            rows = 1 + std::size_t(tracer.depth) * std::size_t(children - 1);
        if (walk == Walk::table)
            rows = table_rows();
    }

    const Tracer<Real>& tracer;

    Walk method() const { return walk; }
    bool has_rows() const { return walk == Walk::table || walk == Walk::stack; }

    // WLK-2: of one pixel in work.
    std::size_t row_count() const { return rows; }
    std::size_t bytes() const { return rows * (walk == Walk::table ? sizeof(Row<Real>) : sizeof(Waiting<Real>)); }

    void make_room(WalkRows<Real>& memory) const
    {
        if (walk == Walk::stack)
            memory.stack.resize(rows);
        if (walk == Walk::table)
            memory.table.resize(rows);
    }

    Vec3<Real> colour(const Ray<Real>& eye_ray, Desk<Real>& desk, WalkRows<Real>& memory) const
    {
        const Branch<Real> eye{eye_ray, tracer.media.at_eye(), 0};
        switch (walk) {
        case Walk::chain: return chain(eye, desk);
        case Walk::stack: return stack(eye, desk, memory.stack);
        case Walk::table: return table(eye, desk, memory.table);
        default: return recursion(eye, 0, desk);
        }
    }

private:
    static constexpr double most_bytes = 0x1p31;  // of a table

    int children;
    Walk walk;
    [[no_unique_address]] Only<needs::cutoff, Real, 'c'> cutoff;  // below any weight where nothing is cut
    std::size_t rows = 0;

    // CUT-1: a ray of this weight is not traced, and is counted in the dropped weight (CUT-2).
    bool cut(const Factor<Real>& weight, Desk<Real>& desk) const
    {
        if constexpr (needs::cutoff) {
            const Real most = most_of(weight);
            if (most <= cutoff) {
                desk.dropped += most;
                return true;
            }
        }
        return false;
    }

    static bool keep(Real) { return false; }

    int table_base() const { return std::max(children, 2); }

    // A row for every ray that there could be.
    std::size_t table_rows() const
    {
        double sum = 0;
        for (int order = 0; order <= tracer.depth; order++)
            sum = sum * table_base() + 1;
        const double bytes = sum * sizeof(Row<Real>);
        if (bytes > most_bytes) {
            char text[800];  // of numbers below 1e308
            std::snprintf(text, sizeof text, "a table of %.0f rows takes %.0f bytes for a pixel in work", sum, bytes);
            throw Unsupported(text);
        }
        return std::size_t(sum);
    }

    // A loop: no ray has two children.
    Vec3<Real> chain(Branch<Real> branch, Desk<Real>& desk) const
    {
        Vec3<Real> sum{0, 0, 0};
        Factor<Real> weight = no_attenuation<Real>();
        for (int order = 0;; order++) {
            bool more = false;
            Branch<Real> next;
            tracer.follow(
                branch, order, desk,
                [&](const Vec3<Real>& light, const Factor<Real>& attenuation) {
                    weight = weight * attenuation;
                    sum = sum + weight * light;
                },
                [&](Real share) { return cut(share * weight, desk); },
                [&](int, const Branch<Real>& child, Real share) {
                    more = true;
                    next = child;
                    weight = share * weight;
                });
            if (!more)
                return sum;
            branch = next;
        }
    }

    // The last of a ray's children is followed at once; its siblings wait, and the last that came goes first, so that of
    // each order the siblings of one ray wait at most.
    [[gnu::noinline]] Vec3<Real> stack(const Branch<Real>& eye, Desk<Real>& desk,
                                       std::vector<Waiting<Real>>& waiting) const
    {
        Vec3<Real> sum{0, 0, 0};
        std::size_t count = 0;
        Waiting<Real> now{eye, no_attenuation<Real>(), 0};
        for (;;) {
            bool more = false;
            Waiting<Real> next;
            tracer.follow(
                now.branch, now.order, desk,
                [&](const Vec3<Real>& light, const Factor<Real>& attenuation) {
                    now.weight = now.weight * attenuation;
                    sum = sum + now.weight * light;
                },
                [&](Real share) { return cut(share * now.weight, desk); },
                [&](int, const Branch<Real>& child, Real share) {
                    if (more)
                        waiting[count++] = next;
                    more = true;
                    next = {child, share * now.weight, now.order + 1};
                });
            if (!more) {
                if (count == 0)
                    return sum;
                next = waiting[--count];
            }
            now = next;
        }
    }

    // The study's rows (2.7.4): down the tree for the rays, and up again for the colours.
    [[gnu::noinline]] Vec3<Real> table(const Branch<Real>& eye, Desk<Real>& desk, std::vector<Row<Real>>& table) const
    {
        const std::size_t base = std::size_t(table_base());
        table[0].branch = eye, table[0].order = 0, table[0].used = true;
        for (std::size_t p = 0; p < rows; p++) {
            Row<Real>& row = table[p];
            if (!row.used)
                continue;
            tracer.follow(
                row.branch, row.order, desk,
                [&](const Vec3<Real>& light, const Factor<Real>& attenuation) {
                    row.light = light;
                    row.attenuation = attenuation;
                },
                keep,
                [&](int number, const Branch<Real>& child, Real share) {
                    Row<Real>& below = table[p * base + 1 + std::size_t(number)];
                    below.branch = child, below.share = share, below.order = row.order + 1, below.used = true;
                });
        }
        for (std::size_t p = rows - 1; p > 0; p--) {
            Row<Real>& row = table[p];
            if (!row.used)
                continue;
            Vec3<Real>& above = table[(p - 1) / base].light;
            above = above + row.share * (row.attenuation * row.light);
            row.used = false;
        }
        return table[0].attenuation * table[0].light;
    }

    // REF-4 as it stands.
    [[gnu::noinline]] Vec3<Real> recursion(const Branch<Real>& branch, int order, Desk<Real>& desk) const
    {
        Vec3<Real> sum{0, 0, 0};
        Factor<Real> factor = no_attenuation<Real>();
        tracer.follow(
            branch, order, desk,
            [&](const Vec3<Real>& light, const Factor<Real>& attenuation) {
                sum = light;
                factor = attenuation;
            },
            keep,
            [&](int, const Branch<Real>& child, Real share) { sum = sum + share * recursion(child, order + 1, desk); });
        return factor * sum;
    }
};
