// A bounding-volume hierarchy: which of many boxes a ray meets (HIT-6).
#pragma once
#include "bounds.hpp"
#include "../ray.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <thread>
#include <utility>
#include <vector>

// What rounding can do to a hit is some u times the distances in it: those of the shape from the world's origin, for
// which its box is padded at load, and that of the ray's origin, for which the ray's is.
constexpr int rounding = 64;  // of 2 u = numeric_limits::epsilon()

// Real for the compilers' vectors; also where numbers are counted (counted.hpp).
template<typename Real>
struct Machine {
    using Number = Real;
    typedef Real Four [[gnu::vector_size(4 * sizeof(Real))]];
};

template<typename Real>
class Bvh {
public:
    Bvh() = default;

    // Of boxes with the numbers 0, 1, ..; `numbers` are those to put in. The tree is the same for any `threads`.
    Bvh(const std::vector<Bounds<Real>>& boxes, const std::vector<int>& numbers, int threads)
    {
        std::vector<Item> items;
        items.reserve(numbers.size());
        for (const int number : numbers) {
            const auto [low, high] = boxes[std::size_t(number)].padded(rounding);
            items.push_back({{four(low), four(high)}, number});
        }
        nodes.reserve(items.size());
        nodes.emplace_back();
        build(nodes, 0, items, 0, int(items.size()), 0, threads);
        order.reserve(items.size());
        for (const Item& item : items)
            order.push_back(item.number);
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

    // Calls visit(number) for the boxes that come within `reach` of a point.
    template<typename Visit>
    void around(const Vec3<Real>& point, Real reach, const Visit& visit) const
    {
        int waiting[depth_limit + 1], count = 1;
        waiting[0] = 0;
        while (count > 0) {
            const Node& node = nodes[std::size_t(waiting[--count])];
            bool near = true;
            for (int a = 0; a < 3; a++)
                near = near && node.bounds[0][a] <= point[a] + reach && point[a] - reach <= node.bounds[1][a];
            if (!near)
                continue;
            if (node.count == 0)
                waiting[count++] = node.first, waiting[count++] = node.first + 1;
            for (int i = node.first; i < node.first + node.count; i++)
                visit(order[std::size_t(i)]);
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

    // x, y, z and a number that means nothing, side by side as the compilers' own vectors are; of a `?`, all four.
    using Number = typename Machine<Real>::Number;
    using Four = typename Machine<Real>::Four;

    static Four four(Vec3<Real> a) { return Four{Number(a.x), Number(a.y), Number(a.z)}; }

    // Bounds.
    struct Box {
        Four low = Number(infinity) - Four{}, high = Number(-infinity) - Four{};  // that number in all four

        void hold(const Box& other)
        {
            low = other.low < low ? other.low : low;
            high = other.high > high ? other.high : high;
        }

        // A point, as a box.
        Box middle() const
        {
            const Four point = low / 2 + high / 2;
            return {point, point};
        }

        // Half of it, which is as good to compare. Not of an empty box.
        Real area() const
        {
            const Four d = high - low;
            return d[0] * d[1] + d[1] * d[2] + d[2] * d[0];
        }
    };

    // What the tree is made of; they move, so that those of a node are side by side in memory.
    struct Item {
        Box box;
        int number;
    };

    // Along each axis, the bin of an item's middle.
    struct Bins {
        Four low, width;

        explicit Bins(const Box& middles) : low(middles.low), width(middles.high - middles.low)
        {
            width = width > 0 ? width : 1 - Four{};
        }

        auto operator()(const Item& item) const
        {
            typedef int Places [[gnu::vector_size(4 * sizeof(int))]];
            const Four place = Number(bins) * ((item.box.middle().low - low) / width), last = Number(bins - 1) - Four{};
            return __builtin_convertvector(place < last ? place : last, Places);
        }
    };

    std::vector<Node> nodes;
    std::vector<int> order;

    // Makes nodes[node] of items begin .. end, and all that are below it.
    static void build(std::vector<Node>& nodes, std::size_t node, std::vector<Item>& items, int begin, int end, int depth,
                      int threads)
    {
        constexpr int worth_a_thread = 4096;  // of which the tree takes some ms

        Box all, middles;
        for (int i = begin; i < end; i++) {
            const Item& item = items[std::size_t(i)];
            all.hold(item.box);
            middles.hold(item.box.middle());
        }
        const int count = end - begin;
        nodes[node] = {{{all.low[0], all.low[1], all.low[2]}, {all.high[0], all.high[1], all.high[2]}}, begin, count};
        if (count < 2)
            return;
        int split = depth < depth_limit / 2 ? split_by_area(items, all, middles, begin, end) : begin + count / 2;
        if (split == begin && count <= leaf_size)
            return;
        if (split == begin)
            split = begin + count / 2;

        const std::size_t child = nodes.size();
        nodes[node].first = int(child), nodes[node].count = 0;
        nodes.resize(child + 2);
        if (threads == 1 || std::min(split - begin, end - split) < worth_a_thread) {
            build(nodes, child, items, begin, split, depth + 1, threads);
            build(nodes, child + 1, items, split, end, depth + 1, threads);
            return;
        }
        const double share = double(end - split) / double(count);
        const int others = std::clamp(int(std::lround(share * threads)), 1, threads - 1);
        std::vector<Node> right(1);
        std::jthread other([&] {
            build(right, 0, items, split, end, depth + 1, others);
        });
        build(nodes, child, items, begin, split, depth + 1, threads - others);
        other.join();
        const int further = int(nodes.size()) - 1;
        for (Node& each : right)
            each.first += each.count == 0 ? further : 0;
        nodes[child + 1] = right[0];
        nodes.insert(nodes.end(), right.begin() + 1, right.end());
    }

    // The surface-area heuristic: the cost of a node is what its halves hold, times the chance that a ray which meets
    // the node meets them. Puts `items` in order; `begin` says that not to split is best, or that nothing tells halves.
    static int split_by_area(std::vector<Item>& items, const Box& all, const Box& middles, int begin, int end)
    {
        const Bins bin(middles);
        Box boxes[3][bins];
        int counts[3][bins] = {};
        for (int i = begin; i < end; i++) {
            const Item& item = items[std::size_t(i)];
            const auto places = bin(item);
            for (int axis = 0; axis < 3; axis++) {
                boxes[axis][places[axis]].hold(item.box);
                counts[axis][places[axis]]++;
            }
        }
        Real best = all.area() * Real(end - begin - 1);  // of a leaf, less a step down, which is about one test
        int best_axis = -1, best_bin = 0;
        for (int axis = 0; axis < 3; axis++) {
            Real right_cost[bins], cost = infinity;
            Box sum;
            for (int b = bins - 1, n = 0; b > 0; b--) {
                if (counts[axis][b] > 0) {
                    sum.hold(boxes[axis][b]);
                    n += counts[axis][b];
                    cost = sum.area() * Real(n);
                }
                right_cost[b] = cost;
            }
            sum = {};
            for (int b = 1, n = 0; b < bins; b++) {
                if (counts[axis][b - 1] == 0)
                    continue;
                sum.hold(boxes[axis][b - 1]);
                n += counts[axis][b - 1];
                cost = sum.area() * Real(n) + right_cost[b];
                if (cost < best)
                    best = cost, best_axis = axis, best_bin = b;
            }
        }
        if (best_axis < 0)
            return begin;
        int split = begin;
        for (int i = begin; i < end; i++)
            if (bin(items[std::size_t(i)])[best_axis] < best_bin)
                std::swap(items[std::size_t(i)], items[std::size_t(split++)]);
        return split;
    }
};
