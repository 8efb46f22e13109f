// VEC-1: from streams of rays to streams of hits, their light, and streams of mirrored rays. Of mirrors, one after
// the other (the walk `chain`): spheres, point lights, hard shadows.
#pragma once
#include "counts.hpp"
#include "job.hpp"
#include "lane_power.hpp"
#include "lane_spheres.hpp"
#include "shade.hpp"

// Rows of numbers in columns, of which some lanes are added and full lanes are read.
template<typename Real, int columns>
class Stream {
public:
    explicit Stream(std::size_t room) : pitch(room + std::size_t(lane_count<Real>)), numbers(columns * pitch) {}

    int count = 0;

    // One value for each column.
    template<typename... Values>
    LANE void add(Mask<Real> wanted, const Values&... values)
    {
        static_assert(sizeof...(values) == columns);
        Real* to = numbers.data() + count;
        ((compress<Real>(wanted, values, to), to += pitch), ...);
        count += ::count<Real>(wanted);
    }

    LANE Lanes<Real> at(int column, int first) const
    {
        return load(numbers.data() + std::size_t(column) * pitch + first);
    }

    LANE Vec3<Lanes<Real>> vector_at(int column, int first) const
    {
        return {at(column, first), at(column + 1, first), at(column + 2, first)};
    }

private:
    std::size_t pitch;
    std::vector<Real> numbers;
};

template<typename Real> using LaneRays = Stream<Real, 8>;  // origin, direction, weight, pixel
template<typename Real> using LaneHits = Stream<Real, 9>;  // a point on the ray, direction, weight, pixel, sphere

// What there is to know of a sphere that was hit, a row for each.
template<typename Real>
struct LaneSurface {
    static constexpr int fields = 13;
    Real centre[3], radius, diffuse[3], specular, exponent, from_air_n, from_air_m, into_air_n, into_air_m, unused[3];
};

// What a thread has of its own.
template<typename Real>
struct alignas(128) LaneWorker {
    LaneRays<Real> rays;
    LaneHits<Real> hits;
    LaneSpheres<Real> ahead;  // of the tile's eye rays
    std::vector<Real> colours[3];
    Counts counts;

    explicit LaneWorker(std::size_t room)
        : rays(room), hits(room), colours{std::vector<Real>(room), std::vector<Real>(room), std::vector<Real>(room)}
    {
    }

    void add_colour(int pixel, Vec3<Real> c)
    {
        colours[0][std::size_t(pixel)] += c.x;
        colours[1][std::size_t(pixel)] += c.y;
        colours[2][std::size_t(pixel)] += c.z;
    }
};

template<typename Real>
class LaneTracer {
    using L = Lanes<Real>;
    using V = Vec3<L>;

public:
    LaneSpheres<Real> spheres;

    LaneTracer(const Scene& scene, const Job& job)
        : spheres(scene, vec(scene.camera.row(0)) + vec(scene.camera.row(3)), job.epsilon),
          background(rounded<Real>(vec(scene.background.row(0)))), epsilon(Real(job.epsilon)),
          depth(needs::reflection ? job.depth : 0), shadows(needs::shadows && job.shadows),
          ambient(rounded<Real>(vec(scene.ambient.row(0))))
    {
        for (std::size_t i = 0; i < scene.lights.rows(); i++)
            lights.emplace_back(scene.lights.row(i));
        for (std::size_t i = 0; i < scene.spheres.rows(); i++) {
            const double* row = scene.spheres.row(i);
            const std::size_t number = std::size_t(scene.sphere_ids.row(i)[1]);
            const Material<Real> material(scene.materials.row(number), scene.air.data.data());
            const Vec3<Real> centre = rounded<Real>(vec(row)), diffuse = material.diffuse;
            surfaces.push_back({{centre.x, centre.y, centre.z}, Real(row[3]), {diffuse.x, diffuse.y, diffuse.z},
                                material.specular, material.exponent, material.from_air.n, material.from_air.m,
                                material.into_air.n, material.into_air.m, {}});
        }
    }

