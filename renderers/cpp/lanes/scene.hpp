// VEC-1: a scene for rays in lanes: what each of them meets first, what is in their way, and the surfaces they hit.
#pragma once
#include "media.hpp"
#include "solids.hpp"
#include "spheres.hpp"
#include "../media.hpp"
#include "../shapes/shapes.hpp"
#include "../trace.hpp"

#include <map>

// The forms that a surface has: of a sphere, of a plane (sides of boxes, polygons, triangles), of an ellipsoid. Parts of
// solids are among them.
enum Form { form_sphere, form_plane, form_ellipsoid, forms };

// A face is what a ray can hit: its number is 8 row + 4 if a solid is left there + form, with its row in the table of
// its form.
constexpr int face_form = 3, face_leaves = 4, face_rows = 3;

// A row for each face. Of an ellipsoid, `normal[0]` is the bits of its number.
template<typename Real>
struct LaneFace {
    Real place[3], size, role, normal[3];  // a point of the plane, or the centre; size: of OFF-1; role: bits
};

// What a face is apart from its form: a row for each material and place in the media.
template<typename Real>
struct LaneRole {
    Real diffuse[3], specular, exponent, from_air_n, from_air_m, into_air_n, into_air_m;
    Real clear, rank, medium, kind, lobe, unused[2];
    enum { solid, flat, part };  // kind; flat: MED-4; part: of a CSG solid
};

// Shapes of each kind, in the order of HIT-2.
template<typename Real>
struct LaneShapes {
    template<typename Shape>
    struct Entry {
        const Shape* shape;
        int face;  // the first of its faces
        Vec3<double> centre;
        double radius;  // of a ball that holds it
    };

    LaneSpheres<Real> spheres;
    [[no_unique_address]] List<needs::box, Entry<Box<Real>>, 'b'> boxes;
    [[no_unique_address]] List<needs::polygon, Entry<Polygon<Real>>, 'p'> polygons;
    [[no_unique_address]] List<needs::ellipsoid, Entry<Ellipsoid<Real>>, 'e'> ellipsoids;
    [[no_unique_address]] List<needs::mesh, Entry<Triangle<Real>>, 't'> triangles;
    [[no_unique_address]] List<needs::csg, Entry<Solid<Real>>, 'c'> solids;

    // Those that a ray of the cone may meet (VEC-2).
    void keep(const LaneShapes& all, const Cone& cone)
    {
        const auto filter = [&](const auto& from, auto& to) {
            to.clear();
            for (const auto& entry : from)
                if (cone.meets(entry.centre, entry.radius))
                    to.push_back(entry);
        };
        spheres.list.clear();
        for (const LaneSphere<Real>& sphere : all.spheres.list)
            if (cone.meets({double(sphere.centre.x), double(sphere.centre.y), double(sphere.centre.z)}, sphere.radius))
                spheres.list.push_back(sphere);
        if constexpr (needs::box)
            filter(all.boxes, boxes);
        if constexpr (needs::polygon)
            filter(all.polygons, polygons);
        if constexpr (needs::ellipsoid)
            filter(all.ellipsoids, ellipsoids);
        if constexpr (needs::mesh)
            filter(all.triangles, triangles);
        if constexpr (needs::csg)
            filter(all.solids, solids);
    }
};

// What a thread has of its own for the shapes that are asked one ray after another.
template<typename Real>
struct LaneDesk : Desk<Real> {
    Probe<Real> probe(const LaneProbe<Real>& rays, int k) { return Desk<Real>::probe(rays.ray(k)); }
};

template<typename Real>
class LaneScene {
    using L = Lanes<Real>;
    using I = Integers<Real>;

public:
    LaneShapes<Real> all_shapes;
    std::vector<Real> faces[forms];  // rows of LaneFace
    std::vector<Real> roles;         // rows of LaneRole
    std::vector<const Ellipsoid<Real>*> ellipsoids;

    static constexpr int face_fields = sizeof(LaneFace<Real>) / sizeof(Real);
    static constexpr int role_fields = sizeof(LaneRole<Real>) / sizeof(Real);

