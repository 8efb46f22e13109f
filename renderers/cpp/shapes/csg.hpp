// Solids put together from parts by OR, AND and NOT: boundaries of the parts along the ray's line, sorted.
#pragma once
#include "box.hpp"
#include "bvh.hpp"
#include "ellipsoid.hpp"
#include "probe.hpp"
#include "sphere.hpp"

// Where the line crosses a face of a part, which it enters or leaves there.
template<typename Real>
struct Crossing {
    Real t;
    int part, face;  // part: its place in the postfix

    // CSG-3: the order in which they are passed.
    bool before(const Crossing& other) const
    {
        return t < other.t || (t == other.t && (part < other.part || (part == other.part && face < other.face)));
    }
};

// A boundary of the solid.
template<typename Real>
struct Boundary {
    Crossing<Real> crossing;
    bool leaves;           // the solid, with growing t
    Real d_n, coordinate;  // for CSG-4: |d·n|, and max(|o|∞, |o + t d|∞, size)
};

// Where a thread works out the boundaries of a solid; it grows with what lines cross (CSG-6).
template<typename Real>
struct Scratch {
    std::vector<Crossing<Real>> crossings;
    std::vector<Boundary<Real>> boundaries;
    std::vector<char> inside, values;  // inside: by part; values: of the postfix
};

// A closed mesh.
template<typename Real>
struct MeshPart {
    std::vector<Triangle<Real>> triangles;
    Bvh<Real> bvh;  // may be empty

    void build_hierarchy(int threads)
    {
        std::vector<Bounds<Real>> bounds;
        std::vector<int> numbers;
        for (const Triangle<Real>& triangle : triangles) {
            numbers.push_back(int(bounds.size()));
            bounds.push_back(triangle.bounds());
        }
        bvh = Bvh<Real>(bounds, numbers, threads);
    }

    // Calls visit(triangle) for those that the line may cross, until it answers true.
    template<typename Visit>
    bool search(const Ray<Real>& ray, const Visit& visit) const
    {
        constexpr Real infinity = std::numeric_limits<Real>::infinity();
        if (!bvh.empty())
            return bvh.search(ray, -infinity, infinity, visit);
        for (std::size_t i = 0; i < triangles.size(); i++)
            if (visit(int(i)))
                return true;
        return false;
    }
};

// The parts of all solids, by the numbers of their kinds in the postfix.
template<typename Real>
struct Parts {
    enum Kind { sphere, box, ellipsoid, mesh };

    std::vector<Sphere<Real>> spheres;
    std::vector<Box<Real>> boxes;
    std::vector<Ellipsoid<Real>> ellipsoids;
    std::vector<MeshPart<Real>> meshes;
};

template<typename Real>
class Solid {
public:
    // `code` is that of csg_code.npy; `parts` must stay where they are. sliver: of CSG-4. epsilon: of OFF-1.
    Solid(const Parts<Real>& parts, const std::int32_t* code, int length, Real sliver, Real epsilon)
        : parts(&parts), sliver(sliver), epsilon(epsilon)
    {
        for (int i = 0; i < length; i++, code += 2) {
            steps.push_back(code[0]);
            common = common && code[0] != Parts<Real>::mesh && code[0] != op_or && code[0] != op_not;
            if (code[0] > Parts<Real>::mesh)
                continue;
            operands.push_back({code[0], std::size_t(code[1])});
            capacity += code[0] == Parts<Real>::mesh ? parts.meshes[std::size_t(code[1])].triangles.size() : 2;
        }
    }

    // HIT-6: as a part of it is; a ray that steps is moved off its line (CSG-7), so bounds do not hold.
    bool always_tried() const
    {
        return methods::steps || std::any_of(operands.begin(), operands.end(), [&](const Operand& operand) {
            return (operand.kind == Parts<Real>::box && parts->boxes[operand.row].always_tried()) ||
                   (operand.kind == Parts<Real>::ellipsoid && parts->ellipsoids[operand.row].skewed());
        });
    }

    // MED-6: of its parts, the largest.
    Real extent() const
    {
        Real most = 0;
        each_part([&](const auto& part) {
            if constexpr (requires { part.triangles; })
                for (const Triangle<Real>& triangle : part.triangles)
                    most = std::max(most, triangle.size);
            else if constexpr (requires { part.radius; })
                most = std::max(most, part.radius);
            else
                most = std::max(most, part.size);
        });
        return most;
    }

    void make_room(Scratch<Real>& scratch) const
    {
        scratch.inside.resize(std::max(scratch.inside.size(), operands.size()));
        scratch.values.resize(std::max(scratch.values.size(), operands.size()));
    }

