// Everything that a ray can hit, and the search for it.
#pragma once
#include "box.hpp"
#include "csg.hpp"
#include "ellipsoid.hpp"
#include "../job/job.hpp"
#ifdef HAS_LANES
#include "../lanes/bvh.hpp"
#endif
#include "polygon.hpp"
#include "scene.hpp"
#include "sphere.hpp"


// The nearest hit so far. Shapes are numbered through all kinds in the order of HIT-2; -1 is none.
template<typename Real>
struct Hit {
    Real t = std::numeric_limits<Real>::infinity();
    int shape = -1;
};

// What a shape is apart from its form.
struct Role {
    int object, material;
    int rank;   // MED-2: the place in media.npy, or -1
    bool flat;  // MED-4: it bounds no medium
};

template<typename Real>
class Shapes {
public:
    std::vector<Role> roles;  // by shape

    Shapes(const Shapes&) = delete;  // solids point to `parts`

    Shapes(const Scene& scene, const Job& job)
    {
        if constexpr (needs::sphere)
            for (std::size_t i = 0; i < scene.spheres.rows(); i++) {
                spheres.emplace_back(scene.spheres.row(i));
                roles.push_back(role(scene, scene.sphere_ids.row(i), false));
            }
        if constexpr (needs::box)
            for (std::size_t i = 0; i < scene.boxes.rows(); i++) {
                boxes.emplace_back(scene.boxes.row(i));
                roles.push_back(role(scene, scene.box_ids.row(i), false));
            }
        if constexpr (needs::polygon)
            for (std::size_t i = 0; i < scene.polygon_ranges.rows(); i++) {
                const std::int32_t* range = scene.polygon_ranges.row(i);
                polygons.emplace_back(scene.polygon_vertices.row(std::size_t(range[0])), range[1]);
                roles.push_back(role(scene, scene.polygon_ids.row(i), true));
            }
        if constexpr (needs::ellipsoid)
            for (std::size_t i = 0; i < scene.ellipsoids.rows(); i++) {
                ellipsoids.emplace_back(scene.ellipsoids.row(i));
                roles.push_back(role(scene, scene.ellipsoid_ids.row(i), false));
            }
        if constexpr (needs::mesh)
            for (std::size_t i = 0; i < scene.mesh_ranges.rows(); i++) {
                const std::int32_t* range = scene.mesh_ranges.row(i);
                const bool closed = range[2] != 0;
                add_triangles(scene, range, closed, triangles);
                roles.resize(roles.size() + std::size_t(range[1]), role(scene, scene.mesh_ids.row(i), !closed));
            }
        if constexpr (needs::csg)
            add_solids(scene, Real(job.sliver), Real(job.epsilon));
    }

    // HIT-6: builds the hierarchies that are wanted, those for rays in lanes too (VEC-3); false if none is.
    bool build(const Job& job, bool in_lanes)
    {
        bool built = false;
        if constexpr (needs::csg)
            for (MeshPart<Real>& mesh : parts.meshes)
                if (is_wanted(job.accel, 4 * mesh.triangles.size()))
                    mesh.build_hierarchy(job.threads), built = true;
        if ((in_lanes && job.accel != Accel::none) || is_wanted(job.accel, work()))
            build_hierarchy(job.threads, in_lanes);
        return built || accelerated();
    }

    bool accelerated() const { return !hierarchy.empty(); }

#ifdef HAS_LANES
    // VEC-1: is each ray in lanes tried against each shape, in place of a hierarchy? NOTES.md has the times.
    bool few_for_lanes(Accel accel) const
    {
        constexpr std::size_t most = 32 * lane_count<Real>;
        return accel == Accel::none || (accel == Accel::automatic && work() < most);
    }
#endif

    // VEC-4: are lanes quicker, for streams of rays or for rays one by one?
    bool lanes_pay(Accel accel, bool streams) const
    {
        return work() >= many ? streams || accel != Accel::none : streams && accel != Accel::bvh;
    }

    void make_room(Only<needs::csg, Scratch<Real>, 'c'>& scratch) const
    {
        if constexpr (needs::csg)
            for (const Solid<Real>& solid : solids)
                solid.make_room(scratch);
    }

    // HIT-1, HIT-2
    Hit<Real> nearest(const Probe<Real>& probe) const
    {
        if (accelerated())
            return nearest_of_hierarchy(probe);
        Hit<Real> hit;
        int number = 0;
        any_kind([&](const auto& shapes) {
            for (const auto& shape : shapes) {
                const Real t = shape.distance(probe);
                if (t > 0 && t < hit.t)
                    hit = {t, number + int(&shape - shapes.data())};
            }
            number += int(shapes.size());
            return false;
        });
        return hit;
    }