    // shapes must stay where they are. eye: where rays start, and as far from there as `lens`.
    LaneScene(const Tracer<Real>& tracer, const LaneMedia<Real>& media, Vec3<double> eye, double lens, bool few)
        : shapes(tracer.shapes), media(media), few(few)
    {
        shapes.any_kind([&](const auto& list) {
            for (const auto& shape : list)
                add(shape, tracer);
            return false;
        });
        for (std::vector<Real>& table : faces)
            table.resize(table.size() + std::size_t(lane_count<Real>));  // rows are read by whole vectors
        roles.resize(roles.size() + std::size_t(lane_count<Real>));
        add_spheres(tracer, eye, lens);
    }

    // HIT-1, HIT-2
    LANE LaneHit<Real> nearest(const LaneShapes<Real>& among, Mask<Real> asks, const LaneProbe<Real>& probe,
                               LaneDesk<Real>& desk) const
    {
        LaneHit<Real> hit;
        if (few)
            nearest_of_all(among, asks, probe, desk, hit);
        else
            nearest_one_by_one(asks, probe, desk, hit);
        return hit;
    }

    // HIT-5, of the lanes that ask.
    LANE Mask<Real> blocked(Mask<Real> asks, const LaneProbe<Real>& probe, L distance, LaneDesk<Real>& desk) const
    {
        Mask<Real> found{};
        if (few)
            block_by_all(asks, probe, distance, desk, found);
        else
            block_one_by_one(asks, probe, distance, desk, found);
        return found & asks;
    }

private:
    const Shapes<Real>& shapes;
    const LaneMedia<Real>& media;
    bool few;                        // each ray against each shape; else each ray through the hierarchy (VEC-3)
    std::vector<int> first_face;     // of each shape
    std::vector<std::vector<int>> part_faces;  // of each solid: the first of each part
    std::map<std::array<int, 3>, int> known;   // roles, by material, rank and kind

    int add_face(Form form, Vec3<Real> place, Real size, int role, Vec3<Real> normal = {})
    {
        std::vector<Real>& table = faces[form];
        const int number = int(table.size()) / face_fields;
        table.insert(table.end(), {place.x, place.y, place.z, size, std::bit_cast<Real>(Integer<Real>(role)), normal.x,
                                   normal.y, normal.z});
        return number << face_rows | form;
    }

    int role(const Tracer<Real>& tracer, const Role& role, int kind)
    {
        const auto [place, fresh] = known.try_emplace({role.material, role.rank, kind}, int(known.size()));
        if (fresh) {
            const Material<Real>& m = tracer.materials[std::size_t(role.material)];
            const Real medium = std::bit_cast<Real>(Integer<Real>(media.kind(role.material)));
            const Real rank = std::bit_cast<Real>(Integer<Real>(role.rank));
            roles.insert(roles.end(),
                         {m.diffuse.x, m.diffuse.y, m.diffuse.z, m.specular, m.exponent, m.from_air.n, m.from_air.m,
                          m.into_air.n, m.into_air.m, Real(m.clear), rank, medium, Real(kind), m.lobe, 0, 0});
        }
        return place->second;
    }

    int add_surface(const Sphere<Real>& sphere, int role)
    {
        return add_face(form_sphere, sphere.centre, sphere.radius, role);
    }

    int add_surface(const Box<Real>& box, int role)
    {
        const int first = int(faces[form_plane].size()) / face_fields << face_rows | form_plane;
        for (int a = 0; a < 3; a++) {
            add_face(form_plane, box.corner, box.size, role, -box.normal[a]);
            add_face(form_plane, box.corner + box.edge[a], box.size, role, box.normal[a]);
        }
        return first;
    }

    int add_surface(const Polygon<Real>& polygon, int role)
    {
        return add_face(form_plane, polygon.corners[0].point(), polygon.size, role, polygon.normal);
    }

    int add_surface(const Triangle<Real>& triangle, int role)
    {
        return add_face(form_plane, triangle.point(0), triangle.size, role, triangle.normal);
    }