    Real distance(const Probe<Real>& probe) const
    {
        if constexpr (methods::steps)
            return step(probe).t;
        const Boundary<Real>* hit = nearest(probe);
        return hit ? hit->crossing.t : 0;
    }

    // CSG-5
    Surface<Real> surface(const Probe<Real>& probe, Real) const
    {
        if constexpr (methods::steps)
            return step(probe).at;
        const Boundary<Real>& hit = *nearest(probe);
        Surface<Real> at = face(probe, hit.crossing);
        if ((dot(probe.direction, at.normal) > 0) != hit.leaves)
            at.normal = -at.normal;
        return at;
    }

    // Every boundary is on a face of a part, whatever the expression.
    Bounds<Real> bounds() const
    {
        Bounds<Real> bounds;
        for (const Operand& operand : operands)
            switch (operand.kind) {
            case Parts<Real>::sphere: bounds.hold(parts->spheres[operand.row].bounds()); break;
            case Parts<Real>::box: bounds.hold(parts->boxes[operand.row].bounds()); break;
            case Parts<Real>::ellipsoid: bounds.hold(parts->ellipsoids[operand.row].bounds()); break;
            default:
                for (const Triangle<Real>& triangle : parts->meshes[operand.row].triangles)
                    bounds.hold(triangle.bounds());
            }
        return bounds;
    }

    // CSG-5: the first boundary kept with t > 0, or none; it lasts until the next question.
    const Boundary<Real>* nearest(const Probe<Real>& probe) const
    {
        Scratch<Real>& scratch = *probe.scratch;
        const std::size_t crossings = cross_parts(probe, scratch);
        const std::size_t kept = keep_boundaries(probe, scratch, crossings);
        for (std::size_t i = 0; i < kept; i++)
            if (scratch.boundaries[i].crossing.t > 0)
                return &scratch.boundaries[i];
        return nullptr;
    }

    bool is_box(int part) const { return operands[std::size_t(part)].kind == Parts<Real>::box; }

    // The side of a box, 2 axis + high, the triangle of a mesh, or 0.
    int side(const Crossing<Real>& crossing) const
    {
        const int kind = operands[std::size_t(crossing.part)].kind;
        return kind == Parts<Real>::box ? crossing.face % 8 : kind == Parts<Real>::mesh ? crossing.face : 0;
    }

    template<typename Visit>
    void each_part(const Visit& visit) const
    {
        for (const auto& [kind, row] : operands)
            if (kind == Parts<Real>::sphere)
                visit(parts->spheres[row]);
            else if (kind == Parts<Real>::box)
                visit(parts->boxes[row]);
            else if (kind == Parts<Real>::ellipsoid)
                visit(parts->ellipsoids[row]);
            else
                visit(parts->meshes[row]);
    }

private:
    template<typename> friend class LaneSolid;

    enum { op_or = 4, op_and = 5, op_not = 6 };  // of csg_code.npy

    struct Operand {
        int kind;
        std::size_t row;
    };

    const Parts<Real>* parts;
    Real sliver, epsilon;
    bool common = true;             // an AND of convex parts alone
    std::vector<Operand> operands;  // in the order of the postfix
    std::vector<int> steps;         // the postfix: kinds of operands, and operators
    std::size_t capacity = 0;

    struct Stepped {
        Real t = 0;  // not greater than 0: no hit
        Surface<Real> at{};
    };

    // CSG-7: the ray starts anew behind each face, until it is in the solid or out of it.
    Stepped step(const Probe<Real>& probe) const
    {
        Scratch<Real>& scratch = *probe.scratch;
        Vec3<Real> origin = probe.origin;
        bool started = false, value = false;
        for (std::size_t step = 0; step < capacity; step++) {
            const Probe<Real> ray({origin, probe.direction}, probe.scratch);
            const std::ptrdiff_t count = std::ptrdiff_t(cross_parts(ray, scratch));
            const auto first = scratch.crossings.begin(), last = first + count;
            const auto next = std::find_if(first, last, [](const auto& crossing) { return crossing.t > 0; });
            if (!std::exchange(started, true)) {
                std::fill_n(scratch.inside.begin(), operands.size(), char(false));
                for (auto behind = first; behind != next; behind++)
                    scratch.inside[std::size_t(behind->part)] ^= 1;
                value = evaluate(scratch);
            }
            if (next == last)
                return {};
            scratch.inside[std::size_t(next->part)] ^= 1;
            Surface<Real> at = face(ray, *next);
            const bool leaves = dot(ray.direction, at.normal) > 0;
            if (evaluate(scratch) != value) {
                if (leaves != value)
                    at.normal = -at.normal;
                return {dot(origin - probe.origin, probe.direction) + next->t, at};
            }
            if (common && !scratch.inside[std::size_t(next->part)])
                return {};
            origin = at.leave(leaves ? 1 : -1, epsilon);
        }
        return {};
    }

