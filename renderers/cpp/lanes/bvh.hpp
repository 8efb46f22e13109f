// VEC-3: the hierarchy with as many children of a node as there are lanes, and with groups of shapes in its leaves.
#pragma once
#include "../shapes/bvh.hpp"
#include "groups.hpp"

template<typename Real>
class LaneBvh {
    static constexpr int width = lane_count<Real>;

public:
    // Of the shapes of `tree`. add_to_group(number, spheres, triangles) puts one into a group, or answers false.
    template<typename AddToGroup>
    void build(const Bvh<Real>& tree, const AddToGroup& add_to_group)
    {
        nodes.clear();
        leaves.assign(1, Leaf{});  // the empty one, for lanes of a node without a child: a ray of NaN enters all lanes
        if (!tree.empty())
            make_node(tree, 0, add_to_group);
    }

    bool empty() const { return nodes.empty(); }

    // Visits leaves that the ray meets at some t with least <= t <= most: visit(number) for each shape by itself, and
    // visit_group(group) for each group, until one answers true. Of `shrinking` `most`, the nearest first where that
    // is known.
    template<bool shrinking, typename Visit, typename VisitGroup>
    bool search(const Ray<Real>& ray, Real least, const Real& most, const Visit& visit,
                const VisitGroup& visit_group) const
    {
        const typename Bvh<Real>::Slabs slabs(ray);
        constexpr int room = (Bvh<Real>::depth_limit + 1) * width;
        Integer<Real> children[room];  // those that wait, and where the ray enters them
        Real nears[room];
        int waiting = 0;
        for (int child = 0;;) {
            if (child >= 0) {
                const Node& node = nodes[std::size_t(child)];
                Lanes<Real> in = all(least), out = all(most);
                for (int a = 0; a < 3; a++) {  // a NaN sets no bound, as in Bvh
                    const int low = slabs.low[a];
                    const Lanes<Real> x = (node.bounds[low][a] - slabs.origin[0][a]) * slabs.inverse[a];
                    const Lanes<Real> y = (node.bounds[1 - low][a] - slabs.origin[1][a]) * slabs.inverse[a];
                    in = x > in ? x : in;
                    out = y < out ? y : out;
                }
                const Mask<Real> met = in <= out;
                compress<Real>(met, node.children, children + waiting);
                const int first = waiting;
                waiting += count<Real>(met);
                if constexpr (shrinking) {
                    compress<Real>(met, in, nears + first);
                    for (int i = first + 1; i < waiting; i++) {
                        const Real near = nears[i];
                        const Integer<Real> one = children[i];
                        int place = i;
                        for (; place > first && nears[place - 1] < near; place--)
                            nears[place] = nears[place - 1], children[place] = children[place - 1];
                        nears[place] = near, children[place] = one;
                    }
                }
            } else if (look_into(leaves[std::size_t(~child)], visit, visit_group))
                return true;
            do {
                if (waiting == 0)
                    return false;
                waiting--;
            } while (shrinking && !(nears[waiting] <= most));
            child = int(children[waiting]);
        }
    }

private:
    struct Node {
        Lanes<Real> bounds[2][3];
        Integers<Real> children;  // below 0: ~ the number of a leaf
    };

    // Ranges of `alone`, `spheres` and `triangles`.
    struct Leaf {
        int first[3], last[3];
    };

    std::vector<Node> nodes;
    std::vector<Leaf> leaves;
    std::vector<int> alone;
    std::vector<SphereGroup<Real>> spheres;
    std::vector<TriangleGroup<Real>> triangles;

    template<typename Visit, typename VisitGroup>
    LANE bool look_into(const Leaf& leaf, const Visit& visit, const VisitGroup& visit_group) const
    {
        for (int i = leaf.first[0]; i < leaf.last[0]; i++)
            if (visit(alone[std::size_t(i)]))
                return true;
        if constexpr (needs::sphere)
            for (int i = leaf.first[1]; i < leaf.last[1]; i++)
                if (visit_group(spheres[std::size_t(i)]))
                    return true;
        if constexpr (needs::mesh)
            for (int i = leaf.first[2]; i < leaf.last[2]; i++)
                if (visit_group(triangles[std::size_t(i)]))
                    return true;
        return false;
    }