    int add_surface(const Ellipsoid<Real>& ellipsoid, int role)
    {
        ellipsoids.push_back(&ellipsoid);
        return add_face(form_ellipsoid, ellipsoid.centre, ellipsoid.size, role,
                        {std::bit_cast<Real>(Integer<Real>(ellipsoids.size() - 1)), 0, 0});
    }

    template<typename Shape>
    void add(const Shape& shape, const Tracer<Real>& tracer)
    {
        const Role& mine = shapes.roles[first_face.size()];
        constexpr bool solid = std::is_same_v<Shape, Solid<Real>>;
        const int number = role(tracer, mine, solid ? 2 : mine.flat);
        const Bounds<Real> bounds = shape.bounds();
        const Vec3<double> low = vec(bounds.low), high = vec(bounds.high), centre = 0.5 * low + 0.5 * high;
        const double radius = (1 + 1e-5) * length(high - centre);
        if constexpr (solid) {
            first_face.push_back(int(part_faces.size()));
            std::vector<int>& list = part_faces.emplace_back();
            shape.each_part([&](const auto& part) { list.push_back(add_part(part, number)); });
            all_shapes.solids.push_back({&shape, int(part_faces.size()) - 1, centre, radius});
        } else {
            const int face = add_surface(shape, number);
            first_face.push_back(face);
            if constexpr (std::is_same_v<Shape, Box<Real>>)
                all_shapes.boxes.push_back({&shape, face, centre, radius});
            if constexpr (std::is_same_v<Shape, Polygon<Real>>)
                all_shapes.polygons.push_back({&shape, face, centre, radius});
            if constexpr (std::is_same_v<Shape, Ellipsoid<Real>>)
                all_shapes.ellipsoids.push_back({&shape, face, centre, radius});
            if constexpr (std::is_same_v<Shape, Triangle<Real>>)
                if (few)
                    all_shapes.triangles.push_back({&shape, face, centre, radius});
        }
    }

    template<typename Part>
    int add_part(const Part& part, int role)
    {
        if constexpr (std::is_same_v<Part, MeshPart<Real>>) {
            const int first = int(faces[form_plane].size()) / face_fields << face_rows | form_plane;
            for (const Triangle<Real>& triangle : part.triangles)
                add_surface(triangle, role);
            return first;
        } else
            return add_surface(part, role);
    }

    static Vec3<double> vec(Vec3<Real> a) { return {a.x, a.y, a.z}; }

    // A ray can start at the eye, or on a shape and as far from it as OFF-1 says; in a clear sphere, too.
    void add_spheres(const Tracer<Real>& tracer, Vec3<double> eye, double lens)
    {
        if constexpr (needs::sphere) {
            constexpr double slack = 1e-3;  // of the sizes: more than rounding is
            constexpr std::size_t many = 1 << 12;  // too many to ask for each pair

            struct Ball {
                Vec3<double> centre;
                double radius;
            };
            std::vector<Ball> balls;
            shapes.any_kind([&](const auto& list) {
                for (const auto& shape : list) {
                    const Bounds<Real> bounds = shape.bounds();
                    const Vec3<double> low = vec(bounds.low), high = vec(bounds.high);
                    if constexpr (std::is_same_v<decltype(shape), const Sphere<Real>&>)
                        balls.push_back({vec(shape.centre), double(shape.radius)});
                    else
                        balls.push_back({0.5 * low + 0.5 * high, 0.5 * length(high - low)});
                }
                return false;
            });
            std::size_t number = 0;
            for (const Sphere<Real>& sphere : shapes.list_of_spheres()) {
                const Ball mine = balls[number];
                const auto near = [&](const Ball& other) {
                    const double offset = double(tracer.epsilon) * (other.radius + length(other.centre));
                    return length(other.centre - mine.centre) <
                           mine.radius + other.radius + offset + slack * (mine.radius + other.radius);
                };
                const Role& role = shapes.roles[number];
                const bool clear = needs::transmission && tracer.materials[std::size_t(role.material)].clear;
                bool entered = clear || balls.size() > many || near({eye, lens});
                for (std::size_t i = 0; i < balls.size() && !entered; i++)
                    entered = i != number && near(balls[i]);
                all_shapes.spheres.list.emplace_back(sphere, entered, Integer<Real>(first_face[number]));
                number++;
            }
        }
    }