    // CSG-1: fills scratch.crossings, in order, and returns how many there are.
    std::size_t cross_parts(const Probe<Real>& probe, Scratch<Real>& scratch) const
    {
        std::size_t count = 0;
        const auto add = [&](Crossing<Real> crossing) {
            if (count == scratch.crossings.size())
                scratch.crossings.resize(2 * count + 2);
            std::size_t place = count++;
            for (; place > 0 && crossing.before(scratch.crossings[place - 1]); place--)
                scratch.crossings[place] = scratch.crossings[place - 1];
            scratch.crossings[place] = crossing;
        };
        for (int p = 0; p < int(operands.size()); p++) {
            const auto [kind, row] = operands[std::size_t(p)];
            Real in = 0, out = 0;
            if (kind == Parts<Real>::sphere) {
                if (parts->spheres[row].crossed(probe, in, out))
                    add({in, p, 0}), add({out, p, 1});
            } else if (kind == Parts<Real>::ellipsoid) {
                if (parts->ellipsoids[row].crossed(probe, in, out))
                    add({in, p, 0}), add({out, p, 1});
            } else if (kind == Parts<Real>::box) {
                const auto span = parts->boxes[row].span(probe);
                if (span.t0 <= span.t1)
                    add({span.t0, p, side_number(span.in)}), add({span.t1, p, 8 + side_number(span.out)});
            } else if constexpr (needs::mesh) {
                const MeshPart<Real>& mesh = parts->meshes[row];
                mesh.search(probe, [&](int number) {
                    Real t = 0;
                    if (mesh.triangles[std::size_t(number)].crossed(probe, t))
                        add({t, p, number});
                    return false;
                });
            }
        }
        return count;
    }

    // CSG-3, CSG-4: fills scratch.boundaries from scratch.crossings, and returns how many there are.
    std::size_t keep_boundaries(const Probe<Real>& probe, Scratch<Real>& scratch, std::size_t crossings) const
    {
        std::size_t kept = 0;
        if (scratch.boundaries.size() < crossings)
            scratch.boundaries.resize(scratch.crossings.size());
        std::fill_n(scratch.inside.begin(), operands.size(), char(false));
        bool value = crossings && evaluate(scratch);
        for (std::size_t i = 0; i < crossings; i++) {
            const Crossing<Real>& crossing = scratch.crossings[i];
            char& inside = scratch.inside[std::size_t(crossing.part)];
            inside = !inside;
            if (evaluate(scratch) == value)
                continue;
            value = !value;
            if constexpr (!methods::merges) {
                scratch.boundaries[kept++] = {crossing, !value, 0, 0};
                continue;
            }
            const Surface<Real> at = face(probe, crossing);
            const Vec3<Real> p = probe.origin + crossing.t * probe.direction;
            const Boundary<Real> next{crossing, !value, std::abs(dot(probe.direction, at.normal)),
                                      std::max({largest(probe.origin), largest(p), at.size})};
            if (kept && same_place(scratch.boundaries[kept - 1], next, at.size))
                kept--;
            else
                scratch.boundaries[kept++] = next;
        }
        return kept;
    }

    // CSG-4
    bool same_place(const Boundary<Real>& last, const Boundary<Real>& next, Real next_size) const
    {
        return (next.crossing.t - last.crossing.t) * std::min(last.d_n, next.d_n) <=
               sliver * std::max(last.coordinate, next_size);
    }

    bool evaluate(Scratch<Real>& scratch) const
    {
        std::size_t part = 0, top = 0;  // top: the number of values
        auto& values = scratch.values;
        for (const int step : steps) {
            if (step < op_or)
                values[top++] = scratch.inside[part++];
            else if (step == op_not)
                values[top - 1] = !values[top - 1];
            else {
                top--;
                values[top - 1] = step == op_or ? values[top - 1] | values[top] : values[top - 1] & values[top];
            }
        }
        return values[0];
    }

    Surface<Real> face(const Probe<Real>& probe, const Crossing<Real>& crossing) const
    {
        const auto [kind, row] = operands[std::size_t(crossing.part)];
        if (kind == Parts<Real>::sphere)
            return parts->spheres[row].surface(probe, crossing.t);
        if (kind == Parts<Real>::ellipsoid)
            return parts->ellipsoids[row].surface(probe, crossing.t);
        if (kind == Parts<Real>::box)
            return parts->boxes[row].surface(probe, crossing.t, {crossing.face % 8 / 2, crossing.face % 2 == 1});
        return parts->meshes[row].triangles[std::size_t(crossing.face)].surface(probe, crossing.t);
    }

    static int side_number(typename Box<Real>::Side side) { return 2 * side.axis + side.high; }
};
