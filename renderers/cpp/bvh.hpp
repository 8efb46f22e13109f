// A bounding-volume hierarchy: which of many boxes a ray meets (HIT-6).
#pragma once
#include "bounds.hpp"
#include "ray.hpp"

#include <cstdint>
#include <utility>
#include <vector>

// What rounding can do to a hit is some u times the distances in it: those of the shape from the world's origin, for
// which its box is padded at load, and that of the ray's origin, for which the ray's is.
constexpr int rounding = 64;  // of 2 u = numeric_limits::epsilon()

template<typename Real>
class Bvh {
public:
    Bvh() = default;

    // Of boxes with the numbers 0, 1, ..; `numbers` are those to put in.
    Bvh(const std::vector<Bounds<Real>>& boxes, std::vector<int> numbers) : order(std::move(numbers))
    {
        for (const Bounds<Real>& box : boxes)
            padded.push_back(box.padded(rounding));
        nodes.reserve(2 * order.size() + 1);
        nodes.emplace_back();
        build(0, 0, int(order.size()), 0);
        padded = {};
    }

    bool empty() const { return order.empty(); }

    // Calls visit(number) for the boxes that the ray meets at some t with least <= t <= most, the nearest first where
    // that is known, until one answers true. `most` may shrink meanwhile; a box at t = most is visited.
    template<typename Visit>
    bool search(const Ray<Real>& ray, Real least, const Real& most, const Visit& visit) const
    {
        const Slabs slabs(ray);
        struct Later {
            int node;
            Real near;
        } stack[depth_limit];
        int waiting = 0, node = 0;
        if (!reached(slabs.enter(nodes[0], least, most), most))
            return false;
        for (;;) {
            const Node& here = nodes[std::size_t(node)];
            if (here.count == 0) {
                Later near{here.first, slabs.enter(nodes[std::size_t(here.first)], least, most)};
                Later far{here.first + 1, slabs.enter(nodes[std::size_t(here.first) + 1], least, most)};
                if (far.near < near.near)
                    std::swap(near, far);
                if (reached(far.near, most))
                    stack[waiting++] = far;
                if (reached(near.near, most)) {
                    node = near.node;
                    continue;
                }
            } else {
                for (int i = here.first; i < here.first + here.count; i++)
                    if (visit(order[std::size_t(i)]))
                        return true;
            }
            do {
                if (waiting == 0)
                    return false;
                waiting--;
            } while (!reached(stack[waiting].near, most));
            node = stack[waiting].node;
        }
    }

private:
    template<typename> friend class LaneBvh;

    static constexpr Real infinity = std::numeric_limits<Real>::infinity();
    static constexpr int bins = 16, leaf_size = 8;
    static constexpr int depth_limit = 64;  // from half of it on nodes are halved, so 2^31 boxes end before it

    struct Node {
        Real bounds[2][3];
        std::int32_t first, count;  // of a leaf, in `order`; without count: the first of two children
    };

    struct Slabs {
        Real origin[2][3], inverse[3];
        int low[3];  // which of a node's bounds the ray meets first

        explicit Slabs(const Ray<Real>& ray)
        {
            const Real pad = rounding * std::numeric_limits<Real>::epsilon() * largest(ray.origin);
            for (int a = 0; a < 3; a++) {
                inverse[a] = 1 / ray.direction[a];
                low[a] = inverse[a] < 0;
                const Real outward = inverse[a] < 0 ? -pad : pad;
                origin[0][a] = ray.origin[a] + outward, origin[1][a] = ray.origin[a] - outward;
            }
        }

        // Where the ray meets the box, or infinity. 0 * infinity, on the plane of a side along the ray, sets no bound:
        // std::max and std::min give their first argument if the second is NaN.
        [[gnu::always_inline]] Real enter(const Node& node, Real least, Real most) const
        {
            Real in = least, out = most;
            for (int a = 0; a < 3; a++) {
                in = std::max(in, (node.bounds[low[a]][a] - origin[0][a]) * inverse[a]);
                out = std::min(out, (node.bounds[1 - low[a]][a] - origin[1][a]) * inverse[a]);
            }
            return in <= out ? in : infinity;
        }
    };

    static bool reached(Real near, Real most) { return near <= most && near < infinity; }

    std::vector<Node> nodes;
    std::vector<int> order;
    std::vector<Bounds<Real>> padded;

    Real middle(int number, int axis) const
    {
        const Bounds<Real>& box = padded[std::size_t(number)];
        return box.low[axis] / 2 + box.high[axis] / 2;
    }

    void build(std::size_t node, int begin, int end, int depth)
    {
        Bounds<Real> all, middles;
        for (int i = begin; i < end; i++) {
            const int number = order[std::size_t(i)];
            all.hold(padded[std::size_t(number)]);
            middles.hold(Vec3<Real>{middle(number, 0), middle(number, 1), middle(number, 2)});
        }
        const int count = end - begin;
        nodes[node] = {{{all.low.x, all.low.y, all.low.z}, {all.high.x, all.high.y, all.high.z}}, begin, count};
        if (count < 2)
            return;
        int split = depth < depth_limit / 2 ? split_by_area(all, middles, begin, end) : begin + count / 2;
        if (split == begin && count <= leaf_size)
            return;
        if (split == begin)
            split = begin + count / 2;

        const std::size_t child = nodes.size();
        nodes[node].first = int(child), nodes[node].count = 0;
        nodes.resize(child + 2);
        build(child, begin, split, depth + 1);
        build(child + 1, split, end, depth + 1);
    }

    // The surface-area heuristic: the cost of a node is what its halves hold, times the chance that a ray which meets
    // the node meets them. Puts `order` in order; `begin` says that not to split is best, or that nothing tells halves.
    int split_by_area(const Bounds<Real>& all, const Bounds<Real>& middles, int begin, int end)
    {
        Real best = all.area() * Real(end - begin - 1);  // of a leaf, less a step down, which is about one test
        int best_axis = -1, best_bin = 0;
        for (int axis = 0; axis < 3; axis++) {
            Bounds<Real> boxes[bins];
            int counts[bins] = {};
            for (int i = begin; i < end; i++) {
                const int b = bin(middles, axis, order[std::size_t(i)]);
                boxes[b].hold(padded[std::size_t(order[std::size_t(i)])]);
                counts[b]++;
            }
            Real right_cost[bins] = {};
            Bounds<Real> sum;
            for (int b = bins - 1, n = 0; b > 0; b--) {
                sum.hold(boxes[b]);
                n += counts[b];
                right_cost[b] = n ? sum.area() * Real(n) : infinity;
            }
            sum = {};
            for (int b = 1, n = 0; b < bins; b++) {
                sum.hold(boxes[b - 1]);
                n += counts[b - 1];
                const Real cost = n ? sum.area() * Real(n) + right_cost[b] : infinity;
                if (cost < best)
                    best = cost, best_axis = axis, best_bin = b;
            }
        }
        if (best_axis < 0)
            return begin;
        int split = begin;
        for (int i = begin; i < end; i++)
            if (bin(middles, best_axis, order[std::size_t(i)]) < best_bin)
                std::swap(order[std::size_t(i)], order[std::size_t(split++)]);
        return split;
    }

    int bin(const Bounds<Real>& middles, int axis, int number) const
    {
        const Real width = middles.high[axis] - middles.low[axis];
        if (!(width > 0))
            return 0;
        return std::min(bins - 1, int(Real(bins) * ((middle(number, axis) - middles.low[axis]) / width)));
    }
};