    // May the line of a lane meet the ball that holds a shape?
    template<typename Entry>
    LANE static Mask<Real> near(const Entry& entry, const LaneProbe<Real>& probe)
    {
        constexpr Real slack = 64 * std::numeric_limits<Real>::epsilon();
        const Real radius = Real(entry.radius), square = radius * radius;
        const Vec3<L> f = all(rounded<Real>(entry.centre)) - probe.origin;
        const L b = fused_dot<Real>(f, probe.direction), far = fused_dot<Real>(f, f);
        const Vec3<L> l = along<Real>(f, -b, probe.direction);
        return (fused_dot<Real>(l, l) <= square + slack * (square + far)) & ((b >= 0) | (far <= square * 4));
    }

    [[gnu::noinline]] void nearest_of_all(const LaneShapes<Real>& among, [[maybe_unused]] Mask<Real> asks,
                             const LaneProbe<Real>& probe, [[maybe_unused]] LaneDesk<Real>& desk,
                             LaneHit<Real>& hit) const
    {
        if constexpr (needs::sphere)
            among.spheres.nearest(probe, hit);
        if constexpr (needs::box)
            for (const auto& entry : among.boxes) {
                const LaneSpan<Real> span(*entry.shape, probe);
                const Mask<Real> outside = span.in > 0, met = span.in <= span.out;
                const I side = outside ? span.face_in : span.face_out;
                hit.take(met ? (outside ? span.in : span.out) : L{}, (side << face_rows) + Integer<Real>(entry.face));
            }
        if constexpr (needs::polygon)
            if (!among.polygons.empty()) {
                const LaneShear<Real> shear(probe);
                for (const auto& entry : among.polygons)
                    hit.take(meet(*entry.shape, probe, shear, hit.t), every<Real>(entry.face));
            }
        if constexpr (needs::ellipsoid)
            for (const auto& entry : among.ellipsoids)
                hit.take(meet(*entry.shape, probe, hit.t), every<Real>(entry.face));
        if constexpr (needs::mesh)
            if (!among.triangles.empty()) {
                const LaneShear<Real> shear(probe);
                for (const auto& entry : among.triangles)
                    hit.take(meet(*entry.shape, shear, hit.t), every<Real>(entry.face));
            }
        if constexpr (needs::csg)
            for (const auto& entry : among.solids) {
                const LaneSolidHit found = meet_solid(entry, asks, probe, desk);
                hit.take(found.t, found.face);
            }
    }

    [[gnu::noinline]] void block_by_all(Mask<Real> asks, const LaneProbe<Real>& probe, L distance,
                           [[maybe_unused]] LaneDesk<Real>& desk, Mask<Real>& found) const
    {
        const auto done = [&](L t) {
            found |= (t > 0) & (t < distance);
            return !any<Real>(asks & ~found);
        };
        if constexpr (needs::sphere)
            all_shapes.spheres.block(asks, probe, distance, found);
        if (!any<Real>(asks & ~found))
            return;
        if constexpr (needs::box)
            for (const auto& entry : all_shapes.boxes)
                if (done(meet(*entry.shape, probe, distance)))
                    return;
        if constexpr (needs::polygon)
            if (!all_shapes.polygons.empty()) {
                const LaneShear<Real> shear(probe);
                for (const auto& entry : all_shapes.polygons)
                    if (done(meet(*entry.shape, probe, shear, distance)))
                        return;
            }
        if constexpr (needs::ellipsoid)
            for (const auto& entry : all_shapes.ellipsoids)
                if (done(meet(*entry.shape, probe, distance)))
                    return;
        if constexpr (needs::mesh)
            if (!all_shapes.triangles.empty()) {
                const LaneShear<Real> shear(probe);
                for (const auto& entry : all_shapes.triangles)
                    if (done(meet(*entry.shape, shear, distance)))
                        return;
            }
        if constexpr (needs::csg)
            for (const auto& entry : all_shapes.solids)
                if (done(meet_solid(entry, asks & ~found, probe, desk).t))
                    return;
    }

