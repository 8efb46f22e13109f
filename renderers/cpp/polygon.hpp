#pragma once
#include "bounds.hpp"
#include "ray.hpp"

#include <vector>

// Convex and planar, with three vertices or more.
template<typename Real>
struct Polygon {
    struct Edge {
        Vec3<Real> start, inward;  // inward: in the plane, at right angles to the edge, of any length
    };

    Vec3<Real> normal;
    std::vector<Edge> edges;
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
            edges.push_back({rounded<Real>(vertex(i)), rounded<Real>(cross(n, vertex(i + 1) - vertex(i)))});
            size = std::max(size, largest(rounded<Real>(vertex(i) - vertex(0))));
        }
    }

    // POL-1, POL-2
    Real distance(const Ray<Real>& ray) const
    {
        const Real w = dot(ray.direction, normal);
        if (w == 0)
            return 0;
        const Real t = dot(edges[0].start - ray.origin, normal) / w;
        if (!(t > 0))
            return 0;
        const Vec3<Real> p = ray.origin + t * ray.direction;
        for (const Edge& edge : edges)
            if (!(dot(edge.inward, p - edge.start) >= 0))
                return 0;
        return t;
    }

    // POL-3
    Surface<Real> surface(const Ray<Real>& ray, Real t) const
    {
        const Vec3<Real> p = ray.origin + t * ray.direction;
        return {p - dot(p - edges[0].start, normal) * normal, dot(ray.direction, normal) < 0 ? normal : -normal, size};
    }

    Bounds<Real> bounds() const
    {
        Bounds<Real> bounds;
        for (const Edge& edge : edges)
            bounds.hold(edge.start);
        return bounds;
    }
};