    // The first hits of rays of a weight, into worker.hits; what misses has the background (REF-6).
    LANE void meet(const LaneSpheres<Real>& among, Mask<Real> active, const V& origin, const V& direction, L weight,
              L pixel, LaneWorker<Real>& worker) const
    {
        const LaneHit<Real> hit = among.nearest(origin, direction);
        const Mask<Real> hits = active & (hit.sphere >= 0);
        const V point = along<Real>(origin, hit.t, direction);
        if (any<Real>(hits))
            worker.hits.add(hits, point.x, point.y, point.z, direction.x, direction.y, direction.z, weight, pixel,
                            hit.sphere);
        if (background.x != 0 || background.y != 0 || background.z != 0)
            add_colours(active & ~hits, pixel, {weight * background.x, weight * background.y, weight * background.z},
                        worker);
    }

    // The light of worker.hits, and of all the rays that come after them.
    void follow(LaneWorker<Real>& worker) const
    {
        for (int order = 0; worker.hits.count > 0; order++) {
            worker.rays.count = 0;
            for (int first = 0; first < worker.hits.count; first += lane_count<Real>)
                shade(first, order < depth, worker);
            worker.hits.count = 0;
            for (int first = 0; first < worker.rays.count; first += lane_count<Real>) {
                const LaneRays<Real>& rays = worker.rays;
                meet(spheres, up_to(rays.count - first), rays.vector_at(0, first), rays.vector_at(3, first),
                     rays.at(6, first), rays.at(7, first), worker);
            }
        }
    }

    // The first so many lanes.
    LANE static Mask<Real> up_to(int count) { return lanes_of<Real>([](int k) { return k; }) < Real(count); }

private:
    Vec3<Real> background;
    Real epsilon;
    int depth;
    bool shadows;
    Vec3<Real> ambient;
    std::vector<Light<Real>> lights;
    std::vector<LaneSurface<Real>> surfaces;

    LANE static void add_colours(Mask<Real> which, L pixel, const V& colour, LaneWorker<Real>& worker)
    {
        for (int k = 0; k < lane_count<Real>; k++)
            if (which[k])
                worker.add_colour(int(pixel[k]), {colour.x[k], colour.y[k], colour.z[k]});
    }

    // Of each lane its sphere's row.
    struct Surfaces {
        V centre, diffuse;
        L radius, specular, exponent, from_air_n, from_air_m, into_air_n, into_air_m;
    };

    LANE Surfaces gather(L sphere) const
    {
        constexpr int n = lane_count<Real>, fields = LaneSurface<Real>::fields;
        L columns[fields];
        for (int part = 0; part < fields; part += n) {
            L rows[n];
            for (int k = 0; k < n; k++)
                rows[k] = load(surfaces[std::size_t(sphere[k])].centre + part);
            transpose<Real>(rows);
            std::copy(rows, rows + std::min(n, fields - part), columns + part);
        }
        return {{columns[0], columns[1], columns[2]}, {columns[4], columns[5], columns[6]}, columns[3], columns[7],
                columns[8], columns[9], columns[10], columns[11], columns[12]};
    }

    void shade(int first, bool goes_on, LaneWorker<Real>& worker) const
    {
        const LaneHits<Real>& hits = worker.hits;
        const Mask<Real> active = up_to(hits.count - first);
        const V direction = hits.vector_at(3, first), seen = hits.vector_at(0, first);
        const L weight = hits.at(6, first), pixel = hits.at(7, first);
        const Surfaces at = gather(hits.at(8, first));

        const V normal = normalise<Real>(seen - at.centre);
        const V point = along<Real>(at.centre, at.radius, normal);  // SPH-2
        const L d_n = fused_dot<Real>(direction, normal);
        const V outward = offset(point, normal, at.radius);  // OFF-1

        V sum{};
        if constexpr (needs::ambient)
            sum = {at.diffuse.x * ambient.x, at.diffuse.y * ambient.y, at.diffuse.z * ambient.z};  // LOC-1
        if constexpr (needs::diffuse || needs::phong || needs::shadows)
            for (const Light<Real>& light : lights)
                add_light(light, active, direction, normal, point, d_n, at, outward, sum, worker);
        add_colours(active, pixel, {weight * sum.x, weight * sum.y, weight * sum.z}, worker);

        if constexpr (needs::reflection)
            if (goes_on)
                reflect(active, direction, normal, point, d_n, at, outward, weight, pixel, worker);
    }