    // HIT-5
    bool blocked(const Probe<Real>& feeler, Real distance) const
    {
        if (accelerated())
            return blocked_in_hierarchy(feeler, distance);
        return any_kind([&](const auto& shapes) {
            for (const auto& shape : shapes) {
                const Real t = shape.distance(feeler);
                if (t > 0 && t < distance)
                    return true;
            }
            return false;
        });
    }

    Surface<Real> surface(const Probe<Real>& probe, const Hit<Real>& hit) const
    {
        Surface<Real> at;
        with_shape(hit.shape, [&](const auto& shape) { at = shape.surface(probe, hit.t); });
        return at;
    }

    // MED-6: calls visit(number) for all shapes that may come within `reach` of a point.
    template<typename Visit>
    void around(const Vec3<Real>& point, Real reach, const Visit& visit) const
    {
        if (!accelerated())
            for (int number = 0; number < int(roles.size()); number++)
                visit(number);
        else {
            hierarchy.around(point, reach, visit);
            for (const int number : outside)
                visit(number);
        }
    }

    Real distance(int number, const Probe<Real>& probe) const
    {
        Real t = 0;
        with_shape(number, [&](const auto& shape) { t = shape.distance(probe); });
        return t;
    }

    // Of the shape, for OFF-1; of a solid, of its largest part.
    Real extent(int number) const
    {
        Real size = 0;
        with_shape(number, [&](const auto& shape) {
            if constexpr (requires { shape.radius; })
                size = shape.radius;
            else if constexpr (requires { shape.extent(); })
                size = shape.extent();
            else
                size = shape.size;
        });
        return size;
    }

    // Calls visit(list of shapes) for every kind that there can be, in the order of HIT-2, until it answers true.
    template<typename Visit>
    bool any_kind(const Visit& visit) const
    {
        bool done = false;
        if constexpr (needs::sphere)
            done = visit(spheres);
        if constexpr (needs::box)
            done = done || visit(boxes);
        if constexpr (needs::polygon)
            done = done || visit(polygons);
        if constexpr (needs::ellipsoid)
            done = done || visit(ellipsoids);
        if constexpr (needs::mesh)
            done = done || visit(triangles);
        if constexpr (needs::csg)
            done = done || visit(solids);
        return done;
    }

    template<typename Use>
    void with_shape(int number, const Use& use) const
    {
        std::size_t i = std::size_t(number);
        any_kind([&](const auto& shapes) {
            if (i >= shapes.size()) {
                i -= shapes.size();
                return false;
            }
            use(shapes[i]);
            return true;
        });
    }

    const auto& list_of_spheres() const { return spheres; }

private:
    // HIT-6: `auto` takes a hierarchy from so many spheres on, or a quarter of other kinds (NOTES.md has the times).
    static constexpr std::size_t many = 64;

    [[no_unique_address]] List<needs::sphere, Sphere<Real>, 's'> spheres;
    [[no_unique_address]] List<needs::box, Box<Real>, 'b'> boxes;
    [[no_unique_address]] List<needs::polygon, Polygon<Real>, 'p'> polygons;
    [[no_unique_address]] List<needs::ellipsoid, Ellipsoid<Real>, 'e'> ellipsoids;
    [[no_unique_address]] List<needs::mesh, Triangle<Real>, 't'> triangles;
    [[no_unique_address]] Only<needs::csg, Parts<Real>, 'c'> parts;
    [[no_unique_address]] List<needs::csg, Solid<Real>, 'C'> solids;
    Bvh<Real> hierarchy;
#ifdef HAS_LANES
    LaneBvh<Real> wide;
#endif
    std::vector<int> outside;  // shapes that the hierarchy has not, and that are always tried

    // Of trying all shapes, in spheres.
    std::size_t work() const
    {
        std::size_t work = 4 * roles.size();
        if constexpr (needs::sphere)
            work -= 3 * spheres.size();
        return work;
    }

    static bool is_wanted(Accel accel, std::size_t work)
    {
        return accel == Accel::bvh || (accel == Accel::automatic && work >= many);
    }

    static Role role(const Scene& scene, const std::int32_t* ids, bool flat)
    {
        int rank = -1;
        for (std::size_t i = 0; i < scene.media.rows() && !flat; i++)
            if (scene.media.row(i)[0] == ids[0])
                rank = int(i);
        return {ids[0], ids[1], rank, flat};
    }

    static void add_triangles(const Scene& scene, const std::int32_t* range, bool closed,
                              std::vector<Triangle<Real>>& list)
    {
        for (int k = range[0]; k < range[0] + range[1]; k++)
            list.emplace_back(scene.mesh_vertices.data.data(), scene.mesh_triangles.row(std::size_t(k)), closed);
    }

