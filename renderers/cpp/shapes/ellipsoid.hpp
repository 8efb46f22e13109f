#pragma once
#include "bounds.hpp"
#include "quadratic.hpp"
#include "../ray.hpp"

// The unit sphere, mapped by three semi-axes at any angle.
template<typename Real>
struct Ellipsoid {
    Vec3<Real> centre, axis[3], g[3];
    Real size = 0;

    explicit Ellipsoid(const double* row) : centre(rounded<Real>(vec(row)))
    {
        const auto reciprocals = reciprocal(vec(row + 3), vec(row + 6), vec(row + 9));
        for (int a = 0; a < 3; a++) {
            axis[a] = rounded<Real>(vec(row + 3 + 3 * a));
            g[a] = rounded<Real>(reciprocals[a]);
            size = std::max(size, largest(axis[a]));
        }
    }

    Vec3<Real> to_unit_sphere(Vec3<Real> a) const { return {dot(g[0], a), dot(g[1], a), dot(g[2], a)}; }

    // ELL-1, ELL-3
    Real distance(const Ray<Real>& ray) const
    {
        const Vec3<Real> f = to_unit_sphere(ray.origin - centre), d = to_unit_sphere(ray.direction);
        if constexpr (roots_of_formula)
            return first_root<Real>(dot(d, d), 2 * dot(f, d), dot(f, f) - 1);
        const Real a = dot(d, d), b = -dot(f, d);
        const Vec3<Real> l = f + (b / a) * d;
        const Real delta = 1 - dot(l, l);
        if (delta < 0)
            return 0;

        const Real k = dot(f, f) - 1, s = std::sqrt(a * delta);
        if (k > 0)
            return b > 0 ? k / (b + s) : 0;
        return b >= 0 ? (b + s) / a : k / (b - s);
    }

    // CSG-1: where the line goes in and out.
    bool crossed(const Ray<Real>& ray, Real& in, Real& out) const
    {
        const Vec3<Real> f = to_unit_sphere(ray.origin - centre), d = to_unit_sphere(ray.direction);
        const Real a = dot(d, d), b = -dot(f, d);
        const Vec3<Real> l = f + (b / a) * d;
        const Real delta = 1 - dot(l, l);
        if (!(delta >= 0))
            return false;

        const Real k = dot(f, f) - 1, s = std::sqrt(a * delta);
        if (b >= 0)
            in = b + s == 0 ? 0 : k / (b + s), out = (b + s) / a;
        else
            in = (b - s) / a, out = k / (b - s);
        return true;
    }

    // ELL-2
    Surface<Real> surface(const Ray<Real>& ray, Real t) const
    {
        const Vec3<Real> f = to_unit_sphere(ray.origin - centre), d = to_unit_sphere(ray.direction);
        const Vec3<Real> m = normalise(f + t * d);
        const Vec3<Real> n = normalise(m.x * g[0] + m.y * g[1] + m.z * g[2]);
        return {centre + m.x * axis[0] + m.y * axis[1] + m.z * axis[2], n, size};
    }

    // HIT-6: rounding moves its hits further than the bounds of a hierarchy are padded for.
    bool skewed() const { return !(skewness(axis, g) < 16); }
    bool always_tried() const { return roots_of_formula || skewed(); }

    Bounds<Real> bounds() const
    {
        const auto reach = [&](int a) { return std::hypot(axis[0][a], axis[1][a], axis[2][a]); };
        return around(centre, {reach(0), reach(1), reach(2)});
    }
};
