#pragma once
#include "bounds.hpp"
#include "probe.hpp"

#include <vector>

// Convex and planar, with three vertices or more.
template<typename Real>
struct Polygon {
    static constexpr bool in_plane = methods::triangle == TriangleForm::moller_trumbore;  // POL-4
    static constexpr Real grazing = Real(1) / 1024;  // |w| of POL-1 below which rounding can move t past the polygon
    static constexpr Real rounding = 4 * std::numeric_limits<Real>::epsilon();  // 8 u of POL-1

    struct Corner {
        Real place[3];
        [[no_unique_address]] Only<in_plane, Vec3<Real>, 'i'> inward;  // in the plane, at right angles to the edge

        Vec3<Real> point() const { return {place[0], place[1], place[2]}; }
    };

    Vec3<Real> normal;
    std::vector<Corner> corners;
    Real size = 0;

    Polygon(const double* vertices, int count)
    {
        const auto vertex = [&](int i) { return vec(vertices + 3 * (i % count)); };
        Vec3<double> area{0, 0, 0};
        for (int i = 1; i + 1 < count; i++)
            area = area + cross(vertex(i) - vertex(0), vertex(i + 1) - vertex(0));
        const Vec3<double> n = normalise(area);

        normal = rounded<Real>(n);
        for (int i = 0; i < count; i++) {
            const Vec3<Real> v = rounded<Real>(vertex(i));
            corners.push_back({{v.x, v.y, v.z}, {}});
            if constexpr (in_plane)
                corners.back().inward = rounded<Real>(cross(n, vertex(i + 1) - vertex(i)));
            size = std::max(size, largest(rounded<Real>(vertex(i) - vertex(0))));
        }
    }

    // POL-1
    Real distance(const Probe<Real>& probe) const
    {
        const Real w = dot(probe.direction, normal);
        if (w == 0)
            return 0;
        const Vec3<Real> vertex = corners[0].point();
        const Real height = dot(vertex - probe.origin, normal), t = height / w;
        if constexpr (in_plane)
            return t > 0 && surrounds(probe.origin + t * probe.direction) ? t : 0;
        else {
            const bool grazes = std::abs(w) < grazing;
            Real crossing;
            if (!((grazes || t > 0) && crosses_fan(probe, crossing)))
                return 0;
            if (std::abs(height) <= rounding * dot(absolute(normal), absolute(vertex) + absolute(probe.origin)))
                return 0;
            return grazes ? crossing : t;
        }
    }

    // POL-2: does the line cross a triangle between the first vertex and an edge? If so, at t, by TRI-1.
    bool crosses_fan(const Shear<Real>& ray, Real& t) const
    {
        const auto sheared = [&](const Corner& corner) -> Vec3<Real> {
            const Real along = corner.place[ray.kz] - ray.start[ray.kz];
            return {corner.place[ray.kx] - ray.start[ray.kx] - ray.sx * along,
                    corner.place[ray.ky] - ray.start[ray.ky] - ray.sy * along, along};
        };
        const auto edge = [](const Vec3<Real>& a, const Vec3<Real>& b) -> Real {
            if constexpr (methods::triangle == TriangleForm::watertight_kahan)
                return difference_of_products(a.x, b.y, a.y, b.x);
            else
                return a.x * b.y - a.y * b.x;
        };
        const Vec3<Real> a = sheared(corners[0]);
        Vec3<Real> b = sheared(corners[1]);
        Real w = edge(a, b);
        for (std::size_t i = 2; i < corners.size(); i++) {
            const Vec3<Real> c = sheared(corners[i]);
            const Real u = edge(b, c), v = edge(c, a);
            if (((u >= 0 && v >= 0 && w >= 0) || (u <= 0 && v <= 0 && w <= 0)) && u + v + w != 0) {
                t = (u * (ray.sz * a.z) + v * (ray.sz * b.z) + w * (ray.sz * c.z)) / (u + v + w);
                return true;
            }
            w = -v, b = c;
        }
        return false;
    }

    // POL-4
    bool surrounds(const Vec3<Real>& p) const
    {
        for (const Corner& corner : corners)
            if (!(dot(corner.inward, p - corner.point()) >= 0))
                return false;
        return true;
    }

    // POL-3
    Surface<Real> surface(const Ray<Real>& ray, Real t) const
    {
        const Vec3<Real> p = ray.origin + t * ray.direction;
        return {p - dot(p - corners[0].point(), normal) * normal, dot(ray.direction, normal) < 0 ? normal : -normal,
                size};
    }

    Bounds<Real> bounds() const
    {
        Bounds<Real> bounds;
        for (const Corner& corner : corners)
            bounds.hold(corner.point());
        return bounds;
    }
};