    void add_solids(const Scene& scene, Real sliver, Real epsilon)
    {
        for (std::size_t i = 0; i < scene.csg_spheres.rows(); i++)
            parts.spheres.emplace_back(scene.csg_spheres.row(i));
        for (std::size_t i = 0; i < scene.csg_boxes.rows(); i++)
            parts.boxes.emplace_back(scene.csg_boxes.row(i));
        for (std::size_t i = 0; i < scene.csg_ellipsoids.rows(); i++)
            parts.ellipsoids.emplace_back(scene.csg_ellipsoids.row(i));
        for (std::size_t i = 0; i < scene.csg_meshes.rows(); i++) {
            MeshPart<Real>& mesh = parts.meshes.emplace_back();
            add_triangles(scene, scene.csg_meshes.row(i), true, mesh.triangles);
        }
        for (std::size_t i = 0; i < scene.csg_ranges.rows(); i++) {
            const std::int32_t* range = scene.csg_ranges.row(i);
            solids.emplace_back(parts, scene.csg_code.row(std::size_t(range[0])), range[1], sliver, epsilon);
            roles.push_back(role(scene, scene.csg_ids.row(i), false));
        }
    }

    void build_hierarchy(int threads, [[maybe_unused]] bool in_lanes)
    {
        std::vector<Bounds<Real>> bounds;
        std::vector<int> numbers;
        bounds.reserve(roles.size()), numbers.reserve(roles.size());
        any_kind([&](const auto& shapes) {
            for (const auto& shape : shapes) {
                bool always = false;
                if constexpr (requires { shape.always_tried(); })
                    always = shape.always_tried();
                (always ? outside : numbers).push_back(int(bounds.size()));
                bounds.push_back(shape.bounds());
            }
            return false;
        });
        if (!numbers.empty())
            hierarchy = Bvh<Real>(bounds, numbers, threads);
#ifdef HAS_LANES
        if (!in_lanes)
            return;
        wide.build(hierarchy, [&](int number, SphereGroup<Real>& some_spheres, TriangleGroup<Real>& some_triangles) {
            bool added = false;
            with_shape(number, [&](const auto& shape) {
                using Shape = std::remove_cvref_t<decltype(shape)>;
                if constexpr (std::is_same_v<Shape, Sphere<Real>> && SphereGroup<Real>::possible)
                    some_spheres.add(shape, number), added = true;
                if constexpr (std::is_same_v<Shape, Triangle<Real>> && TriangleGroup<Real>::possible)
                    some_triangles.add(shape, number), added = true;
            });
            return added;
        });
#endif
    }

    // Calls visit(number, t) for the shapes that a ray may hit before `most`; t not greater than 0 is a miss.
    template<bool shrinking, typename Visit>
    bool search(const Probe<Real>& probe, const Real& most, const Visit& visit) const
    {
        const auto look_at = [&](int number) { return visit(number, distance(number, probe)); };
        bool found;
#ifdef HAS_LANES
        const auto look_at_group = [&](const auto& group) {
            if constexpr (std::remove_cvref_t<decltype(group)>::possible) {
                unsigned unsure = 0;
                const Lanes<Real> t = group.distance(probe, unsure);
                for (unsigned met = bits<Real>((t > 0) & (t <= most)) & ~unsure; met != 0; met &= met - 1) {
                    const int k = std::countr_zero(met);
                    if (visit(group.numbers[k], t[k]))
                        return true;
                }
                for (; unsure != 0; unsure &= unsure - 1)
                    if (look_at(group.numbers[std::countr_zero(unsure)]))
                        return true;
            }
            return false;
        };
        if (!wide.empty())
            found = wide.template search<shrinking>(probe, 0, most, look_at, look_at_group);
        else
#endif
            found = hierarchy.search(probe, 0, most, look_at);
        for (const int number : outside)
            found = look_at(number) || found;
        return found;
    }

    // HIT-6: of equal t the first in the order of HIT-2, in whatever order they come.
    [[gnu::noinline]] Hit<Real> nearest_of_hierarchy(const Probe<Real>& probe) const
    {
        Hit<Real> hit;
        search<true>(probe, hit.t, [&](int number, Real t) {
            if (t > 0 && (t < hit.t || (t == hit.t && number < hit.shape)))
                hit = {t, number};
            return false;
        });
        return hit;
    }

    [[gnu::noinline]] bool blocked_in_hierarchy(const Probe<Real>& feeler, Real distance_to_light) const
    {
        return search<false>(feeler, distance_to_light, [&](int, Real t) { return t > 0 && t < distance_to_light; });
    }
};