    static const typename Bvh<Real>::Node& node_of(const Bvh<Real>& tree, int node)
    {
        return tree.nodes[std::size_t(node)];
    }

    // Where the shapes of a node of the binary tree begin and end in its order.
    static std::pair<int, int> range(const Bvh<Real>& tree, int node)
    {
        int left = node, right = node;
        while (node_of(tree, left).count == 0)
            left = node_of(tree, left).first;
        while (node_of(tree, right).count == 0)
            right = node_of(tree, right).first + 1;
        return {node_of(tree, left).first, node_of(tree, right).first + node_of(tree, right).count};
    }

    static bool fits_in_leaf(const Bvh<Real>& tree, int node)
    {
        const auto [begin, end] = range(tree, node);
        return node_of(tree, node).count > 0 || end - begin <= width;
    }

    static Real area(const typename Bvh<Real>::Node& node)
    {
        const Real x = node.bounds[1][0] - node.bounds[0][0], y = node.bounds[1][1] - node.bounds[0][1],
                   z = node.bounds[1][2] - node.bounds[0][2];
        return x * y + y * z + z * x;
    }

    // A node of the nodes that come of `root` when the largest is opened again and again.
    template<typename AddToGroup>
    int make_node(const Bvh<Real>& tree, int root, const AddToGroup& add_to_group)
    {
        std::vector<int> parts{root};
        while (int(parts.size()) < width) {
            int largest = -1;
            for (int i = 0; i < int(parts.size()); i++)
                if (!fits_in_leaf(tree, parts[std::size_t(i)]) &&
                    (largest < 0 || area(node_of(tree, parts[std::size_t(i)])) >
                                        area(node_of(tree, parts[std::size_t(largest)]))))
                    largest = i;
            if (largest < 0)
                break;
            const int child = node_of(tree, parts[std::size_t(largest)]).first;
            parts[std::size_t(largest)] = child;
            parts.push_back(child + 1);
        }
        const std::size_t number = nodes.size();
        nodes.emplace_back();
        nodes[number].children = Integers<Real>{} - 1;
        for (int a = 0; a < 3; a++) {
            nodes[number].bounds[0][a] = all(std::numeric_limits<Real>::infinity());
            nodes[number].bounds[1][a] = -nodes[number].bounds[0][a];
        }
        for (int k = 0; k < int(parts.size()); k++) {
            const int part = parts[std::size_t(k)];
            const int child =
                fits_in_leaf(tree, part) ? ~make_leaf(tree, part, add_to_group) : make_node(tree, part, add_to_group);
            nodes[number].children[k] = child;
            for (int a = 0; a < 3; a++)
                for (int side = 0; side < 2; side++)
                    nodes[number].bounds[side][a][k] = node_of(tree, part).bounds[side][a];
        }
        return int(number);
    }

    template<typename AddToGroup>
    int make_leaf(const Bvh<Real>& tree, int node, const AddToGroup& add_to_group)
    {
        Leaf leaf{{int(alone.size()), int(spheres.size()), int(triangles.size())}, {}};
        SphereGroup<Real> some_spheres;
        TriangleGroup<Real> some_triangles;
        const auto [begin, end] = range(tree, node);
        for (int i = begin; i < end; i++) {
            const int shape = tree.order[std::size_t(i)];
            if (!add_to_group(shape, some_spheres, some_triangles))
                alone.push_back(shape);
            keep_if(some_spheres.size == width || i + 1 == end, some_spheres, spheres);
            keep_if(some_triangles.size == width || i + 1 == end, some_triangles, triangles);
        }
        leaf.last[0] = int(alone.size()), leaf.last[1] = int(spheres.size()), leaf.last[2] = int(triangles.size());
        leaves.push_back(leaf);
        return int(leaves.size()) - 1;
    }

    template<typename Group>
    static void keep_if(bool now, Group& group, std::vector<Group>& list)
    {
        if (now && group.size > 0) {
            list.push_back(group);
            group = Group();
        }
    }
};