    struct LaneSolidHit {
        L t;
        I face;
    };

    template<typename Entry>
    [[gnu::noinline]] LaneSolidHit meet_solid(const Entry& entry, Mask<Real> asks, const LaneProbe<Real>& probe,
                                 LaneDesk<Real>& desk) const
    {
        const Mask<Real> close = asks & near(entry, probe);
        LaneSolidHit hit{};
        if (!any<Real>(close))
            return hit;
        const LaneSolid<Real> solid(*entry.shape);
        const std::vector<int>& list = part_faces[std::size_t(entry.face)];
        unsigned alone = bits<Real>(close);
        if (solid.fits()) {
            unsigned unsure = 0;
            const LaneBoundary<Real> boundary = solid.nearest(probe, unsure);
            alone &= unsure;
            hit.t = close ? boundary.t : L{};
            for (int p = 0; p < int(list.size()); p++) {
                const I first = every<Real>(list[std::size_t(p)]);
                const I face = entry.shape->is_box(p) ? first + ((boundary.face & 7) << face_rows) : first;
                hit.face = boundary.part == Integer<Real>(p) ? face : hit.face;
            }
            hit.face = boundary.leaves ? hit.face | Integer<Real>(face_leaves) : hit.face;
        }
        for (; alone != 0; alone &= alone - 1) {
            const int k = std::countr_zero(alone);
            const auto [t, face] = solid_face(*entry.shape, list, desk.probe(probe, k));
            hit.t[k] = t, hit.face[k] = face;
        }
        return hit;
    }

    std::pair<Real, int> solid_face(const Solid<Real>& solid, const std::vector<int>& list, const Probe<Real>& probe) const
    {
        const Boundary<Real>* boundary = solid.nearest(probe);
        if (!boundary)
            return {0, -1};
        const Crossing<Real>& crossing = boundary->crossing;
        return {crossing.t, list[std::size_t(crossing.part)] + (solid.side(crossing) << face_rows) +
                                (boundary->leaves ? face_leaves : 0)};
    }

    // VEC-3
    [[gnu::noinline]] void nearest_one_by_one(Mask<Real> asks, const LaneProbe<Real>& probe, LaneDesk<Real>& desk,
                                              LaneHit<Real>& hit) const
    {
        for (unsigned left = bits<Real>(asks); left != 0; left &= left - 1) {
            const int k = std::countr_zero(left);
            const Probe<Real> one = desk.probe(probe, k);
            const Hit<Real> found = shapes.nearest(one);
            if (found.shape < 0)
                continue;
            hit.t[k] = found.t;
            hit.face[k] = face_of(found, one);
        }
    }

    [[gnu::noinline]] void block_one_by_one(Mask<Real> asks, const LaneProbe<Real>& probe, L distance,
                                            LaneDesk<Real>& desk, Mask<Real>& found) const
    {
        for (unsigned left = bits<Real>(asks); left != 0; left &= left - 1) {
            const int k = std::countr_zero(left);
            found[k] = -Integer<Real>(shapes.blocked(desk.probe(probe, k), distance[k]));
        }
    }

    int face_of(const Hit<Real>& hit, const Probe<Real>& probe) const
    {
        int face = first_face[std::size_t(hit.shape)];
        shapes.with_shape(hit.shape, [&](const auto& shape) {
            using Shape = std::remove_cvref_t<decltype(shape)>;
            if constexpr (std::is_same_v<Shape, Box<Real>>) {
                const auto span = shape.own_span(probe);
                const auto side = span.t0 > 0 ? span.in : span.out;
                face += (2 * side.axis + side.high) << face_rows;
            }
            if constexpr (std::is_same_v<Shape, Solid<Real>>)
                face = solid_face(shape, part_faces[std::size_t(face)], probe).second;
        });
        return face;
    }
};
