#pragma once
#include "ray.hpp"

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

    // ELL-1
    Real distance(const Ray<Real>& ray) const
    {
        const Vec3<Real> f = to_unit_sphere(ray.origin - centre), d = to_unit_sphere(ray.direction);
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

    // ELL-2
    Surface<Real> surface(const Ray<Real>& ray, Real t) const
    {
        const Vec3<Real> f = to_unit_sphere(ray.origin - centre), d = to_unit_sphere(ray.direction);
        const Vec3<Real> m = normalise(f + t * d);
        const Vec3<Real> n = normalise(m.x * g[0] + m.y * g[1] + m.z * g[2]);
        return {centre + m.x * axis[0] + m.y * axis[1] + m.z * axis[2], n, size};
    }
};