    // OFF-1: how far a ray starts from the surface, times the normal.
    LANE V offset(const V& point, const V& normal, L radius) const
    {
        const L far = size<Real>(normal.x * point.x) + size<Real>(normal.y * point.y) + size<Real>(normal.z * point.z);
        const L distance = epsilon * fma<Real>(far, all(Real(0.125)), radius);
        return {distance * normal.x, distance * normal.y, distance * normal.z};
    }

    // LOC-2 to LOC-4
    LANE void add_light(const Light<Real>& light, Mask<Real> active, const V& direction, const V& normal,
                   const V& point, L d_n, const Surfaces& at, const V& outward, V& sum, LaneWorker<Real>& worker) const
    {
        const V to_light = all(light.position) - point;
        const L square = fused_dot<Real>(to_light, to_light), inverse = inverse_root<Real>(square);
        const V l{inverse * to_light.x, inverse * to_light.y, inverse * to_light.z};
        const L n_l = fused_dot<Real>(normal, l);
        Mask<Real> lit = active & (n_l > 0);
        if (needs::shadows && shadows) {
            worker.counts.shadow += count<Real>(lit);
            if (any<Real>(lit))
                lit &= ~spheres.blocked(lit, point + outward, l, square * inverse);
        }
        if (!any<Real>(lit))
            return;
        if constexpr (needs::diffuse) {
            const L share = lit ? n_l : L{};
            sum.x = fma<Real>(share, at.diffuse.x * light.colour.x, sum.x);
            sum.y = fma<Real>(share, at.diffuse.y * light.colour.y, sum.y);
            sum.z = fma<Real>(share, at.diffuse.z * light.colour.z, sum.z);
        }
        if constexpr (needs::phong) {
            const L c = fused_dot<Real>(l, direction) - 2 * n_l * d_n;
            const Mask<Real> shines = lit & (c > 0) & (at.specular != 0);
            if (!any<Real>(shines))
                return;
            const L least = all(std::numeric_limits<Real>::min()), base = c > 1 ? all(Real(1)) : c < least ? least : c;
            const L share = shines ? at.specular * power<Real>(base, at.exponent) : L{};
            sum.x = fma<Real>(share, all(light.colour.x), sum.x);
            sum.y = fma<Real>(share, all(light.colour.y), sum.y);
            sum.z = fma<Real>(share, all(light.colour.z), sum.z);
        }
    }

    // REF-2 to REF-4, of opaque things
    LANE void reflect(Mask<Real> active, const V& direction, const V& normal, const V& point, L d_n,
                 const Surfaces& at, const V& outward, L weight, L pixel, LaneWorker<Real>& worker) const
    {
        const Mask<Real> enters = d_n <= 0;
        const L n = enters ? at.from_air_n : at.into_air_n;
        const L m = enters ? at.from_air_m : at.into_air_m;
        const L cosine = size<Real>(d_n), c = cosine > 1 ? all(Real(1)) : cosine;
        const L x = 1 - n * n * (1 - c * c);
        const L s = root<Real>(x > 0 ? x : L{});
        const L a = (n * c - m * s) / (n * c + m * s), b = (m * c - n * s) / (m * c + n * s);
        const L part = x > 0 ? (a * a + b * b) / 2 : all(Real(1));
        const L share = (n == 1) & (m == 1) ? L{} : at.specular * part;

        const Mask<Real> mirrors = active & (share != 0);
        const V mirrored = normalise<Real>(along<Real>(direction, -2 * d_n, normal));  // REF-3, NUM-4
        const L side = enters ? all(Real(1)) : all(Real(-1));
        const V start = along<Real>(point, side, outward);
        worker.rays.add(mirrors, start.x, start.y, start.z, mirrored.x, mirrored.y, mirrored.z, weight * share, pixel);
        worker.counts.reflected += count<Real>(mirrors);
    }
};
